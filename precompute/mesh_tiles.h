// The tiles of a mesh as a source for the driver.

#pragma once

#include <memory>

#include "precompute/scene.h"
#include "precompute/tile_source.h"
#include "precompute/tile_tracer.h"
#include "precompute/vertex_sampler.h"
#include "precompute/visibility.h"

namespace haarlight {

/// Outputs are the vertices of `sampler`, or their terms; without effect gloss rows of terms that
/// are not a diffuse part are empty; `scene` is the one that `visibility` was made from. Keeps
/// references to all three.
class MeshTiles : public TileSource {
 public:
  /// Throws Error{invalid_argument} as check(TraceOptions) does.
  MeshTiles(const VertexSampler& sampler, const Scene& scene, const Visibility& visibility,
            const TraceOptions& options)
      : sampler_(sampler), tracer_(scene, visibility, options) {}

  const HaarLayout& layout() const override { return tracer_.layout(); }
  std::unique_ptr<Worker> make_worker() const override;

 private:
  const VertexSampler& sampler_;
  TileTracer tracer_;
};

}  // namespace haarlight
