// haarlight precompute: traces a scene's transport for one view and writes it to a file.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <tuple>

#include "apps/mpi_distribution.h"
#include "apps/option_parsers.h"
#include "apps/outputs.h"
#include "apps/progress_printer.h"
#include "apps/repairs.h"
#include "apps/run_options.h"
#include "apps/verbs.h"
#include "core/error.h"
#include "precompute/default_stage.h"
#include "precompute/distribution.h"
#include "precompute/effects.h"
#include "precompute/precompute_mesh.h"
#include "precompute/scene_import.h"

namespace haarlight {
namespace {

enum class View { automatic, scene, framing };

struct PrecomputeCommand {
  std::filesystem::path scene, output;
  View view = View::automatic;
  StageOptions stage;
  MeshOptions options;
  bool vertices = false;

  void run();

 private:
  void run_alone_or_together(Distribution* others);

  void print_mesh(const MeshReport& report) const;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Only the leader of several processes speaks.
void PrecomputeCommand::run() {
  const std::unique_ptr<Distribution> others = start_distribution();
  if (!others || others->leads()) {
    run_alone_or_together(others.get());
    return;
  }
  try {
    run_alone_or_together(others.get());
  } catch (const std::exception&) {
    throw SilentFailure();
  }
}

void PrecomputeCommand::run_alone_or_together(Distribution* others) {
  const auto begin = std::chrono::steady_clock::now();
  const bool speaks = !others || others->leads();
  Scene imported;
  Stage made;
  together(others, [&] {
    // Long work must not end at a place that cannot be written.
    if (speaks) require_writable_file(output);
    imported = import_scene(scene);
    if (speaks) print_repairs(scene, imported.report);
    if (view == View::scene && !imported.camera) {
      throw Error(ErrorKind::missing,
                  fmt::format("{}: has no perspective camera, expected one for --view scene",
                              scene.string()));
    }
    stage.use_scene_camera = view != View::framing;
    made = set_stage(imported, stage);
  });
  options.distribution = others;
  options.scene_file = scene;
  PrecomputeReport report;
  std::optional<MeshReport> mesh;
  {
    ProgressPrinter progress("precompute");
    const Progress show = [&](double share) { return !speaks || progress(share); };
    MeshOptions watched = options;
    if (speaks) static_cast<RunOptions&>(watched) = watched_by(progress, options);
    if (watched.time_limit > 0) {  // importing counts
      watched.time_limit = std::max(0.05, watched.time_limit - seconds_since(begin));
    }
    if (vertices) {
      mesh = precompute_mesh(imported, made.camera, watched, output, show);
      report = mesh->run;
    } else {
      report = precompute_image(imported, made.camera, watched, output, show);
    }
  }
  if (!speaks) return;
  fmt::print("{}: {}x{} pixels, {}{}\n", output.string(), stage.width, stage.height,
             made.camera_made ? "framing camera" : "camera of the scene",
             made.ground_added ? ", ground added" : "");
  if (mesh) print_mesh(*mesh);
  print_outcome(output, options, report);
}

void PrecomputeCommand::print_mesh(const MeshReport& report) const {
  const SubdivideReport& s = report.subdivision;
  fmt::print("{} vertices, {} triangles", s.vertices, s.triangles);
  if (s.split_edges > 0) {
    fmt::print(", {} edges split in {:.1f} s where the light changes", s.split_edges,
               report.subdivision_seconds);
  }
  fmt::print("\n");
  if (report.view_dependent > 0) {
    fmt::print("{} vertices are glossy, mirrors or glass: their diffuse part alone is kept\n",
               report.view_dependent);
  }
}

}  // namespace

Verb add_precompute(CLI::App& verb) {
  auto command = std::make_shared<PrecomputeCommand>();
  PrecomputeCommand& c = *command;

  add_path(verb, "SCENE", c.scene, "SCENE", "glTF, GLB, OBJ or PLY; metres, +Y up")->required();
  add_path(verb, "-o,--output", c.output, "FILE.hlt", "transport file to write")->required();

  add_choice<View>(
      verb, "--view", c.view,
      {{"auto", View::automatic}, {"scene", View::scene}, {"framing", View::framing}},
      "the camera of the scene, or one that frames it; auto: the scene's if it has one")
      ->group("Stage");
  verb.add_option_function<std::string>(
          "--size",
          [&c](const std::string& text) {
            std::tie(c.stage.width, c.stage.height) = parse_size("--size", text);
          },
          fmt::format("of the picture, pixels, each 1 to 8192 [{}x{}]", c.stage.width,
                      c.stage.height))
      ->type_name("WxH")
      ->group("Stage");
  add_choice<GroundMode>(
      verb, "--ground", c.stage.ground,
      {{"auto", GroundMode::automatic}, {"on", GroundMode::on}, {"off", GroundMode::off}},
      "a grey plane under the scene; auto: if it has neither floor nor camera")
      ->group("Stage");

  add_power_of_two(verb, "--face", c.options.trace.face_size, 4, 256,
                   "texels along a face of the lighting cube")
      ->group("Accuracy");
  add_integer(verb, "--spp", c.options.trace.spp, 1, 64,
              "rays a texel where visibility changes, one elsewhere")
      ->group("Accuracy");
  verb.add_flag_function(
          "--uniform-spp", [&c](std::int64_t) { c.options.trace.adaptive = false; },
          "--spp rays in every texel")
      ->group("Accuracy");
  add_choice<int>(verb, "--pixel-samples", c.options.trace.pixel_samples,
                  {{"1", 1}, {"4", 4}, {"16", 16}}, "places looked at in a pixel, against jaggies")
      ->group("Accuracy");
  verb.add_option_function<std::string>(
          "--effects",
          [&c](const std::string& text) { c.options.trace.effects = parse_effects(text); },
          "all, none, or a list of shadows, interreflection[=BOUNCES], gloss, specular, caustics, "
          "color")
      ->type_name("LIST")
      ->group("Light");
  add_power_of_two(verb, "--indirect-face", c.options.trace.indirect_face, 4, 256,
                   "the same for light reflected between surfaces, which needs less")
      ->group("Accuracy");
  add_number(verb, "--noise", c.options.trace.noise, 1e-6, 1,
             "relative RMSE that interreflection's paths may leave in a tile's picture")
      ->group("Accuracy");
  add_integer(verb, "--paths", c.options.trace.paths, 1, 1 << 20,
              "most paths a tile of 64 rows, whatever the noise")
      ->group("Accuracy");
  add_number(verb, "--error", c.options.error, 0, 0.5,
             "relative RMSE of the picture that compression may cost; 0 keeps all")
      ->group("Accuracy");

  CLI::Option* per_vertex =
      verb.add_flag("--vertices", c.vertices,
                    "light of the mesh's vertices, to be seen from anywhere, instead of one view's "
                    "pixels; --view and --size say how it is shown first")
          ->group("Mesh");
  add_choice<bool>(verb, "--subdivide", c.options.subdivide, {{"auto", true}, {"off", false}},
                   "auto: split triangles where visibility changes by more than --error")
      ->needs(per_vertex)
      ->group("Mesh");
  add_integer(verb, "--max-vertices", c.options.max_vertices, 1, 100'000'000,
              "that subdivision may lead to")
      ->needs(per_vertex)
      ->group("Mesh");

  add_run_options(verb, c.options);

  verb.footer(
      "\nA mesh without material, camera or ground gets grey diffuse, a framing camera and a "
      "plane.\n"
      "Until the file is complete the part done is in FILE.hlt.partial. Ctrl-C (or --time-limit)\n"
      "leaves that and a file whose missing parts are a preview; a second Ctrl-C ends at once.\n\n"
      "Examples:\n"
      "  haarlight precompute bunny.obj -o bunny.hlt\n"
      "  haarlight precompute bunny.obj -o mesh.hlt --vertices --face 32\n"
      "  haarlight precompute room.glb -o room.hlt --size 1280x720 --error 0.005\n"
      "  haarlight precompute room.glb -o room.hlt --size 1280x720 --error 0.005 --resume\n"
      "  haarlight precompute room.glb -o room.hlt --time-limit 600 --max-bytes 200M");
  return [command] { command->run(); };
}

}  // namespace haarlight
