// The offline main path: a scene and a view in, a transport file out.

#pragma once

#include <filesystem>
#include <string>

#include "core/camera.h"
#include "core/progress.h"
#include "precompute/run_options.h"
#include "precompute/scene.h"
#include "precompute/tile_tracer.h"

namespace haarlight {

/// How a transport is made. Picture size and view are the camera's.
struct PrecomputeOptions : RunOptions {
  TraceOptions trace;  ///< resolution and rays; see precompute/tile_tracer.h
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
