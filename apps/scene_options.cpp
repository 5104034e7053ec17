// Options that say what of a scene is traced, and how well.

#include "apps/scene_options.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <tuple>

#include "apps/option_parsers.h"
#include "apps/repairs.h"
#include "core/error.h"
#include "precompute/brdf_factors.h"
#include "precompute/effects.h"
#include "precompute/material_import.h"
#include "precompute/scene_import.h"

namespace haarlight {

void add_scene_options(CLI::App& verb, SceneOptions& scene, MeshOptions& options) {
  add_path(verb, "SCENE", scene.scene, "SCENE", "glTF, GLB, OBJ or PLY; metres, +Y up")->required();

  add_choice<SceneOptions::View>(
      verb, "--view", scene.view,
      {{"auto", SceneOptions::View::automatic},
       {"scene", SceneOptions::View::scene},
       {"framing", SceneOptions::View::framing}},
      "the camera of the scene, or one that frames it; auto: the scene's if it has one")
      ->group("Stage");
  verb.add_option_function<std::string>(
          "--size",
          [&scene](const std::string& text) {
            std::tie(scene.stage.width, scene.stage.height) = parse_size("--size", text);
          },
          fmt::format("of the picture, pixels, each 1 to 8192 [{}x{}]", scene.stage.width,
                      scene.stage.height))
      ->type_name("WxH")
      ->group("Stage");
  add_choice<GroundMode>(
      verb, "--ground", scene.stage.ground,
      {{"auto", GroundMode::automatic}, {"on", GroundMode::on}, {"off", GroundMode::off}},
      "a grey plane under the scene; auto: if it has neither floor nor camera")
      ->group("Stage");

  add_power_of_two(verb, "--face", options.trace.face_size, 4, 256,
                   "texels along a face of the lighting cube")
      ->group("Accuracy");
  add_integer(verb, "--spp", options.trace.spp, 1, 64,
              "rays a texel where visibility changes, one elsewhere")
      ->group("Accuracy");
  verb.add_flag_function(
          "--uniform-spp", [&options](std::int64_t) { options.trace.adaptive = false; },
          "--spp rays in every texel")
      ->group("Accuracy");
  add_choice<int>(verb, "--pixel-samples", options.trace.pixel_samples,
                  {{"1", 1}, {"4", 4}, {"16", 16}}, "places looked at in a pixel, against jaggies")
      ->group("Accuracy");
  verb.add_option_function<std::string>(
          "--effects",
          [&scene, &options](const std::string& text) {
            scene.auto_effects = text == "auto";
            if (!scene.auto_effects) options.trace.effects = parse_effects(text);
          },
          "auto: what the plan finds the scene to call for; all, none, or a list of shadows, "
          "interreflection[=BOUNCES], gloss, specular, caustics, color [auto]")
      ->type_name("auto|all|LIST")
      ->group("Light");
  verb.add_option_function<std::string>(
          "--bounces",
          [&scene](const std::string& text) {
            if (text == "auto") return;
            scene.bounces = parse_integer("--bounces", text, 0, kMostBounces);
          },
          fmt::format("most reflections between surfaces, 0 to {}; auto: as --effects says [auto]",
                      kMostBounces))
      ->type_name("auto|N")
      ->group("Light");
  add_power_of_two(verb, "--indirect-face", options.trace.indirect_face, 4, 256,
                   "the same for light reflected between surfaces, which needs less")
      ->group("Accuracy");
  add_number(verb, "--noise", options.trace.noise, 1e-6, 1,
             "relative RMSE that interreflection's paths may leave in a tile's picture")
      ->group("Accuracy");
  add_integer(verb, "--paths", options.trace.paths, 1, 1 << 20,
              "most paths a tile of 64 rows, whatever the noise")
      ->group("Accuracy");
  add_number(verb, "--error", options.error, 0, 0.5,
             "relative RMSE of the picture that compression may cost; 0 keeps all")
      ->group("Accuracy");

  CLI::Option* per_vertex =
      verb.add_flag("--vertices", scene.vertices,
                    "light of the mesh's vertices, to be seen from anywhere, instead of one view's "
                    "pixels; --view and --size say how it is shown first")
          ->group("Mesh");
  add_choice<bool>(verb, "--subdivide", options.subdivide, {{"auto", true}, {"off", false}},
                   "auto: split triangles where visibility changes by more than --error")
      ->needs(per_vertex)
      ->group("Mesh");
  verb.add_option_function<std::string>(
          "--terms",
          [&options](const std::string& text) {
            if (text == "auto") {
              options.terms.terms = 0;
              return;
            }
            const double terms = parse_number("--terms", text, 1, kMostBrdfTerms);
            if (terms != std::floor(terms)) {
              refuse_option("--terms", text,
                            fmt::format("auto or a whole number, 1 to {}", kMostBrdfTerms));
            }
            options.terms.terms = static_cast<int>(terms);
          },
          fmt::format(
              "of the BRDF of each vertex, 1 to {}, where gloss is among the effects: a "
              "highlight is seen as sharp as they allow. auto: as many as --terms-error asks "
              "for, at most {} [auto]",
              kMostBrdfTerms, options.terms.most))
      ->type_name("auto|K")
      ->needs(per_vertex)
      ->group("Mesh");
  add_number(verb, "--terms-error", options.terms.error, 0.001, 0.99,
             "relative RMS that --terms auto may leave of a BRDF, over both hemispheres")
      ->needs(per_vertex)
      ->group("Mesh");
  verb.add_option_function<std::vector<std::string>>(
          "--merl", [&scene](const std::vector<std::string>& all) { scene.merl = all; },
          "the material of that name is the measured BRDF in FILE.binary, in MERL's form (90 x 90 "
          "x "
          "180 cells or others); may be given for several")
      ->type_name("MATERIAL=FILE.binary")
      ->allow_extra_args(false)
      ->needs(per_vertex)
      ->group("Mesh");
  add_integer(verb, "--max-vertices", options.max_vertices, 1, 100'000'000,
              "that subdivision may lead to")
      ->needs(per_vertex)
      ->group("Mesh");
}

namespace {

// "MATERIAL=FILE".
void set_merl(const std::string& pair, const std::filesystem::path& file, Scene& scene) {
  const std::size_t at = pair.rfind('=');
  if (at == std::string::npos || at == 0 || at + 1 == pair.size()) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("--merl is \"{}\", expected MATERIAL=FILE.binary", pair));
  }
  const std::string name = pair.substr(0, at);
  bool found = false;
  std::string names;
  for (std::size_t m = 0; m < scene.material.size(); ++m) {
    names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", scene.material[m].name);
    if (scene.material[m].name != name) continue;
    set_measured(scene, m, pair.substr(at + 1));
    found = true;
  }
  if (!found) {
    throw Error(ErrorKind::missing, fmt::format("{}: has no material \"{}\", expected one of {}",
                                                file.string(), name, names));
  }
}

}  // namespace

StagedScene load_scene(SceneOptions& options, bool say_repairs) {
  StagedScene staged{import_scene(options.scene), {}};
  if (options.view == SceneOptions::View::scene && !staged.scene.camera) {
    throw Error(ErrorKind::missing,
                fmt::format("{}: has no perspective camera, expected one for --view scene",
                            options.scene.string()));
  }
  for (const std::string& pair : options.merl) set_merl(pair, options.scene, staged.scene);
  if (say_repairs) print_repairs(options.scene, staged.scene.report);
  for (const Material& material : staged.scene.material) {
    if (material.model != SurfaceModel::measured || options.vertices) continue;
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{}: material \"{}\" is a measured BRDF, expected --vertices: a fixed "
                            "view has none",
                            options.scene.string(), material.name));
  }
  options.stage.use_scene_camera = options.view != SceneOptions::View::framing;
  staged.stage = set_stage(staged.scene, options.stage);
  return staged;
}

}  // namespace haarlight
