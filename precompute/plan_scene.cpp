// Plans for a scene: of a fixed view, or of its vertices.

#include "precompute/plan_scene.h"

#include <cstdint>
#include <optional>
#include <vector>

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
  VertexSampler sampler(scene, visibility);
  // Outgoing factors are orthonormal over the hemisphere: how far rows of terms are apart is how
  // far pictures are on the mean over all views. With the diffuse part by itself the rows without
  // gloss are the same without the others.
  std::optional<VertexTerms> terms;
  if (sampler.view_dependent() > 0) {
    TermOptions apart = options.terms;
    apart.apart = true;
    terms = vertex_terms(scene, sampler.materials(), apart);
    sampler.set_terms(&*terms);
  }
  const auto source = [&](const TraceOptions& trace) -> std::unique_ptr<TileSource> {
    return std::make_unique<MeshTiles>(sampler, scene, visibility, trace);
  };
  PlanOptions vertices = options;
  vertices.vertices = true;
  vertices.terms_per_vertex = sampler.terms();
  std::vector<std::uint32_t> order = mesh_row_order(transport_mesh(scene), sampler.terms());
  if (terms) {  // rows of terms that a vertex does not have are empty
    const auto count = static_cast<std::uint32_t>(terms->terms);
    for (std::uint32_t& output : order) {
      if (output == kNoOutput) continue;
      const TermSet& set = terms->set[terms->set_of[output / count]];
      if (static_cast<int>(output % count) >= set.terms()) output = kNoOutput;
    }
  }
  Plan plan = make_plan(scene, source, order, vertices);
  plan.notes = scene_notes(scene, visibility, nullptr);
  return plan;
}

}  // namespace haarlight
