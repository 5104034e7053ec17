// haarlight relight: a transport file under a moving environment, to pictures and metrics.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "apps/option_parsers.h"
#include "apps/outputs.h"
#include "apps/progress_printer.h"
#include "apps/repairs.h"
#include "apps/verbs.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/image_metrics.h"
#include "cpca/cluster_relighter.h"
#include "prt/completeness.h"
#include "prt/image_relighter.h"
#include "prt/metrics_csv.h"
#include "prt/motion_background.h"
#include "prt/relight_sequence.h"
#include "prt/tonemap.h"
#include "wavelet/projection.h"

namespace haarlight {
namespace {

constexpr int kMaxFrames = 1'000'000;
constexpr double kMaxDegrees = 1e6;
constexpr double kMaxExposure = 64;
constexpr double kLeastMilliseconds = 0.01, kMostMilliseconds = 1e6, kLeastError = 1e-6;
const std::vector<std::string> kFormats{"exr", "png"};

struct RelightCommand {
  std::filesystem::path transport, env, env_to, folder, metrics;
  std::filesystem::path recording;  // replayed instead of sequence.motion, if there is one
  std::vector<const CLI::Option*> said_by_recording;
  std::optional<Projection> projection;
  SequenceOptions sequence;
  int every = 1;
  std::string save_frames;
  std::optional<double> exposure_ev;
  ClusterRelightOptions clusters;
  bool basis_terms_asked = false;
  TonemapCurve curve = TonemapCurve::filmic;
  bool no_background = false;
  std::vector<std::string> formats = kFormats;

  void run() const;

 private:
  /// Options that are wrong only together.
  void check() const;
  void check_kind(const Transport& scene) const;
  std::vector<Environment> load(const MotionRecording& replayed) const;
  std::vector<int> frames_to_save(int frames) const;
  void save(const SequenceFrame& frame, Image picture, double exposure) const;
};

void check_choice(const std::string& text) {
  if (motion_from_name(text)) return;
  if (std::filesystem::path(text).extension() == ".json") return;
  refuse_option("--motion", text,
                "one of still, rotate, tumble, swing, blend, light, or a recording, FILE.json");
}

void RelightCommand::check() const {
  if (folder.empty() && metrics.empty()) {
    throw CLI::ValidationError("-o", "'', expected a folder for pictures, or --metrics FILE.csv");
  }
  if (folder.empty() && (!save_frames.empty() || every != 1)) {
    throw CLI::ValidationError("-o", "'', expected a folder for the frames to save");
  }
  if (!recording.empty()) {
    for (const CLI::Option* option : said_by_recording) {
      if (option->count() == 0) continue;
      refuse_option(option->get_name(), option->as<std::string>(),
                    "nothing, since the recording says it frame by frame");
    }
    return;
  }
  if (env.empty()) throw CLI::ValidationError("--env", "is required, expected an environment");
  if (sequence.motion.kind == MotionKind::blend && env_to.empty()) {
    throw CLI::ValidationError("--env-to",
                               "'', expected the environment to blend to, since "
                               "--motion is blend");
  }
  if (sequence.motion.kind != MotionKind::blend && !env_to.empty()) {
    refuse_option("--env-to", env_to.string(),
                  "no second environment, since --motion is " + motion_name(sequence.motion.kind));
  }
}

void RelightCommand::check_kind(const Transport& scene) const {
  if (basis_terms_asked && scene.kind() != TransportKind::clusters) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{}: not compressed, expected a file made by haarlight compress for "
                            "--basis-terms",
                            transport.string()));
  }
  if (scene.info().mesh) return;
  if (sequence.orbit_degrees != 0) {
    refuse_option("--orbit", fmt::format("{}", sequence.orbit_degrees),
                  "none, since the transport is of one view and not of a mesh");
  }
  if (sequence.width > 0) {
    refuse_option("--size", fmt::format("{}x{}", sequence.width, sequence.height),
                  fmt::format("none, since the transport is of one view of {}x{} pixels",
                              scene.width(), scene.height()));
  }
}

std::vector<int> RelightCommand::frames_to_save(int count) const {
  if (folder.empty()) return {};
  if (!save_frames.empty()) return parse_frames("--save-frames", save_frames, count - 1);
  std::vector<int> frames;
  for (int frame = 0; frame < count; frame += every) frames.push_back(frame);
  return frames;
}

/// The environments of a recording; --env and --env-to take the places of its first two.
std::vector<Environment> RelightCommand::load(const MotionRecording& replayed) const {
  std::vector<Environment> environments;
  const auto add = [&](const std::filesystem::path& file) {
    environments.push_back(load_environment(file, {.projection = projection}));
    print_repairs(file, environments.back().report());
  };
  for (const std::filesystem::path& file : replayed.environments) {
    const bool first = environments.empty(), second = environments.size() == 1;
    add(first && !env.empty() ? env : second && !env_to.empty() ? env_to : file);
  }
  return environments;
}

void RelightCommand::run() const {
  check();

  // Read what comes in, and find out that what goes out has a place.
  std::optional<MotionRecording> replayed;
  if (!recording.empty()) replayed = load_motion_file(recording);
  const int frames = replayed ? static_cast<int>(replayed->frames.size()) : sequence.frames;
  const std::vector<int> saved = frames_to_save(frames);
  const Transport scene = Transport::open(transport);
  const std::string note = incomplete_note(scene.info().meta);
  if (!note.empty()) fmt::print(stderr, "{}: incomplete: {}\n", transport.string(), note);
  check_kind(scene);
  MotionRecording plain;
  plain.environments.push_back(env);
  if (!env_to.empty()) plain.environments.push_back(env_to);
  const std::vector<Environment> environments = load(replayed ? *replayed : plain);
  const Environment* second = environments.size() > 1 ? &environments[1] : nullptr;
  if (!folder.empty()) require_writable_folder(folder);
  std::optional<MetricsCsvWriter> table;
  if (!metrics.empty()) table.emplace(metrics);

  // Relight frame by frame. The exposure is chosen once, so that frames can be compared.
  ProgressPrinter progress("relight");
  double exposure = exposure_ev.value_or(0.0);
  const FrameDone frame_done = [&](const SequenceFrame& frame) {
    const int number = frame.metrics.frame;
    if (table) table->add(frame.metrics);
    if (number == 0 && !exposure_ev && !saved.empty()) {
      const bool dark =
          replayed ? replayed->frames.front().start != FrameStart::exact : sequence.from_dark;
      exposure = auto_exposure_ev(
          dark ? relight_picture_once(scene, frame.target, frame.view.camera, any_relighter())
               : frame.picture);
    }
    if (std::binary_search(saved.begin(), saved.end(), number)) {
      Image picture = frame.picture;
      if (no_background) {
        // The scene alone.
      } else if (replayed) {
        composite_light_background(frame.view,
                                   replayed->frames[static_cast<std::size_t>(number)].light,
                                   environments, picture);
      } else {
        composite_motion_background(frame.view, sequence.motion, number, environments.front(),
                                    second, picture);
      }
      save(frame, std::move(picture), exposure);
    }
    return progress((number + 1.0) / frames);
  };
  const RelighterFactory make = any_relighter(clusters);
  if (replayed) {
    relight_recording(scene, environments, *replayed, sequence.against_reference, frame_done, make,
                      sequence.judge_errors);
  } else {
    relight_sequence(scene, environments.front(), second, sequence, frame_done, make);
  }
  if (table) table->commit();
}

void RelightCommand::save(const SequenceFrame& frame, Image picture, double exposure) const {
  const std::filesystem::path stem = folder / fmt::format("frame_{:04}", frame.metrics.frame);
  for (const std::string& format : formats) {
    const std::filesystem::path file = stem.string() + "." + format;
    check_finite(picture, file.string());
    save_image(file, format == "png" ? tonemap(picture, {curve, exposure}) : picture);
  }
}

}  // namespace

Verb add_relight(CLI::App& verb) {
  auto command = std::make_shared<RelightCommand>();
  RelightCommand& c = *command;
  SequenceOptions& s = c.sequence;

  add_path(verb, "FILE", c.transport, "FILE.hlt", "transport file made by haarlight precompute")
      ->required();
  add_path(verb, "--env", c.env, "FILE",
           "environment: EXR or HDR, linear radiance; a recording names its own");
  add_path(verb, "--env-to", c.env_to, "FILE", "second environment, for --motion blend");
  add_choice<std::optional<Projection>>(verb, "--projection", c.projection,
                                        {{"auto", std::nullopt},
                                         {"latlong", Projection::latlong},
                                         {"angular", Projection::angular},
                                         {"vertical-cross", Projection::vertical_cross}},
                                        "layout of the environments; auto goes by shape: 2:1, 1:1, "
                                        "3:4");

  verb.add_option_function<std::string>(
          "--motion",
          [&c](const std::string& text) {
            check_choice(text);
            c.recording.clear();
            if (const auto kind = motion_from_name(text)) {
              c.sequence.motion.kind = *kind;
            } else {
              c.recording = text;
            }
          },
          "how the light moves: still, rotate, tumble, swing, blend, light, or as recorded by "
          "haarlight-view, with that recording's methods and budgets [rotate]")
      ->type_name("NAME|FILE.json")
      ->group("Motion");
  add_number(verb, "--degrees", s.motion.degrees, -kMaxDegrees, kMaxDegrees,
             "size of the motion, degrees")
      ->group("Motion");
  add_integer(verb, "--frames", s.frames, 1, kMaxFrames, "frames in the sequence")->group("Motion");
  add_integer(verb, "--stop", s.motion.stop, 1, kMaxFrames, "frame at which the light rests")
      ->group("Motion");
  add_number(verb, "--orbit", s.orbit_degrees, -kMaxDegrees, kMaxDegrees,
             "of a mesh: carry the camera round its middle, degrees")
      ->group("Motion");

  add_choice<LightingMethod>(verb, "--method", s.lighting.method,
                             {{"nwa", LightingMethod::nwa},
                              {"bi", LightingMethod::bi},
                              {"pbi", LightingMethod::pbi},
                              {"reference", LightingMethod::reference}},
                             "how updates are chosen; reference takes all")
      ->group("Method");
  add_integer(verb, "--wavelets", s.lighting.wavelets, 1, 6 * 1024 * 1024,
              "most wavelets changed in a frame")
      ->group("Method");
  CLI::Option* budget_ms =
      verb.add_option_function<std::string>(
              "--budget-ms",
              [&s](const std::string& text) {
                s.budget = {
                    BudgetKind::milliseconds,
                    parse_number("--budget-ms", text, kLeastMilliseconds, kMostMilliseconds)};
              },
              fmt::format("as many wavelets as keep a frame within so many milliseconds, {} to {}, "
                          "instead of --wavelets",
                          kLeastMilliseconds, kMostMilliseconds))
          ->type_name("T")
          ->excludes("--wavelets")
          ->group("Method");
  verb.add_option_function<std::string>(
          "--target-error",
          [&s](const std::string& text) {
            s.budget = {BudgetKind::error, parse_number("--target-error", text, kLeastError, 1)};
          },
          fmt::format("as few wavelets as keep the estimated relative error of the picture at or "
                      "below this, {} to 1, instead of --wavelets",
                      kLeastError))
      ->type_name("E")
      ->excludes("--wavelets")
      ->excludes(budget_ms)
      ->group("Method");
  add_choice<WaveletWeight>(verb, "--weight", s.weight,
                            {{"none", WaveletWeight::none},
                             {"area", WaveletWeight::area},
                             {"transport", WaveletWeight::transport}},
                            "what ranks wavelets, beside their change")
      ->group("Method");
  add_choice<BandChoice>(
      verb, "--bands", s.lighting.band_choice,
      {{"simple", BandChoice::simple}, {"exhaustive", BandChoice::exhaustive}},
      "how pbi finds the bands to reset: by a test of each, or by trying all 2^N")
      ->group("Method");
  verb.add_option_function<std::string>(
          "--basis-terms",
          [&c](const std::string& text) {
            c.basis_terms_asked = true;
            c.clusters.basis_terms = text == "all" ? -1
                                     : text == "quarter"
                                         ? 0
                                         : parse_integer("--basis-terms", text, 1, 65536);
          },
          "of a compressed transport: most vectors of a cluster that vertices follow in a frame "
          "[quarter]")
      ->type_name("quarter|all|N")
      ->group("Method");
  verb.add_flag("--from-dark", s.from_dark, "start with nothing shown; else frame 0 is exact")
      ->group("Method");

  add_path(verb, "-o,--output", c.folder, "DIR",
           "folder for frame_0000.exr, frame_0000.png, ...; made if missing")
      ->group("Output");
  CLI::Option* every = add_integer(verb, "--every", c.every, 1, kMaxFrames, "save every N-th frame")
                           ->group("Output");
  verb.add_option_function<std::string>(
          "--save-frames",
          [&c](const std::string& text) {
            parse_frames("--save-frames", text, kMaxFrames);
            c.save_frames = text;
          },
          "save these frames only, as 0,30,75")
      ->type_name("LIST")
      ->excludes(every)
      ->group("Output");
  verb.add_option_function<std::string>(
          "--formats",
          [&c](const std::string& text) { c.formats = parse_words("--formats", text, kFormats); },
          "exr (linear radiance), png (tonemapped), or both [exr,png]")
      ->type_name("LIST")
      ->group("Output");
  verb.add_option_function<std::string>(
          "--exposure",
          [&c](const std::string& text) {
            c.exposure_ev.reset();
            if (text == "auto") return;
            c.exposure_ev = parse_number("--exposure", text, -kMaxExposure, kMaxExposure);
          },
          fmt::format("of the PNGs: stops, {} to {}, or auto: chosen once, from the exact picture "
                      "of frame 0 [auto]",
                      -kMaxExposure, kMaxExposure))
      ->type_name("auto|EV")
      ->group("Output");
  add_choice<TonemapCurve>(verb, "--tonemap", c.curve,
                           {{"linear", TonemapCurve::linear},
                            {"reinhard", TonemapCurve::reinhard},
                            {"filmic", TonemapCurve::filmic}},
                           "curve of the PNGs")
      ->group("Output");
  verb.add_option_function<std::string>(
          "--size",
          [&s](const std::string& text) {
            std::tie(s.width, s.height) = parse_size("--size", text);
          },
          "of the pictures of a mesh, pixels, each 1 to 8192 [the file's]")
      ->type_name("WxH")
      ->group("Output");
  verb.add_flag("--no-background", c.no_background,
                "leave out the environment behind the scene, in EXR and PNG")
      ->group("Output");
  add_path(verb, "--metrics", c.metrics, "FILE.csv",
           "one row a frame; without -o no pictures are written")
      ->group("Output");
  verb.add_flag("--against-reference", s.against_reference,
                "also relight exactly, and fill the columns image_rel_rmse, image_max_abs and "
                "flicker")
      ->group("Output");
  verb.add_flag_function(
          "--no-estimate", [&s](std::int64_t) { s.judge_errors = false; },
          "leave error_estimate and error_bound empty, and take no time for them")
      ->group("Output");
  add_threads(verb)->group("Output");

  for (const char* name :
       {"--degrees", "--frames", "--stop", "--method", "--wavelets", "--weight", "--bands",
        "--from-dark", "--orbit", "--size", "--budget-ms", "--target-error"}) {
    c.said_by_recording.push_back(verb.get_option(name));
  }

  verb.footer(
      "\nMotions, t = min(frame, stop) / stop, D = --degrees: still; rotate: about +Y by D t^2;\n"
      "tumble: about +Y by 2 D t, then about +X by 1.6 D t^2; swing: about +Y by 0.4 D sin(4 pi "
      "t);\n"
      "blend: (1 - t) A + t B; light: a disc light carried once round over 2 % of A.\n"
      "--orbit carries a mesh's camera about +Y by its degrees times t, whatever the light does.\n"
      "A recording (FILE.json) says light, method, budget and weight of every frame itself.\n"
      "Metrics: frame, method, wavelets, weight, updates, resets (a digit a band, coarsest "
      "first),\n"
      "lighting_error (area-weighted L1, relative), image_rel_rmse and image_max_abs (against the\n"
      "exact picture, scene only), update_ms, apply_ms, finish_ms, total_ms, bytes (memory "
      "traffic),\n"
      "flicker (RMS of the change since the frame before against the exact picture's, relative),\n"
      "error_estimate and error_bound (of image_rel_rmse, from the lighting left out),\n"
      "transport_error (what the file's compression cost, measured when it was made).\n"
      "\nExamples:\n"
      "  haarlight relight bunny.hlt --env lobby.exr --method pbi --wavelets 30 \\\n"
      "      --metrics m.csv --against-reference -o out/bunny --every 10\n"
      "  haarlight relight bunny.hlt --env day.exr --env-to night.hdr --motion blend -o out/dusk\n"
      "  haarlight relight bunny.hlt --env lobby.exr --motion still --frames 1 -o out/one\n"
      "  haarlight relight mesh.hlt --env lobby.exr --motion still --orbit 360 -o out/round");
  return [command] { command->run(); };
}

}  // namespace haarlight
