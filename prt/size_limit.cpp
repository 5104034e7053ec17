// Keeping a transport below a size: which further blocks to drop.

#include "prt/size_limit.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "prt/chunk.h"
#include "prt/transport_format.h"

namespace haarlight {
namespace {

constexpr auto kBlock = static_cast<std::size_t>(kBlockRows);

std::array<float, kLimitLevels> make_thresholds() {
  std::array<float, kLimitLevels> t{};
  for (std::size_t i = 1; i < t.size(); ++i) {
    t[i] = static_cast<float>(1e-9 * std::exp2(static_cast<double>(i) / 8));
  }
  return t;
}

const std::array<float, kLimitLevels>& thresholds() {
  static const std::array<float, kLimitLevels> made = make_thresholds();
  return made;
}

// Root mean square of a stored block of `channels` scales from number `first` on.
float stored_rms(const CompressedTile& tile, std::size_t first, std::size_t channels) {
  double energy = 0;
  for (std::size_t s = first; s < first + channels; ++s) {
    const double scale = scale_from_bits(tile.scales[s]);
    std::int64_t squares = 0;
    for (std::size_t r = 0; r < kBlock; ++r) {
      const std::int64_t v = tile.values[s * kBlock + r];
      squares += v * v;
    }
    energy += scale * scale * static_cast<double>(squares);
  }
  return static_cast<float>(std::sqrt(energy / static_cast<double>(kBlock * channels)));
}

// Largest level at which a block of this RMS is kept.
int level_of(float rms) {
  const auto& t = thresholds();
  return static_cast<int>(std::upper_bound(t.begin(), t.end(), rms) - t.begin()) - 1;
}

unsigned present_in(const CompressedTile& tile, std::size_t column) {
  return tile.present[column / 2] >> (4 * (column % 2)) & 15u;
}

std::size_t channels_of(const CompressedTile& tile, std::size_t block) {
  return tile.rgb_blocks >> block & 1 ? 3 : 1;
}

}  // namespace

float limit_threshold(int level) { return thresholds()[static_cast<std::size_t>(level)]; }

void prune_tile(const HaarLayout& layout, float threshold, CompressedTile& tile) {
  const auto size = static_cast<std::size_t>(layout.size());
  std::size_t next = 0, kept = 0;
  for (std::size_t column = 0; column < size; ++column) {
    const unsigned present = present_in(tile, column);
    for (std::size_t block = 0; block < kTileBlocks; ++block) {
      if (!(present >> block & 1)) continue;
      const std::size_t channels = channels_of(tile, block);
      if (stored_rms(tile, next, channels) < threshold) {
        tile.present[column / 2] = static_cast<std::uint8_t>(tile.present[column / 2] &
                                                             ~(1u << (block + 4 * (column % 2))));
      } else {
        for (std::size_t s = 0; s < channels; ++s, ++kept) {
          tile.scales[kept] = tile.scales[next + s];
          std::copy_n(tile.values.begin() + static_cast<std::ptrdiff_t>((next + s) * kBlock),
                      kBlock, tile.values.begin() + static_cast<std::ptrdiff_t>(kept * kBlock));
        }
      }
      next += channels;
    }
  }
  tile.scales.resize(kept);
  tile.values.resize(kept * kBlock);
}

void SizeByThreshold::add_chunk(std::span<const CompressedTile* const> tiles) {
  // steps[l]: what level l has more than level l + 1, over all columns.
  std::array<std::uint64_t, kLimitLevels> steps{};
  std::vector<std::size_t> next(tiles.size(), 0);
  std::vector<std::pair<int, std::size_t>> blocks;  // level, scales
  for (std::size_t column = 0; column < columns_; ++column) {
    blocks.clear();
    for (std::size_t t = 0; t < tiles.size(); ++t) {
      if (!tiles[t]) continue;
      const unsigned present = present_in(*tiles[t], column);
      for (std::size_t block = 0; block < kTileBlocks; ++block) {
        if (!(present >> block & 1)) continue;
        const std::size_t channels = channels_of(*tiles[t], block);
        blocks.emplace_back(level_of(stored_rms(*tiles[t], next[t], channels)), channels);
        next[t] += channels;
      }
    }
    std::sort(blocks.begin(), blocks.end(), std::greater<>());
    std::size_t scales = 0;
    for (const auto& [level, channels] : blocks) {
      steps[static_cast<std::size_t>(level)] +=
          column_stream_bytes(scales + channels) - column_stream_bytes(scales);
      scales += channels;
    }
  }
  std::uint64_t sum = column_area_begin(columns_);
  for (std::size_t l = kLimitLevels; l-- > 0;) {
    sum += steps[l];
    bytes_[l] += (sum + kChunkAlignment - 1) / kChunkAlignment * kChunkAlignment;
  }
}

void SizeByThreshold::add(const SizeByThreshold& other) {
  for (std::size_t l = 0; l < bytes_.size(); ++l) bytes_[l] += other.bytes_[l];
}

}  // namespace haarlight
