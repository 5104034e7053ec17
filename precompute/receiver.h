// The places whose light the rows of a tile show.

#pragma once

#include <cstdint>
#include <vector>

#include "core/rgb.h"
#include "core/vec.h"
#include "precompute/bsdf.h"

namespace haarlight {

/// A place on a surface that a row shows: what it sends towards bsdf.to_viewer, times `weight`.
struct Receiver {
  std::uint32_t row = 0;  ///< of the tile, below kTileRows
  RgbD weight;            ///< share of the row, times what mirrors and glass on the way let through
  Vec3 position;          ///< local coordinates of Visibility, on the surface
  Bsdf bsdf;
  std::uint32_t vertex = 0;  ///< of a mesh: rows of its terms share what is traced
};

/// A line of sight that leaves the scene by way of mirrors or glass.
struct Escape {
  std::uint32_t row = 0;
  RgbD weight;
  Vec3 direction;  ///< unit
};

/// All that the rows of one tile show; reused from tile to tile.
struct TileReceivers {
  std::vector<Receiver> receivers;
  std::vector<Escape> escapes;
  std::vector<float> coverage;  ///< kTileRows: share of the row that the scene covers, [0, 1]
  void clear() { receivers.clear(), escapes.clear(), coverage.clear(); }
};

}  // namespace haarlight
