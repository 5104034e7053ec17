// What a transport file says of the scene it was made from.

#include "precompute/scene_meta.h"

#include <nlohmann/json.hpp>

#include "precompute/scene_files.h"

namespace haarlight {

nlohmann::json scene_meta(const Scene& scene) {
  const SceneReport& r = scene.report;
  return {{"name", scene.name},
          {"triangles", scene.triangle.size()},
          {"materials", scene.material.size()},
          {"dropped_degenerate", r.dropped_degenerate},
          {"dropped_not_finite", r.dropped_not_finite},
          {"dropped_duplicate", r.dropped_duplicate},
          {"dropped_out_of_range", r.dropped_out_of_range},
          {"dropped_not_triangle", r.dropped_not_triangle},
          {"against_normals", r.against_normals},
          {"tiny", r.tiny},
          {"normals_made", r.normals_made},
          {"unused_vertices", r.unused_vertices},
          {"textures_missing", r.textures_missing},
          {"blended_materials", r.blended_materials},
          {"rough_glass", r.rough_glass}};
}

void add_origin(nlohmann::json& meta, const RunOptions& options,
                const std::filesystem::path& output, const std::string& fingerprint) {
  meta["fingerprint"] = fingerprint;
  if (options.scene_file.empty()) return;
  meta["scene_path"] = scene_path_from(options.scene_file, output);
  meta["scene_hash"] = scene_files_hash(options.scene_file);
}

}  // namespace haarlight
