// Stand-ins for tiles that were not traced: a few pixels, copied to their neighbours.

#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "precompute/tile_source.h"
#include "prt/tile_record.h"

namespace haarlight {

/// Largest number of tiles that show one row: those of a chunk.
inline constexpr int kMaxPreviewTiles = kChunkTiles;

/// How much is traced for a preview: one row a block, or one for so many tiles.
struct PreviewGrain {
  bool blocks = true;
  int tiles = 1;  ///< 1, 4, 16 or 64, when not `blocks`
};

/// Rows of a tile of which only one a block, or only one at all, is traced, and copied to the rest.
void trace_preview(TileSource::Worker& worker, std::span<const std::uint32_t> outputs, bool blocks,
                   TileRows& rows);

/// The finest grain at which previews of `tiles` tiles take at most `seconds` on `workers` threads;
/// where none does, the coarsest. Tries a few of `missing`. `estimate` gets the seconds.
PreviewGrain choose_grain(TileSource::Worker& worker, const HaarLayout& layout,
                          std::span<const float> thresholds, std::span<const std::uint32_t> order,
                          std::span<const int> missing, double seconds, int workers,
                          double& estimate);

/// Makes stand-ins as they are asked for, from several threads; the same ones in any order.
class Preview {
 public:
  Preview(const TileSource& source, std::vector<std::uint32_t> order, PreviewGrain grain,
          std::vector<float> thresholds);
  std::shared_ptr<const TileRecord> record(int tile);

 private:
  struct Work {
    std::unique_ptr<TileSource::Worker> worker;
    TileRows rows;
  };
  std::shared_ptr<const TileRecord> make(int tile);

  const TileSource& source_;
  std::vector<std::uint32_t> order_;
  PreviewGrain grain_;
  std::vector<float> thresholds_;
  int last_tile_ = 0;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Work>> free_;
  std::map<int, std::shared_ptr<const TileRecord>> known_;  // a few, by their first tile
};

}  // namespace haarlight
