// haarlight precompute: traces a scene's transport for one view and writes it to a file.

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <tuple>

#include "apps/option_parsers.h"
#include "apps/outputs.h"
#include "apps/progress_printer.h"
#include "apps/repairs.h"
#include "apps/verbs.h"
#include "core/error.h"
#include "precompute/default_stage.h"
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
  void print_summary(const Stage& made, const PrecomputeReport& report) const;
  void print_mesh(const MeshReport& report) const;
};

void PrecomputeCommand::run() {
  // Long work must not end at a place that cannot be written.
  require_writable_file(output);

  Scene imported = import_scene(scene);
  print_repairs(scene, imported.report);
  if (view == View::scene && !imported.camera) {
    throw Error(ErrorKind::missing,
                fmt::format("{}: has no perspective camera, expected one for --view scene",
                            scene.string()));
  }
  stage.use_scene_camera = view != View::framing;
  const Stage made = set_stage(imported, stage);

  try {
    ProgressPrinter progress("precompute");
    const Progress show = [&](double share) { return progress(share); };
    if (vertices) {
      const MeshReport report = precompute_mesh(imported, made.camera, options, output, show);
      print_summary(made, report.run);
      print_mesh(report);
    } else {
      print_summary(made, precompute_image(imported, made.camera, options, output, show));
    }
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::cancelled) throw;
    const std::filesystem::path journal = output.string() + ".partial";
    if (!std::filesystem::exists(journal)) {
      throw Error(ErrorKind::cancelled, "stopped before any part was done; nothing was written");
    }
    throw Error(ErrorKind::cancelled,
                fmt::format("stopped; the part done is kept in {}, and the same command with "
                            "--resume goes on from there",
                            journal.string()));
  }
}

void PrecomputeCommand::print_summary(const Stage& made, const PrecomputeReport& report) const {
  fmt::print("{}: {}x{} pixels, {}{}\n", output.string(), stage.width, stage.height,
             made.camera_made ? "framing camera" : "camera of the scene",
             made.ground_added ? ", ground added" : "");
  fmt::print("{:.1f} MiB, {:.1f} million rays, {:.1f} s, measured picture error {:.3g}\n",
             static_cast<double>(report.bytes) / (1024.0 * 1024.0),
             static_cast<double>(report.rays) * 1e-6, report.seconds, report.measured_error);
  if (report.resumed_tiles > 0) {
    fmt::print("{} of {} tiles were there already\n", report.resumed_tiles, report.tiles);
  }
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

  add_threads(verb)->group("Running");
  verb.add_flag("--resume", c.options.resume,
                "go on with FILE.hlt.partial of a run that was cut off, if it is there and fits")
      ->group("Running");

  verb.footer(
      "\nA mesh without material, camera or ground gets grey diffuse, a framing camera and a "
      "plane.\n"
      "The file appears when it is complete; until then the part done is in FILE.hlt.partial.\n\n"
      "Examples:\n"
      "  haarlight precompute bunny.obj -o bunny.hlt\n"
      "  haarlight precompute bunny.obj -o mesh.hlt --vertices --face 32\n"
      "  haarlight precompute room.glb -o room.hlt --size 1280x720 --error 0.005\n"
      "  haarlight precompute room.glb -o room.hlt --size 1280x720 --error 0.005 --resume");
  return [command] { command->run(); };
}

}  // namespace haarlight
