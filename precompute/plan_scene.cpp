// Plans for a scene: of a fixed view, or of its vertices.

#include "precompute/plan_scene.h"

#include "precompute/mesh_tiles.h"
#include "precompute/picture_tiles.h"
#include "precompute/precompute_mesh.h"
#include "precompute/scene_notes.h"
#include "precompute/vertex_sampler.h"

namespace haarlight {

Plan plan_image(const Scene& scene, const Camera& camera, const PlanOptions& options) {
  const Visibility visibility(scene);
  const auto source = [&](const TraceOptions& trace) -> std::unique_ptr<TileSource> {
    return std::make_unique<PictureTiles>(scene, visibility, camera, trace);
  };
  PlanOptions picture = options;
  picture.vertices = false;
  Plan plan = make_plan(scene, source, image_row_order(camera.width, camera.height), picture);
  plan.notes = scene_notes(scene, visibility, &camera);
  return plan;
}

Plan plan_mesh(const Scene& scene, const PlanOptions& options) {
  const Visibility visibility(scene);
  const VertexSampler sampler(scene, visibility);
  const auto source = [&](const TraceOptions& trace) -> std::unique_ptr<TileSource> {
    return std::make_unique<MeshTiles>(sampler, scene, visibility, trace);
  };
  PlanOptions vertices = options;
  vertices.vertices = true;
  Plan plan = make_plan(scene, source, mesh_row_order(transport_mesh(scene)), vertices);
  plan.notes = scene_notes(scene, visibility, nullptr);
  return plan;
}

}  // namespace haarlight
