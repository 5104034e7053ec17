// The program haarlight-view: a window on a relighting session, or the session alone.

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <map>
#include <new>
#include <optional>
#include <string>

#include "core/error.h"
#include "core/float_check.h"
#include "core/parallel.h"
#include "viewer/headless.h"
#include "viewer/run_options.h"
#include "viewer/scene_run.h"
#ifdef HAARLIGHT_WINDOW
#include "viewer/show.h"
#endif

namespace {

using namespace haarlight;
using namespace haarlight::viewer;

constexpr int kStatedError = 1;
constexpr int kWrongCommandLine = 2;
#ifdef HAARLIGHT_WINDOW
constexpr bool kHasWindow = true;
#else
constexpr bool kHasWindow = false;
#endif

/// Messages are one line, whatever a library below put into them.
int fail(int code, std::string message) {
  while (!message.empty() && (message.back() == '\n' || message.back() == '.')) message.pop_back();
  std::replace(message.begin(), message.end(), '\n', ' ');
  fmt::print(stderr, "haarlight-view: {}\n", message);
  return code;
}

bool has_display() {
  for (const char* variable : {"DISPLAY", "WAYLAND_DISPLAY"}) {
    const char* value = std::getenv(variable);
    if (value && *value) return true;
  }
  return false;
}

template <typename T>
void add_words(CLI::App& app, const std::string& name, T& target,
               const std::map<std::string, T>& words, const std::string& help) {
  app.add_option(name, target, help)->transform(CLI::CheckedTransformer(words, CLI::ignore_case));
}

struct CommandLine {
  RunOptions run;
  bool headless = false, no_memory = false;
  double milliseconds = 0, error = 0, scale = 0;
  std::string exposure = "auto", tonemap = "filmic", size, picture;
  int threads = 0;
  SceneRunOptions scene;  // what a scene that moves needs beside that
  std::optional<double> least_rate;
};

void add_options(CLI::App& app, CommandLine& c) {
  RunOptions& r = c.run;
  ViewSettings& s = r.settings;
  app.add_option("FILE", r.transport,
                 "transport file (.hlt) to open, or a scene that moves (.gltf, .glb)");
  app.add_option("--env", r.env, "environment, EXR or HDR");
  app.add_option("--env-to", r.env_to, "second environment, to blend to");
  add_words<MotionKind>(app, "--motion", s.motion,
                        {{"still", MotionKind::still},
                         {"rotate", MotionKind::rotate},
                         {"tumble", MotionKind::tumble},
                         {"swing", MotionKind::swing},
                         {"blend", MotionKind::blend},
                         {"light", MotionKind::light}},
                        "how the light moves when it plays [rotate]");
  app.add_option("--degrees", s.degrees, "size of the motion, degrees [90]")
      ->check(CLI::Range(-1e6, 1e6));
  app.add_option("--speed", s.speed, "frames of the motion in a sixtieth of a second [1]")
      ->check(CLI::Range(0.0, 1000.0));
  add_words<LightingMethod>(app, "--method", s.method,
                            {{"nwa", LightingMethod::nwa},
                             {"bi", LightingMethod::bi},
                             {"pbi", LightingMethod::pbi},
                             {"reference", LightingMethod::reference}},
                            "how updates are chosen [pbi]");
  CLI::Option* wavelets =
      app.add_option("--wavelets", s.wavelets, "most wavelets changed in a frame [30]")
          ->check(CLI::Range(1, kMaxWavelets));
  CLI::Option* time = app.add_option("--ms,--budget-ms", c.milliseconds,
                                     "as many wavelets as keep a frame within so much time")
                          ->check(CLI::Range(0.01, 10000.0))
                          ->excludes(wavelets);
  app.add_option("--target-error", c.error,
                 "as few wavelets as keep the estimated relative error of the picture at or below "
                 "this")
      ->check(CLI::Range(1e-6, 1.0))
      ->excludes(wavelets)
      ->excludes(time);
  add_words<WaveletWeight>(app, "--weight", s.weight,
                           {{"none", WaveletWeight::none},
                            {"area", WaveletWeight::area},
                            {"transport", WaveletWeight::transport}},
                           "what ranks wavelets, beside their change [area]");
  app.add_option("--exposure", c.exposure, "stops, -64 to 64, or auto [auto]");
  app.add_option("--tonemap", c.tonemap, "linear, reinhard, filmic or false [filmic]")
      ->check(CLI::IsMember({"linear", "reinhard", "filmic", "false"}));
  add_words<CompareView>(
      app, "--compare", r.compare,
      {{"none", CompareView::none}, {"split", CompareView::split}, {"side", CompareView::side}},
      "show the exact picture too [none]");

  app.add_flag("--clusters", s.clusters,
               "show a compressed transport's clusters, each in a colour, in place of its light");
  app.add_option("--frames", r.frames, "play from the start, and end after so many frames")
      ->check(CLI::Range(1, 1'000'000));
  app.add_option(
      "--screenshot", r.screenshot,
      "PNG written at the end of --frames: of the window, or of the picture if headless");
  app.add_option("--exr", r.exr, "radiance of the last frame (headless)");
  app.add_option("--record", r.record, "write the motion as JSON for haarlight relight --motion");
  app.add_option("--metrics", r.metrics, "one row a frame, as haarlight relight's");
  // A scene that moves.
  add_words<SceneMethod>(
      app, "--renderer", c.scene.settings.method,
      {{"path", SceneMethod::path},
       {"irc", SceneMethod::irc},
       {"trc", SceneMethod::trc},
       {"igi", SceneMethod::igi},
       {"ic", SceneMethod::ic},
       {"tic", SceneMethod::tic}},
      "of a scene that moves: path tracing, irradiance caching or temporal radiance caching "
      "[path]");
  app.add_option("--spp", c.scene.settings.samples, "path: paths a pixel in one picture [1]")
      ->check(CLI::Range(1, 4096));
  app.add_option("--picture", c.picture, "of a scene that moves, WIDTHxHEIGHT [600x400]");
  app.add_flag("--show-life", c.scene.settings.show_life,
               "of a scene that moves: records coloured by their life, red to green");
  app.add_option("--least-rate", c.least_rate,
                 "pictures a second below which a scene that moves is drawn with fewer pixels "
                 "until it rests; 0: never [5; with --frames 0]")
      ->check(CLI::Range(0.0, 1000.0));
  app.add_option("--first", c.scene.settings.first, "frame that a scene begins with [0]")
      ->check(CLI::Range(0, 1'000'000));
  app.add_option("--pause-at", c.scene.pause_at,
                 "frame that a scene stops at with --frames; paths go on to be added there")
      ->check(CLI::Range(0, 1'000'000));
  app.add_flag("--timings", r.timings, "print medians: light, relight, upload, gui, milliseconds");
  app.add_flag("--headless", c.headless,
               "no window; the same where there is no display and --frames is given");

  app.add_option("--size", c.size, "of the window, WIDTHxHEIGHT [as left, at first 1280x800]");
  app.add_option("--scale", c.scale, "of text and widgets [as the display says]")
      ->check(CLI::Range(0.5, 4.0));
  app.add_option("--script", r.script, "play keys, clicks and drags from a file");
  app.add_flag("--no-memory", c.no_memory, "neither read nor write preferences");
  app.add_option("--threads", c.threads, "that relight [all]")->check(CLI::Range(1, 1024));
}

void read_size(const std::string& name, const std::string& text, int& width, int& height) {
  if (text.empty()) return;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &rest) != 2 || width < 1 ||
      height < 1 || width > 16384 || height > 16384) {
    throw CLI::ValidationError(name, "'" + text + "', expected WIDTHxHEIGHT");
  }
}

void finish_options(CommandLine& c) {
  RunOptions& r = c.run;
  if (c.milliseconds > 0) {
    r.settings.budget = BudgetKind::milliseconds;
    r.settings.milliseconds = c.milliseconds;
  }
  if (c.error > 0) {
    r.settings.budget = BudgetKind::error;
    r.settings.error = c.error;
  }
  if (c.exposure != "auto") {
    char* end = nullptr;
    const double ev = std::strtod(c.exposure.c_str(), &end);
    if (end == c.exposure.c_str() || *end != 0 || !(ev >= -64 && ev <= 64)) {
      throw CLI::ValidationError("--exposure",
                                 "'" + c.exposure + "', expected a number, -64 to 64, or auto");
    }
    r.exposure_ev = ev;
  }
  r.false_colour = c.tonemap == "false";
  r.curve = c.tonemap == "linear"     ? TonemapCurve::linear
            : c.tonemap == "reinhard" ? TonemapCurve::reinhard
                                      : TonemapCurve::filmic;
  r.width = r.height = 0;
  read_size("--size", c.size, r.width, r.height);
  SceneRunOptions& s = c.scene;
  read_size("--picture", c.picture, s.settings.width, s.settings.height);
  s.settings.env = r.env;
  s.settings.least_rate = c.least_rate.value_or(r.frames > 0 ? 0 : 5);
  s.scene = r.transport, s.frames = r.frames;
  s.exposure_ev = r.exposure_ev, s.curve = r.curve;
  s.screenshot = r.screenshot, s.exr = r.exr, s.metrics = r.metrics;
  r.remember = !c.no_memory;
  if (c.threads > 0) set_thread_count(c.threads);
  if (r.frames > 0) {
    r.settings.playing = true;
    r.settings.loop = false;
  }
}

/// Threads that relight wait asleep: spinning, they would take the processor from the window's
/// thread, and from the driver's where OpenGL is software. OpenMP reads its settings before main()
/// begins, so the program starts itself again with them; where that fails it goes on as it is.
void restart_with_waiting_threads(char** argv) {
  if (std::getenv("OMP_WAIT_POLICY") || std::getenv("GOMP_SPINCOUNT")) return;
  ::setenv("OMP_WAIT_POLICY", "passive", 1);
  ::execv("/proc/self/exe", argv);
}

int run(CommandLine& c) {
  const bool headless = c.headless || (!(kHasWindow && has_display()) && c.run.frames > 0);
  std::string lines;
  if (headless) {
    if (c.run.frames == 0) {
      return fail(kWrongCommandLine, "--headless has no end, expected --frames N");
    }
    if (is_scene_file(c.run.transport)) {
      run_scene_headless(c.scene);
    } else {
      lines = run_headless(c.run);
    }
  } else {
#ifdef HAARLIGHT_WINDOW
    if (!has_display()) {
      return fail(kStatedError,
                  "there is no display (DISPLAY is not set), expected one, or --frames N to run "
                  "without");
    }
    if (is_scene_file(c.run.transport)) {
      constexpr int kWidth = 1200, kHeight = 800;
      show_scene(c.scene, c.run.width > 0 ? c.run.width : kWidth,
                 c.run.height > 0 ? c.run.height : kHeight, c.scale);
    } else {
      lines = show(c.run, c.scale);
    }
#else
    return fail(kStatedError, "this program was built without a window, expected --frames N");
#endif
  }
  fmt::print("{}", lines);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  restart_with_waiting_threads(argv);
  CLI::App app{
      "Relights a transport file while you turn the light, and shows what each method does with "
      "its budget."};
  app.name("haarlight-view");
  app.set_version_flag("--version", "haarlight-view " HAARLIGHT_VERSION);
  app.footer(
      "\nIn the window: drag to turn the light, Space plays, H lists the keys.\n"
      "Exit codes: 0 done; 1 a stated error, in one line; 2 a wrong command line.\n\n"
      "Examples:\n"
      "  haarlight-view bunny.hlt --env lobby.exr\n"
      "  haarlight-view spheres.glb --renderer path\n"
      "  haarlight-view bunny.hlt --env lobby.exr --frames 120 --screenshot p.png --motion rotate");
  CommandLine command;
  add_options(app, command);
  try {
    check_float_arithmetic();
    app.parse(argc, argv);
    finish_options(command);
    return run(command);
  } catch (const CLI::Success& help_or_version) {
    return app.exit(help_or_version);
  } catch (const CLI::ParseError& error) {
    return fail(kWrongCommandLine,
                fmt::format("{} (haarlight-view --help lists the options)", error.what()));
  } catch (const std::bad_alloc&) {
    return fail(kStatedError, "not enough memory for this size, expected more or a smaller size");
  } catch (const std::exception& error) {
    return fail(kStatedError, error.what());
  }
}
