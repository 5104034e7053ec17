// How a precomputation runs, and what it says of itself; the same for pictures and meshes.

#pragma once

#include <cstdint>
#include <vector>

#include "precompute/point_tracer.h"

namespace haarlight {

/// How a run goes, whatever it traces.
struct RunOptions {
  double error = 0.01;  ///< relative picture error that compression may cost, [0, 1); 0: drop
                        ///< nothing but what 8 bits cannot hold
  bool resume = false;  ///< go on with FILE.partial if it was made from the same input
};

/// What a run did. Times and rays of a resumed run are those of this run alone.
struct PrecomputeReport {
  std::int64_t rays = 0;          ///< traced: from the camera and towards the light
  RayCounts ray_counts;           ///< the same in detail
  std::uint64_t bytes = 0;        ///< of the file
  double measured_error = 0;      ///< largest relative picture error over the built-in lightings
  double seconds = 0;             ///< wall time of all of it
  double pilot_seconds = 0;       ///< of that, choosing the thresholds
  int tiles = 0;                  ///< in the transport
  int resumed_tiles = 0;          ///< found in the journal
  std::int64_t blocks = 0;        ///< traced now, of 16 rows with something to see
  std::int64_t rgb_blocks = 0;    ///< of those, with three channels
  std::vector<float> thresholds;  ///< per band
};

}  // namespace haarlight
