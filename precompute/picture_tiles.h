// The tiles of a picture as a source for the driver.

#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "core/camera.h"
#include "precompute/scene.h"
#include "precompute/tile_source.h"
#include "precompute/tile_tracer.h"
#include "precompute/visibility.h"

namespace haarlight {

/// Outputs are pixels, y * width + x. Keeps references to scene and visibility.
class PictureTiles : public TileSource {
 public:
  /// Throws Error{invalid_argument} as check(TraceOptions) does.
  PictureTiles(const Scene& scene, const Visibility& visibility, const Camera& camera,
               const TraceOptions& options)
      : width_(camera.width), tracer_(scene, visibility, camera, options) {}

  const HaarLayout& layout() const override { return tracer_.layout(); }
  std::unique_ptr<Worker> make_worker() const override;

 private:
  int width_;
  TileTracer tracer_;
};

}  // namespace haarlight
