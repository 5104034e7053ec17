// What rows depend on, hashed: equal fingerprints mean equal transports.

#pragma once

#include "core/camera.h"
#include "precompute/content_hash.h"
#include "precompute/run_options.h"
#include "precompute/scene.h"
#include "precompute/tile_tracer.h"

namespace haarlight {

/// Raised whenever the same input would give other rows; part of every fingerprint.
inline constexpr int kTracerVersion = 3;

void add_scene(ContentHash& hash, const Scene& scene);
void add_camera(ContentHash& hash, const Camera& camera);
void add_options(ContentHash& hash, const TraceOptions& options);
void add_options(ContentHash& hash, const RunOptions& options);  ///< what, not how

}  // namespace haarlight
