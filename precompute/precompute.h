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
  TraceOptions trace;  ///< effects, resolution and rays; see precompute/tile_tracer.h
  std::string plan;    ///< JSON object that led to trace.effects, kept in the file; or empty
};

/// Traces the light that each pixel of `camera` gets from every direction and writes `file`:
///   pilot tiles -> thresholds -> every tile traced, transformed, compressed -> file
/// on all threads of core/parallel.h, as far as memory allows; the same bytes on any number of them
/// and of processes, and whether or not a run was cut off and resumed.
///
/// A run that ends early, because `progress` says so or by the time limit, leaves its journal and a
/// file whose missing tiles are previews: report.complete is false, and so is "complete" in the
/// file. A whole file that is there already gives way to a preview only at the time limit.
/// Throws Error{invalid_argument} for an option outside its range, Error{missing} for a scene
/// without triangles, Error{io} if the file cannot be written (the old one stays).
PrecomputeReport precompute_image(const Scene& scene, const Camera& camera,
                                  const PrecomputeOptions& options,
                                  const std::filesystem::path& file, const Progress& progress = {});

/// What the rows depend on, as text: the scene's data, the camera and the options, hashed. Equal
/// fingerprints mean equal transports.
std::string precompute_fingerprint(const Scene& scene, const Camera& camera,
                                   const PrecomputeOptions& options);

}  // namespace haarlight
