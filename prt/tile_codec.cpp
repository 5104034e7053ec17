// Block-sparse 8-bit coding of a tile.

#include "prt/tile_codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

#include "core/error.h"
#include "core/simd.h"

namespace haarlight {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kTileRows);
constexpr auto kBlock = static_cast<std::size_t>(kBlockRows);

// Columns are worked on in strips, so that rows, which are contiguous, are read a cache line at a
// time and turned into columns inside the cache.
constexpr std::size_t kStrip = 64;

struct BlockStrip {
  float peak[kStrip];
  float energy[kStrip];
};

HAARLIGHT_MULTIVERSION void measure_strip(const float* rows, std::size_t stride, std::size_t count,
                                          BlockStrip& out) {
  for (std::size_t c = 0; c < count; ++c) out.peak[c] = out.energy[c] = 0;
  for (std::size_t r = 0; r < kBlock; ++r) {
    const float* row = rows + r * stride;
    for (std::size_t c = 0; c < count; ++c) {
      const float magnitude = std::abs(row[c]);
      out.peak[c] = out.peak[c] < magnitude ? magnitude : out.peak[c];
      out.energy[c] += row[c] * row[c];
    }
  }
}

void quantise_block(const float* rows, std::size_t stride, float peak, CompressedTile& tile) {
  const std::uint16_t bits = scale_to_bits(peak / 127.0f);
  const float scale = scale_from_bits(bits);
  tile.scales.push_back(bits);
  const float inverse = scale > 0 ? 1.0f / scale : 0.0f;
  for (std::size_t r = 0; r < kBlock; ++r) {
    // The scale was rounded up, so only the last bit of the quotient could pass 127.
    const float q = std::clamp(std::nearbyint(rows[r * stride] * inverse), -127.0f, 127.0f);
    tile.values.push_back(static_cast<std::int8_t>(q));
  }
}

}  // namespace

float scale_from_bits(std::uint16_t bits) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(bits) << 16);
}

std::uint16_t scale_to_bits(float scale) {
  const auto bits = std::bit_cast<std::uint32_t>(scale);
  return static_cast<std::uint16_t>((bits >> 16) + ((bits & 0xffffu) != 0));
}

CompressedTile compress_tile(const HaarLayout& layout, const TileRows& rows,
                             std::span<const float> thresholds) {
  const auto size = static_cast<std::size_t>(layout.size());
  const std::size_t channels = rows.rgb_blocks == 0 ? 1 : 3;
  if (rows.values.size() != channels * kRows * size || rows.color.size() != kRows ||
      rows.coverage.size() != kRows || rows.rgb_blocks > 15 ||
      thresholds.size() != static_cast<std::size_t>(layout.band_count())) {
    throw Error(
        ErrorKind::invalid_argument,
        fmt::format("tile has {} values, {} colours, {} coverages, block mask {} and {} "
                    "thresholds, expected {}, {}, {}, at most 15 and {}",
                    rows.values.size(), rows.color.size(), rows.coverage.size(), rows.rgb_blocks,
                    thresholds.size(), channels * kRows * size, kRows, kRows, layout.band_count()));
  }
  CompressedTile tile;
  tile.rgb_blocks = rows.rgb_blocks;
  tile.present.assign((size + 1) / 2, 0);
  BlockStrip strips[kTileBlocks][3];
  for (int b = 0; b < layout.band_count(); ++b) {
    const IndexRange range = layout.band(b);
    const float threshold = thresholds[static_cast<std::size_t>(b)];
    const auto end = static_cast<std::size_t>(range.end);
    for (auto begin = static_cast<std::size_t>(range.begin); begin < end; begin += kStrip) {
      const std::size_t count = std::min(kStrip, end - begin);
      for (std::size_t block = 0; block < kTileBlocks; ++block) {
        const std::size_t block_channels = rows.rgb_blocks >> block & 1 ? 3 : 1;
        for (std::size_t ch = 0; ch < block_channels; ++ch) {
          measure_strip(rows.values.data() + (ch * kRows + block * kBlock) * size + begin, size,
                        count, strips[block][ch]);
        }
      }
      for (std::size_t c = 0; c < count; ++c) {
        for (std::size_t block = 0; block < kTileBlocks; ++block) {
          const std::size_t block_channels = rows.rgb_blocks >> block & 1 ? 3 : 1;
          float peak = 0, energy = 0;
          for (std::size_t ch = 0; ch < block_channels; ++ch) {
            peak = std::max(peak, strips[block][ch].peak[c]);
            energy += strips[block][ch].energy[c];
          }
          if (!std::isfinite(energy)) {
            throw Error(ErrorKind::invalid_argument,
                        fmt::format("transport row has an entry that is not finite or too large in "
                                    "column {}",
                                    begin + c));
          }
          const float floor_energy =
              threshold * threshold * static_cast<float>(kBlock * block_channels);
          // A peak too small for a normal scale is nothing.
          if (peak < 1e-30f || energy < floor_energy) continue;
          const std::size_t column = begin + c;
          tile.present[column / 2] = static_cast<std::uint8_t>(tile.present[column / 2] |
                                                               (1u << (block + 4 * (column % 2))));
          for (std::size_t ch = 0; ch < block_channels; ++ch) {
            quantise_block(rows.values.data() + (ch * kRows + block * kBlock) * size + column, size,
                           strips[block][ch].peak[c], tile);
          }
        }
      }
    }
  }
  return tile;
}

void decompress_tile(const HaarLayout& layout, const CompressedTile& tile,
                     std::vector<float>& values) {
  const auto size = static_cast<std::size_t>(layout.size());
  const std::size_t channels = tile.rgb_blocks == 0 ? 1 : 3;
  values.assign(channels * kRows * size, 0.0f);
  std::size_t next = 0;
  for (std::size_t column = 0; column < size; ++column) {
    const unsigned present = tile.present[column / 2] >> (4 * (column % 2)) & 15u;
    for (std::size_t block = 0; block < kTileBlocks; ++block) {
      if (!(present >> block & 1)) continue;
      const std::size_t block_channels = tile.rgb_blocks >> block & 1 ? 3 : 1;
      for (std::size_t ch = 0; ch < block_channels; ++ch, ++next) {
        const float scale = scale_from_bits(tile.scales[next]);
        for (std::size_t r = 0; r < kBlock; ++r) {
          values[(ch * kRows + block * kBlock + r) * size + column] =
              scale * static_cast<float>(tile.values[next * kBlock + r]);
        }
      }
    }
  }
}

}  // namespace haarlight
