// Columns times what each row is worth in the picture.

#include "prt/picture_sum.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/simd.h"
#include "prt/stored_blocks.h"
#include "prt/tile_codec.h"

namespace haarlight {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kBlockRows);
constexpr int kColumnsOfTask = 64;

HAARLIGHT_MULTIVERSION double dot(const std::int8_t* values, const double* weight) {
  double lane[4] = {};
  for (std::size_t r = 0; r < kRows; r += 4) {
    for (std::size_t i = 0; i < 4; ++i)
      lane[i] += static_cast<double>(values[r + i]) * weight[r + i];
  }
  return (lane[0] + lane[1]) + (lane[2] + lane[3]);
}

}  // namespace

// sum over vertices of share x factor x what the row is of the vertex, colours applied.
void PictureSum::weigh_rows(const PictureView& view) {
  const TransportInfo& info = transport_.info();
  const auto terms = static_cast<std::size_t>(info.terms);
  row_weight_.assign(3 * static_cast<std::size_t>(transport_.rows()), 0.0);
  const auto add = [&](std::size_t row, const RgbD& weight) {
    double* block = row_weight_.data() + row / kRows * 3 * kRows + row % kRows;
    block[0] += weight.r;
    block[kRows] += weight.g;
    block[2 * kRows] += weight.b;
  };
  const auto worth = [&](std::size_t v, std::size_t k) {
    const auto share = static_cast<double>(view.vertex_weights[v]);
    return share * (view.factors.empty() ? RgbD{1, 1, 1} : RgbD(view.factors[v * terms + k]));
  };
  shares_ = 0;
  for (const float share : view.vertex_weights) shares_ += static_cast<double>(share);
  if (!info.clusters) {
    for (std::size_t row = 0; row < static_cast<std::size_t>(transport_.rows()); ++row) {
      const std::uint32_t output = transport_.row_output()[row];
      if (output == kNoOutput) continue;
      add(row, RgbD(transport_.row_color()[row]) * worth(output / terms, output % terms));
    }
    return;
  }
  const ClusterWeights& w = *info.clusters;
  const std::vector<std::size_t> begin = w.weight_begin();
  for (std::size_t c = 0; c < static_cast<std::size_t>(w.clusters()); ++c) {
    const std::size_t vectors = w.vectors_of(c), count = w.vertices_of(c);
    for (std::size_t p = 0; p < count; ++p) {
      const std::size_t place = w.first_vertex[c] + p, v = w.vertex[place];
      if (view.vertex_weights[v] == 0) continue;
      for (std::size_t k = 0; k < terms; ++k) {
        RgbD of_vertex = worth(v, k);
        if (!w.tint.empty()) {
          of_vertex = of_vertex * RgbD(ClusterWeights::tint_of(w.tint[place * terms + k]));
        }
        for (std::size_t i = 0; i < vectors; ++i) {
          const std::size_t row = w.first_vector[c] * terms + k * vectors + i;
          const double size = static_cast<double>(w.weight[begin[c] + i * count + p]) *
                              static_cast<double>(w.scale[w.first_vector[c] + i]) *
                              static_cast<double>(transport_.row_color()[row].r);
          add(row, size * of_vertex);
        }
      }
    }
  }
}

void PictureSum::look(const PictureView& view) {
  weigh_rows(view);
  const int columns = transport_.layout().size();
  sum_.assign(static_cast<std::size_t>(columns), RgbD{});
  parallel_for((columns + kColumnsOfTask - 1) / kColumnsOfTask, [&](int task) {
    const int begin = task * kColumnsOfTask, end = std::min(begin + kColumnsOfTask, columns);
    for (int j = begin; j < end; ++j) {
      double sum[3] = {};
      for (int chunk = 0; chunk < transport_.chunk_count(); ++chunk) {
        for_stored_blocks(
            transport_.column(chunk, j), transport_.rgb_blocks(chunk),
            [&](std::size_t b, bool rgb, const std::uint16_t* scale, const std::int8_t* values) {
              const std::size_t block = static_cast<std::size_t>(chunk) * kChunkBlocks + b;
              for (std::size_t ch = 0; ch < 3; ++ch) {
                sum[ch] += static_cast<double>(scale_from_bits(scale[rgb ? ch : 0])) *
                           dot(values + (rgb ? ch * kRows : 0),
                               row_weight_.data() + (block * 3 + ch) * kRows);
              }
            });
      }
      sum_[static_cast<std::size_t>(j)] = {sum[0], sum[1], sum[2]};
    }
  });
}

double PictureSum::least_norm(std::span<const Rgb> light) const {
  RgbD total;
  for (std::size_t j = 0; j < light.size(); ++j) total += sum_[j] * RgbD(light[j]);
  if (!(shares_ > 0)) return 0;
  return std::sqrt((total.r * total.r + total.g * total.g + total.b * total.b) / shares_);
}

}  // namespace haarlight
