// A few tiles traced before the rest, to learn how much may be dropped.

#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "precompute/tile_source.h"
#include "prt/transport_writer.h"

namespace haarlight {

inline constexpr int kPilotTiles = 64;

/// Numbers of all tiles that show the scene, by a glance at each.
std::vector<int> tiles_with_scene(TileSource::Worker& worker, std::span<const std::uint32_t> order);

/// Numbers of up to kPilotTiles tiles spread evenly over those that show the scene. `order` is the
/// row order of all tiles; `seen` gets how many of them show the scene.
std::vector<int> choose_pilots(TileSource::Worker& worker, std::span<const std::uint32_t> order,
                               int& seen);

/// Traces the pilots, a thread a tile, and adds them to `tuner`, in order. `done` is told of
/// finished tiles. Returns the rays traced.
RayCounts trace_pilots(const TileSource& source, std::span<const std::uint32_t> order,
                       std::span<const int> pilots, int threads, ToleranceTuner& tuner,
                       const std::function<void(int count)>& done);

}  // namespace haarlight
