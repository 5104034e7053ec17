// Vectors of clusters, one after the other, become tiles of a transport.

#include "cpca/vector_writer.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "prt/tile_codec.h"

namespace haarlight {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kTileRows);
constexpr auto kBlock = static_cast<std::size_t>(kBlockRows);

float root_mean_square(const std::vector<float>& values) {
  double sum = 0;
  for (const float x : values) sum += static_cast<double>(x) * x;
  return static_cast<float>(std::sqrt(sum / static_cast<double>(values.size())));
}

}  // namespace

VectorWriter::VectorWriter(TransportWriter& writer, const HaarLayout& layout, int terms,
                           float threshold, std::span<const std::vector<float>> lightings)
    : writer_(writer),
      layout_(layout),
      terms_(static_cast<std::size_t>(terms)),
      threshold_(threshold),
      lightings_(lightings) {}

void VectorWriter::add(const ClusterBasis& basis, std::size_t vectors) {
  const auto columns = static_cast<std::size_t>(layout_.size());
  const auto channels = static_cast<std::size_t>(basis.channels);
  const std::size_t row_size = channels * columns;
  for (std::size_t k = 0; k < terms_; ++k) {
    for (std::size_t i = 0; i < vectors; ++i) {
      Row& row = rows_.emplace_back();
      row.channels = basis.channels;
      if (i >= basis.count) {
        row.values.assign(row_size, 0.0f);
        continue;
      }
      const auto from =
          basis.vector.begin() + static_cast<std::ptrdiff_t>((i * terms_ + k) * row_size);
      row.values.assign(from, from + static_cast<std::ptrdiff_t>(row_size));
    }
  }
}

void VectorWriter::flush(bool all) {
  const std::size_t tiles = all ? (rows_.size() + kRows - 1) / kRows : rows_.size() / kRows;
  const std::size_t lights = 3 * lightings_.size();
  shown_.resize((static_cast<std::size_t>(next_tile_) + tiles) * kRows * lights, 0.0);
  parallel_for(static_cast<int>(tiles), [&](int t) {
    const std::size_t first = static_cast<std::size_t>(t) * kRows;
    write(next_tile_ + t, std::span(rows_).subspan(first, std::min(kRows, rows_.size() - first)));
  });
  next_tile_ += static_cast<int>(tiles);
  rows_.erase(rows_.begin(),
              rows_.begin() + static_cast<std::ptrdiff_t>(std::min(rows_.size(), tiles * kRows)));
}

void VectorWriter::write(int tile, std::span<const Row> rows) {
  const auto columns = static_cast<std::size_t>(layout_.size());
  TileRows out;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    if (rows[r].channels == 3) out.rgb_blocks |= 1u << (r / kBlock);
  }
  const std::size_t channels = out.rgb_blocks ? 3 : 1;
  out.values.assign(channels * kRows * columns, 0.0f);
  out.color.assign(kRows, Rgb{1, 1, 1});
  out.coverage.assign(kRows, 1.0f);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const bool rgb = out.rgb_blocks >> (r / kBlock) & 1;
    for (std::size_t ch = 0; ch < (rgb ? 3u : 1u); ++ch) {
      const std::size_t from = rows[r].channels == 3 ? ch * columns : 0;
      std::copy_n(rows[r].values.begin() + static_cast<std::ptrdiff_t>(from), columns,
                  out.values.begin() + static_cast<std::ptrdiff_t>((ch * kRows + r) * columns));
    }
  }

  // Drop what is small before rows are brought to one size.
  for (std::size_t b = 0; b < kTileBlocks; ++b) {
    const std::size_t block_channels = out.rgb_blocks >> b & 1 ? 3 : 1;
    const std::size_t used = std::min(kBlock, rows.size() - std::min(rows.size(), b * kBlock));
    const auto entry = [&](std::size_t ch, std::size_t r, std::size_t j) -> float& {
      return out.values[(ch * kRows + b * kBlock + r) * columns + j];
    };
    const float floor = threshold_ * threshold_ * static_cast<float>(block_channels * used);
    for (std::size_t j = 0; j < columns; ++j) {
      float energy = 0;
      for (std::size_t ch = 0; ch < block_channels; ++ch) {
        for (std::size_t r = 0; r < used; ++r) energy += entry(ch, r, j) * entry(ch, r, j);
      }
      if (energy >= floor) continue;
      for (std::size_t ch = 0; ch < block_channels; ++ch) {
        for (std::size_t r = 0; r < used; ++r) entry(ch, r, j) = 0;
      }
    }
  }
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const float size = root_mean_square(rows[r].values);
    if (!(size > 0)) continue;
    out.color[r] = {size, size, size};
    for (std::size_t ch = 0; ch < channels; ++ch) {
      float* row = out.values.data() + (ch * kRows + r) * columns;
      for (std::size_t j = 0; j < columns; ++j) row[j] /= size;
    }
  }

  // What is read back is what is shown.
  const std::vector<float> thresholds(static_cast<std::size_t>(layout_.band_count()), 0.0f);
  std::vector<float> stored;
  decompress_tile(layout_, compress_tile(layout_, out, thresholds), stored);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const bool rgb = out.rgb_blocks >> (r / kBlock) & 1;
    double* to =
        shown_.data() + (static_cast<std::size_t>(tile) * kRows + r) * 3 * lightings_.size();
    for (std::size_t l = 0; l < lightings_.size(); ++l) {
      for (std::size_t ch = 0; ch < 3; ++ch) {
        if (ch > 0 && !rgb) {
          to[3 * l + ch] = to[3 * l];
          continue;
        }
        const float* row = stored.data() + (ch * kRows + r) * columns;
        double sum = 0;
        for (std::size_t j = 0; j < columns; ++j) {
          sum += static_cast<double>(row[j]) * static_cast<double>(lightings_[l][j]);
        }
        to[3 * l + ch] = sum * static_cast<double>(out.color[r].r);
      }
    }
  }
  writer_.write_tile(tile, out);
}

}  // namespace haarlight
