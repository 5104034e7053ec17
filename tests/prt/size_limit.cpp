// Pruning by size against compressing anew, and promised bytes against those of real chunks.

#include "prt/size_limit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

// Root mean square of a block of 16 rows of a column as it is stored, all channels.
double block_rms(const HaarLayout& layout, const CompressedTile& tile,
                 const std::vector<float>& values, std::size_t block, std::size_t column) {
  const auto size = static_cast<std::size_t>(layout.size());
  const std::size_t channels = tile.rgb_blocks >> block & 1 ? 3 : 1;
  double energy = 0;
  for (std::size_t ch = 0; ch < channels; ++ch) {
    for (std::size_t r = 0; r < kBlockRows; ++r) {
      const double v =
          static_cast<double>(values[(ch * kTileRows + block * kBlockRows + r) * size + column]);
      energy += v * v;
    }
  }
  return std::sqrt(energy / static_cast<double>(kBlockRows * channels));
}

// Blocks below the threshold are gone, all others keep every bit.
TEST(SizeLimit, PruningDropsTheSmallBlocksAndNothingElse) {
  const HaarLayout layout(8);
  std::mt19937_64 random(5);
  for (const bool colored : {false, true}) {
    const TileRows rows = fixtures::random_tile(layout, random, 0.6, colored);
    const CompressedTile whole = compress_tile(layout, rows, std::vector<float>(3, 0.0f));
    std::vector<float> before, after;
    decompress_tile(layout, whole, before);
    for (const float threshold : {0.0f, 0.005f, 0.02f, 0.04f, 1.0f}) {
      CompressedTile pruned = whole;
      prune_tile(layout, threshold, pruned);
      EXPECT_EQ(pruned.values.size(), pruned.scales.size() * kBlockRows);
      decompress_tile(layout, pruned, after);
      ASSERT_EQ(after.size(), before.size());
      const auto size = static_cast<std::size_t>(layout.size());
      std::size_t kept = 0;
      for (std::size_t column = 0; column < size; ++column) {
        for (std::size_t block = 0; block < kTileBlocks; ++block) {
          const double rms = block_rms(layout, whole, before, block, column);
          // Their root mean square is taken in another order: 16 x 3 roundings of 2^-53, once
          // 2^-24.
          if (std::abs(rms - static_cast<double>(threshold)) < 1e-6 * rms) continue;
          const bool keep = rms > 0 && rms >= static_cast<double>(threshold);
          kept += keep;
          const std::size_t channels = whole.rgb_blocks >> block & 1 ? 3 : 1;
          for (std::size_t ch = 0; ch < channels; ++ch) {
            for (std::size_t r = 0; r < kBlockRows; ++r) {
              const std::size_t at = (ch * kTileRows + block * kBlockRows + r) * size + column;
              ASSERT_EQ(after[at], keep ? before[at] : 0.0f) << threshold;
            }
          }
        }
      }
      if (threshold == 0.02f) {
        EXPECT_GT(kept, 20u);
      }
      if (threshold == 1.0f) {
        EXPECT_EQ(kept, 0u);
      }
    }
  }
}

TEST(SizeLimit, LevelsAscendFromNothing) {
  EXPECT_EQ(limit_threshold(0), 0.0f);
  for (int level = 1; level < kLimitLevels; ++level) {
    EXPECT_GT(limit_threshold(level), limit_threshold(level - 1));
  }
  EXPECT_GT(limit_threshold(kLimitLevels - 1), 1.0f);
}

// At every level the promise is what a writer makes of tiles pruned to it: the chunk's part of the
// file, up to its alignment.
TEST(SizeLimit, PromisedBytesAreThoseOfTheFile) {
  const TemporaryFolder folder;
  const fixtures::SmallTransport small = fixtures::small_transport(8, 40, 24, 6, 0.5);
  const HaarLayout layout(8);
  const std::size_t per_chunk = kChunkRows / kTileRows;
  for (const int level : {0, 120, 180, 190, 200, kLimitLevels - 1}) {
    std::vector<CompressedTile> tiles;
    for (const TileRows& rows : small.tiles) {
      tiles.push_back(rows.values.empty() ? CompressedTile{}
                                          : compress_tile(layout, rows, small.thresholds));
    }
    SizeByThreshold sum(layout);
    for (std::size_t first = 0; first < tiles.size(); first += per_chunk) {
      std::vector<const CompressedTile*> chunk;
      for (std::size_t t = first; t < std::min(tiles.size(), first + per_chunk); ++t) {
        chunk.push_back(small.tiles[t].values.empty() ? nullptr : &tiles[t]);
      }
      SizeByThreshold one(layout);
      one.add_chunk(chunk);
      sum.add(one);
    }
    // The same tiles with what lies below the level zero, written whole.
    const auto file = folder / "pruned.hlt";
    {
      TransportWriter writer(file, small.info, {small.thresholds, "test", false});
      for (std::size_t t = 0; t < small.tiles.size(); ++t) {
        if (small.tiles[t].values.empty()) continue;
        CompressedTile pruned = tiles[t];
        prune_tile(layout, limit_threshold(level), pruned);
        TileRows rows = small.tiles[t];
        decompress_tile(layout, pruned, rows.values);
        writer.write_tile(static_cast<int>(t), rows);
      }
      writer.finish("{}", {});
    }
    const Transport transport = Transport::open(file);
    ASSERT_EQ(transport.chunk_count(), 1);  // and its end lies at the next multiple of 4096
    EXPECT_EQ((transport.chunk_bytes() + 4095) / 4096 * 4096, sum.bytes(level)) << level;
  }
}

}  // namespace
}  // namespace haarlight
