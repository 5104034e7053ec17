// Equation 4 for many points: records eight at a time.

#pragma once

#include <cstdint>
#include <span>

#include "caching/record_index.h"

namespace haarlight {

/// What is summed for one point.
struct RecordSum {
  float r = 0, g = 0, b = 0;  ///< of weights times irradiance
  float weight = 0;
  bool near = false;  ///< whether a record lies within RecordReach::near
};

struct WeightedPoint {
  SurfaceCoordinates at{};
  RecordSum* sum = nullptr;
};

/// In the units of SurfaceCoordinates.
struct RecordReach {
  float far = 0.25f;  ///< a of equation 4
  float near = 0.15f;
  float least = 4;  ///< what weights are less, so that they end without a step
};

/// Adds to each point's sum the records that reach it. used[b] gets bit i where record i of block b
/// reaches a point; as many as blocks. The same bits by either version.
void add_records(std::span<const RecordBlock* const> blocks, std::span<const WeightedPoint> points,
                 const RecordReach& reach, std::uint8_t* used);
/// Without the instructions of newer machines: for tests.
void add_records_portable(std::span<const RecordBlock* const> blocks,
                          std::span<const WeightedPoint> points, const RecordReach& reach,
                          std::uint8_t* used);

}  // namespace haarlight
