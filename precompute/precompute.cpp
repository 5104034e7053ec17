// The offline main path: a scene and a view in, a transport file out.

#include "precompute/precompute.h"

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
  nlohmann::json meta = run_meta(scene, options, file, run.fingerprint);
  meta["options"]["pixel_samples"] = options.trace.pixel_samples;
  run.meta = meta_text(meta);
  PrecomputeReport report = run_tiles(*tiles, run, options, file, progress);
  report.notes = std::move(notes);
  return report;
}

}  // namespace haarlight
