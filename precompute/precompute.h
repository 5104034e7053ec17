// The offline main path: a scene and a view in, a transport file out.

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/camera.h"
#include "core/progress.h"
#include "precompute/point_tracer.h"
#include "precompute/scene.h"
#include "precompute/tile_tracer.h"

namespace haarlight {

/// How a transport is made. Picture size and view are the camera's.
struct PrecomputeOptions {
  TraceOptions trace;   ///< resolution and rays; see precompute/tile_tracer.h
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
  int tiles = 0;                  ///< in the picture
  int resumed_tiles = 0;          ///< found in the journal
  std::int64_t blocks = 0;        ///< traced now, of 16 rows with something to see
  std::int64_t rgb_blocks = 0;    ///< of those, with three channels
  std::vector<float> thresholds;  ///< per band
};

/// Traces direct light from every direction for each pixel of `camera` and writes `file`:
///   pilot tiles -> thresholds -> every tile traced, transformed, compressed -> file
/// Runs on all threads of core/parallel.h; the file is the same bytes on any number of them, and
/// whether or not a run was cut off and resumed. Memory: 6.3 MB a thread at 64x64 faces (three
/// times that while a tile has coloured blocks), the scene, and what Embree makes of it.
/// Throws Error{invalid_argument} for an option outside its range, Error{missing} for a scene
/// without triangles, Error{io} if the file cannot be written, Error{cancelled} when `progress`
/// says so (FILE.partial stays).
PrecomputeReport precompute_image(const Scene& scene, const Camera& camera,
                                  const PrecomputeOptions& options,
                                  const std::filesystem::path& file, const Progress& progress = {});

/// What the rows depend on, as text: the scene's data, the camera and the options, hashed. Equal
/// fingerprints mean equal transports.
std::string precompute_fingerprint(const Scene& scene, const Camera& camera,
                                   const PrecomputeOptions& options);

}  // namespace haarlight
