// What a transport file says of how, and of which scene, it was made.

#include "precompute/scene_meta.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "precompute/fingerprint.h"
#include "precompute/scene_files.h"

namespace haarlight {
namespace {

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

}  // namespace

nlohmann::json run_meta(const Scene& scene, const PrecomputeOptions& options,
                        const std::filesystem::path& output, const std::string& fingerprint) {
  const TraceOptions& t = options.trace;
  nlohmann::json meta{{"generator", fmt::format("haarlight tracer {}", kTracerVersion)},
                      {"scene", scene_meta(scene)},
                      {"options",
                       {{"face", t.face_size},
                        {"spp", t.spp},
                        {"adaptive", t.adaptive},
                        {"error", options.error},
                        {"indirect_face", t.indirect_face},
                        {"noise", t.noise},
                        {"paths", t.paths},
                        {"seed", t.seed}}},
                      {"effects", to_string(t.effects)},
                      {"fingerprint", fingerprint}};
  if (!options.plan.empty()) meta["plan"] = nlohmann::json::parse(options.plan);
  if (!options.scene_file.empty()) {
    meta["scene_path"] = scene_path_from(options.scene_file, output);
    meta["scene_hash"] = scene_files_hash(options.scene_file);
  }
  return meta;
}

std::string meta_text(const nlohmann::json& meta) {
  return meta.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace haarlight
