// The offline main path: a scene and a view in, a transport file out.

#include "precompute/precompute.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "precompute/distribution.h"
#include "precompute/fingerprint.h"
#include "precompute/picture_tiles.h"
#include "precompute/run_checks.h"
#include "precompute/scene_meta.h"
#include "precompute/scene_notes.h"
#include "precompute/tile_run.h"

namespace haarlight {
namespace {

std::string meta_json(const Scene& scene, const PrecomputeOptions& options,
                      const std::filesystem::path& file, const std::string& fingerprint) {
  const TraceOptions& t = options.trace;
  nlohmann::json meta{{"generator", fmt::format("haarlight tracer {}", kTracerVersion)},
                      {"scene", scene_meta(scene)},
                      {"options",
                       {{"face", t.face_size},
                        {"spp", t.spp},
                        {"adaptive", t.adaptive},
                        {"pixel_samples", t.pixel_samples},
                        {"error", options.error},
                        {"indirect_face", t.indirect_face},
                        {"noise", t.noise},
                        {"paths", t.paths},
                        {"seed", t.seed}}},
                      {"effects", to_string(t.effects)}};
  if (!options.plan.empty()) meta["plan"] = nlohmann::json::parse(options.plan);
  add_origin(meta, options, file, fingerprint);
  return meta.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

std::string precompute_fingerprint(const Scene& scene, const Camera& camera,
                                   const PrecomputeOptions& options) {
  ContentHash hash;
  hash.add(kTracerVersion);
  add_scene(hash, scene);
  add_camera(hash, camera);
  add_options(hash, options.trace);
  add_options(hash, static_cast<const RunOptions&>(options));
  return hash.text();
}

PrecomputeReport precompute_image(const Scene& scene, const Camera& camera,
                                  const PrecomputeOptions& options,
                                  const std::filesystem::path& file, const Progress& progress) {
  std::optional<Visibility> visibility;
  std::optional<PictureTiles> tiles;
  std::vector<std::string> notes;
  together(options.distribution, [&] {
    check(static_cast<const RunOptions&>(options));
    check(options.trace);
    check(camera);
    check_output(file);
    visibility.emplace(scene);
    tiles.emplace(scene, *visibility, camera, options.trace);
    notes = scene_notes(scene, *visibility, &camera);
  });
  TileRun run;
  run.info.face_size = options.trace.face_size;
  run.info.width = camera.width;
  run.info.height = camera.height;
  run.info.camera = camera;
  run.fingerprint = precompute_fingerprint(scene, camera, options);
  run.meta = meta_json(scene, options, file, run.fingerprint);
  PrecomputeReport report = run_tiles(*tiles, run, options, file, progress);
  report.notes = std::move(notes);
  return report;
}

}  // namespace haarlight
