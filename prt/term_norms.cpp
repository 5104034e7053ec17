// Norms of columns over classes of rows.

#include "prt/term_norms.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/simd.h"
#include "prt/stored_blocks.h"
#include "prt/tile_codec.h"

namespace haarlight {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kBlockRows);
constexpr std::size_t kBlock = 3 * kRows;
constexpr int kColumnsOfTask = 64, kColumnsOfSlice = 256;

// A square is rounded four times, 16 of them are summed in float, the rest in double: less than
// 24 x 2^-24; a slice's sum of 256 products likewise, see prt/error_estimator.cpp.
constexpr double kNormRounding = 1 + 2e-6, kSumRounding = 1 + 2e-5;

// squares[channel][row of block] of a stored block; scales as in ColumnBlocks.
HAARLIGHT_MULTIVERSION void squares_of(const std::int8_t* values, std::size_t value_stride,
                                       const float* scales, const float* factor, float* squares) {
  for (std::size_t ch = 0; ch < 3; ++ch) {
    for (std::size_t r = 0; r < kRows; ++r) {
      const float t =
          static_cast<float>(values[ch * value_stride + r]) * scales[ch] * factor[ch * kRows + r];
      squares[ch * kRows + r] = t * t;
    }
  }
}

// out[0, 3 classes) += |change| norm, out[3 classes, 6 classes) += |light| norm.
HAARLIGHT_MULTIVERSION void add_norms(const float* norm, const float* change, const float* light,
                                      std::size_t classes, float* out) {
  for (std::size_t i = 0; i < classes; ++i) {
    for (std::size_t ch = 0; ch < 3; ++ch) {
      out[3 * i + ch] += change[ch] * norm[3 * i + ch];
      out[3 * (classes + i) + ch] += light[ch] * norm[3 * i + ch];
    }
  }
}

}  // namespace

TermNorms::TermNorms(const Transport& transport, std::span<const std::uint32_t> class_of_row,
                     std::span<const float> weight_of_row, std::size_t count)
    : classes(count) {
  const auto columns = static_cast<std::size_t>(transport.layout().size());
  const auto rows = static_cast<std::size_t>(transport.rows());
  HugePageVector<float> factor;  // [block][channel][row of block]
  factor.resize(3 * rows);
  // The class of a block's rows, or `count` where they are of several.
  std::vector<std::uint32_t> class_of_block(rows / kRows, kNoOutput);
  for (std::size_t row = 0; row < rows; ++row) {
    if (class_of_row[row] == kNoOutput) continue;
    std::uint32_t& block = class_of_block[row / kRows];
    const bool same = block == kNoOutput || block == class_of_row[row];
    block = same ? class_of_row[row] : static_cast<std::uint32_t>(count);
    const float weight = std::sqrt(weight_of_row[row]);
    const Rgb color = transport.row_color()[row];
    const float channel[3] = {color.r, color.g, color.b};
    for (std::size_t ch = 0; ch < 3; ++ch) {
      factor[row / kRows * kBlock + ch * kRows + row % kRows] = weight * channel[ch];
    }
  }
  norm.resize(columns * 3 * count);
  const int tasks = (static_cast<int>(columns) + kColumnsOfTask - 1) / kColumnsOfTask;
  parallel_for(tasks, [&](int task) {
    const int begin = task * kColumnsOfTask;
    const int end = std::min(begin + kColumnsOfTask, static_cast<int>(columns));
    std::vector<double> sums(3 * count);
    float squares[kBlock];
    for (int j = begin; j < end; ++j) {
      std::fill(sums.begin(), sums.end(), 0.0);
      for (int chunk = 0; chunk < transport.chunk_count(); ++chunk) {
        for_stored_blocks(
            transport.column(chunk, j), transport.rgb_blocks(chunk),
            [&](std::size_t b, bool rgb, const std::uint16_t* scale, const std::int8_t* q) {
              const std::size_t block = static_cast<std::size_t>(chunk) * kChunkBlocks + b;
              float scales[3];
              for (std::size_t ch = 0; ch < 3; ++ch) {
                scales[ch] = scale_from_bits(scale[rgb ? ch : 0]);
              }
              squares_of(q, rgb ? kRows : 0, scales, factor.data() + block * kBlock, squares);
              const std::uint32_t whole = class_of_block[block];
              if (whole == kNoOutput) return;
              for (std::size_t ch = 0; ch < 3; ++ch) {
                if (whole < count) {
                  float sum = 0;
                  for (std::size_t r = 0; r < kRows; ++r) sum += squares[ch * kRows + r];
                  sums[3 * std::size_t{whole} + ch] += static_cast<double>(sum);
                  continue;
                }
                for (std::size_t r = 0; r < kRows; ++r) {
                  const std::uint32_t of = class_of_row[block * kRows + r];
                  if (of == kNoOutput) continue;
                  sums[3 * std::size_t{of} + ch] += static_cast<double>(squares[ch * kRows + r]);
                }
              }
            });
      }
      for (std::size_t i = 0; i < sums.size(); ++i) {
        norm[static_cast<std::size_t>(j) * sums.size() + i] =
            static_cast<float>(std::sqrt(sums[i]) * kNormRounding);
      }
    }
  });
  slices_.resize((columns + kColumnsOfSlice - 1) / kColumnsOfSlice);
  for (std::vector<float>& slice : slices_) slice.resize(6 * count);
}

void TermNorms::bound(std::span<const Rgb> target, std::span<const Rgb> shown,
                      std::vector<double>& change, std::vector<double>& light) {
  parallel_for(static_cast<int>(slices_.size()), [&](int slice) {
    std::vector<float>& sums = slices_[static_cast<std::size_t>(slice)];
    std::fill(sums.begin(), sums.end(), 0.0f);
    const auto begin = static_cast<std::size_t>(slice) * kColumnsOfSlice;
    const std::size_t end = std::min(begin + kColumnsOfSlice, target.size());
    for (std::size_t j = begin; j < end; ++j) {
      const Rgb l = target[j], d = l - shown[j];
      if (l == Rgb{} && d == Rgb{}) continue;
      const float sizes[2][3] = {{std::abs(d.r), std::abs(d.g), std::abs(d.b)},
                                 {std::abs(l.r), std::abs(l.g), std::abs(l.b)}};
      add_norms(norm.data() + j * 3 * classes, sizes[0], sizes[1], classes, sums.data());
    }
  });
  change.assign(3 * classes, 0.0);
  light.assign(3 * classes, 0.0);
  for (const std::vector<float>& sums : slices_) {
    for (std::size_t i = 0; i < 3 * classes; ++i) {
      change[i] += kSumRounding * static_cast<double>(sums[i]);
      light[i] += kSumRounding * static_cast<double>(sums[3 * classes + i]);
    }
  }
}

}  // namespace haarlight
