// haarlight animate: a scene that moves, to pictures and metrics.

#include <fmt/format.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <tuple>

#include "apps/caching_options.h"
#include "apps/instant_options.h"
#include "apps/option_parsers.h"
#include "apps/outputs.h"
#include "apps/progress_printer.h"
#include "apps/verbs.h"
#include "caching/animated_scene.h"
#include "caching/animation_method.h"
#include "caching/environment_light.h"
#include "caching/path_picture.h"
#include "core/atomic_file.h"
#include "core/image_io.h"
#include "prt/tonemap.h"

namespace haarlight {
namespace {

constexpr int kMaxFrames = 1'000'000;
constexpr int kMaxSamples = 1 << 20;
constexpr double kMaxRate = 1000, kMaxExposure = 64;

struct AnimateCommand {
  std::filesystem::path scene, folder, metrics, env;
  double env_turn = 0, env_speed = 0;  // degrees, degrees a second
  std::string method = "path";
  int frames = 0;  // 0: all of the animation
  int first = 0;
  double rate = 25;
  int seed = 1;
  PathPictureOptions picture{512, 512, 64, 1, false, false};
  CachingOptions caching;
  InstantOptions instant;
  std::optional<double> exposure_ev;

  void run() const;

 private:
  std::unique_ptr<AnimationMethod> make(const AnimatedScene& animation) const;
  void save(int number, const FramePicture& frame, double exposure) const;
};

std::unique_ptr<AnimationMethod> AnimateCommand::make(const AnimatedScene& animation) const {
  const auto number = static_cast<std::uint64_t>(seed);
  if (method == "path") {
    PathPictureOptions options = picture;
    options.seed = number;
    return std::make_unique<PathMethod>(animation, options);
  }
  if (method == "irc" || method == "trc") {
    CachingOptions options = caching;
    options.width = picture.width, options.height = picture.height;
    options.temporal = method == "trc", options.seed = number;
    return std::make_unique<CachingMethod>(animation, options);
  }
  InstantOptions options = instant;
  options.width = picture.width, options.height = picture.height;
  options.show_life = caching.show_life;
  options.kind = method == "direct" ? InstantKind::direct
                 : method == "igi"  ? InstantKind::igi
                 : method == "ic"   ? InstantKind::ic
                                    : InstantKind::tic;
  return std::make_unique<InstantMethod>(animation, options);
}

void AnimateCommand::save(int number, const FramePicture& frame, double exposure) const {
  const std::string stem = (folder / fmt::format("frame_{:04}", number)).string();
  save_image(stem + ".exr", frame.radiance);
  save_image(stem + ".png", tonemap(frame.radiance, {TonemapCurve::filmic, exposure}));
  for (const auto& [name, extra] : frame.extra) {
    save_image((folder / fmt::format("{}_{:04}.png", name, number)).string(), extra);
  }
}

void AnimateCommand::run() const {
  if (folder.empty() && metrics.empty()) {
    throw CLI::ValidationError("-o", "'', expected a folder for pictures, or --metrics FILE.csv");
  }
  AnimatedScene animation(scene, rate);
  if (!env.empty()) {
    constexpr double kDegree = kPi / 180;
    animation.set_environment(std::make_shared<const EnvironmentLight>(load_environment(env)),
                              env_turn * kDegree, env_speed * kDegree);
  }
  const int count = frames > 0 ? frames : std::max(animation.frames() - first, 1);
  frame_camera(animation.at(first), picture.width, picture.height);  // refused before any work
  if (!folder.empty()) require_writable_folder(folder);
  const std::unique_ptr<AnimationMethod> drawing = make(animation);
  std::optional<AtomicFile> table;
  const auto write = [&](const std::string& line) { table->write(line.data(), line.size()); };
  if (!metrics.empty()) {
    table.emplace(metrics);
    write(fmt::format("frame,method,triangles,{}\n", join_words(drawing->figures(), ",")));
  }

  ProgressPrinter progress("animate");
  const double before = drawing->prepare_share();
  drawing->prepare(first, count, [&](double share) { return progress(before * share); });
  // The exposure is chosen once, so that frames can be compared.
  std::optional<double> exposure = exposure_ev;
  for (int i = 0; i < count; ++i) {
    const FramePicture frame = drawing->frame(first + i, [&](double share) {
      return progress(before + (1 - before) * (i + share) / count);
    });
    if (!exposure) exposure = auto_exposure_ev(frame.radiance);
    if (!folder.empty()) save(first + i, frame, *exposure);
    if (table) {
      std::string line = fmt::format("{},{},{}", first + i, method, animation.triangle_count());
      for (const double x : frame.figure) line += fmt::format(",{:.6g}", x);
      write(line + "\n");
    }
  }
  if (table) table->commit();
}

}  // namespace

Verb add_animate(CLI::App& verb) {
  auto command = std::make_shared<AnimateCommand>();
  AnimateCommand& c = *command;
  add_path(verb, "SCENE", c.scene, "SCENE.gltf", "animated glTF scene, .gltf or .glb")->required();
  add_choice<std::string>(verb, "--method", c.method,
                          {{"path", "path"},
                           {"irc", "irc"},
                           {"trc", "trc"},
                           {"direct", "direct"},
                           {"igi", "igi"},
                           {"ic", "ic"},
                           {"tic", "tic"}},
                          "path: path tracing, all bounces; irc: irradiance caching, anew every "
                          "frame; trc: temporal radiance caching; by virtual lights: igi: instant "
                          "global illumination, ic: instant caching, anew every frame; tic: "
                          "temporal instant caching; direct: none but direct light");
  add_path(verb, "--env", c.env, "FILE",
           "a picture behind everything, EXR or HDR, in place of the scene's");
  add_number(verb, "--env-turn", c.env_turn, -1e6, 1e6, "turn of --env about +Y, degrees");
  add_number(verb, "--env-speed", c.env_speed, -1e6, 1e6, "and how it turns, degrees a second");
  add_integer(verb, "--frames", c.frames, 0, kMaxFrames,
              "how many; 0: to the end of the animation");
  add_integer(verb, "--first", c.first, 0, kMaxFrames, "number of the first");
  add_number(verb, "--fps", c.rate, 1e-3, kMaxRate, "frames a second of the animation");
  add_integer(verb, "--spp", c.picture.samples, 1, kMaxSamples, "path: paths a pixel");
  add_choice<bool>(
      verb, "--filter", c.picture.centred, {{"box", false}, {"none", true}},
      "path: box: paths are spread over the pixel; none: all go through its middle, as "
      "those of other methods do");
  add_choice<bool>(verb, "--noise", c.picture.frozen, {{"fresh", false}, {"frozen", true}},
                   "path: frozen: the same random numbers in every frame");
  add_integer(verb, "--seed", c.seed, 1, kMaxSamples,
              "path, irc, trc: of random numbers; another seed, other noise");
  add_caching_options(verb, c.caching);
  add_instant_options(verb, c.instant);
  verb.add_option_function<std::string>(
          "--size",
          [&c](const std::string& text) {
            std::tie(c.picture.width, c.picture.height) = parse_size("--size", text);
          },
          "of the pictures, pixels, each 1 to 8192 [512x512]")
      ->type_name("WxH");
  verb.add_option_function<std::string>(
          "--exposure",
          [&c](const std::string& text) {
            c.exposure_ev.reset();
            if (text == "auto") return;
            c.exposure_ev = parse_number("--exposure", text, -kMaxExposure, kMaxExposure);
          },
          fmt::format("of the PNGs: stops, {} to {}, or auto: chosen once, from the first frame "
                      "[auto]",
                      -kMaxExposure, kMaxExposure))
      ->type_name("auto|EV");
  add_path(verb, "-o,--output", c.folder, "DIR",
           "folder for frame_0000.exr, frame_0000.png, ...; made if missing");
  add_path(verb, "--metrics", c.metrics, "FILE.csv",
           "one row a frame: frame, method, triangles, and what the method reports: path: build_ms "
           "(scene and ray tracer), render_ms; irc, trc: records_new, records_replaced, "
           "records_alive, rays (of hemispheres), build_ms, update_ms (of records, by the clock), "
           "hemisphere_ms and reproject_ms (parts of it, summed over threads), render_ms; direct, "
           "igi, ic, tic: build_ms (scene and ray tracer), direct_ms (rays of the camera, direct "
           "light, lobes), lights_ms, update_ms (of the cache), gather_ms (new records and "
           "interpolation), diffuse_ms (the last three), total_ms; numbers of lights and records; "
           "rays (shadow rays through the whole scene), rays_moving (through what moves alone), "
           "rays_saved (known from the frame before), bounded (share of light that --min-distance "
           "took)");
  add_threads(verb);
  verb.footer(
      "\nMoves: nodes, morph targets, cameras, lights (KHR_lights_punctual), and the numbers of\n"
      "materials, lights and cameras by KHR_animation_pointer. Light: lamps, shining triangles\n"
      "(emissiveFactor times KHR_materials_emissive_strength), one radiance behind everything "
      "(the\n"
      "scene's extras, \"haarlight\": {\"background\": [r, g, b]}) and a picture (--env, or in "
      "the\n"
      "extras, \"environment\": {\"uri\": \"sky.exr\", \"rotation\": radians}).\n"
      "\nExample:\n"
      "  haarlight-data animation cube-in-box -o box.glb\n"
      "  haarlight animate box.glb --frames 10 --size 256x192 --spp 32 -o out/box");
  return [command] { command->run(); };
}

}  // namespace haarlight
