// haarlight relight: a transport file under a moving environment, to pictures and metrics.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/option_parsers.h"
#include "apps/outputs.h"
#include "apps/progress_printer.h"
#include "apps/repairs.h"
#include "apps/verbs.h"
#include "core/image_io.h"
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
const std::vector<std::string> kFormats{"exr", "png"};

struct RelightCommand {
  std::filesystem::path transport, env, env_to, folder, metrics;
  std::optional<Projection> projection;
  SequenceOptions sequence;
  int every = 1;
  std::string save_frames;
  std::optional<double> exposure_ev;
  TonemapCurve curve = TonemapCurve::filmic;
  bool no_background = false;
  std::vector<std::string> formats = kFormats;

  void run() const;

 private:
  /// Options that are wrong only together.
  void check() const;
  std::vector<int> frames_to_save() const;
  void save(const Transport& scene, const Environment& from, const Environment* to,
            const SequenceFrame& frame, double exposure) const;
};

void RelightCommand::check() const {
  if (folder.empty() && metrics.empty()) {
    throw CLI::ValidationError("-o", "'', expected a folder for pictures, or --metrics FILE.csv");
  }
  if (sequence.motion.kind == MotionKind::blend && env_to.empty()) {
    throw CLI::ValidationError("--env-to",
                               "'', expected the environment to blend to, since "
                               "--motion is blend");
  }
  if (sequence.motion.kind != MotionKind::blend && !env_to.empty()) {
    refuse_option("--env-to", env_to.string(),
                  "no second environment, since --motion is " + motion_name(sequence.motion.kind));
  }
  if (folder.empty() && (!save_frames.empty() || every != 1)) {
    throw CLI::ValidationError("-o", "'', expected a folder for the frames to save");
  }
}

std::vector<int> RelightCommand::frames_to_save() const {
  if (folder.empty()) return {};
  if (!save_frames.empty()) return parse_frames("--save-frames", save_frames, sequence.frames - 1);
  std::vector<int> frames;
  for (int frame = 0; frame < sequence.frames; frame += every) frames.push_back(frame);
  return frames;
}

void RelightCommand::run() const {
  check();
  const std::vector<int> saved = frames_to_save();

  // Read what comes in, and find out that what goes out has a place.
  const Transport scene = Transport::open(transport);
  const EnvironmentOptions env_options{.projection = projection};
  const Environment from = load_environment(env, env_options);
  print_repairs(env, from.report());
  std::optional<Environment> to;
  if (!env_to.empty()) {
    to.emplace(load_environment(env_to, env_options));
    print_repairs(env_to, to->report());
  }
  const Environment* second = to ? &*to : nullptr;
  if (!folder.empty()) require_writable_folder(folder);
  std::optional<MetricsCsvWriter> table;
  if (!metrics.empty()) table.emplace(metrics);

  // Relight frame by frame. The exposure is chosen once, so that frames can be compared.
  ProgressPrinter progress("relight");
  double exposure = exposure_ev.value_or(0.0);
  relight_sequence(scene, from, second, sequence, [&](const SequenceFrame& frame) {
    if (table) table->add(frame.metrics);
    if (frame.metrics.frame == 0 && !exposure_ev && !saved.empty()) {
      exposure =
          auto_exposure_ev(sequence.from_dark ? relight_once(scene, frame.target) : frame.picture);
    }
    if (std::binary_search(saved.begin(), saved.end(), frame.metrics.frame)) {
      save(scene, from, second, frame, exposure);
    }
    return progress((frame.metrics.frame + 1.0) / sequence.frames);
  });
  if (table) table->commit();
}

void RelightCommand::save(const Transport& scene, const Environment& from, const Environment* to,
                          const SequenceFrame& frame, double exposure) const {
  Image picture = frame.picture;
  if (!no_background) {
    composite_motion_background(scene, sequence.motion, frame.metrics.frame, from, to, picture);
  }
  const std::filesystem::path stem = folder / fmt::format("frame_{:04}", frame.metrics.frame);
  for (const std::string& format : formats) {
    const std::filesystem::path file = stem.string() + "." + format;
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
  add_path(verb, "--env", c.env, "FILE", "environment: EXR or HDR, linear radiance")->required();
  add_path(verb, "--env-to", c.env_to, "FILE", "second environment, for --motion blend");
  add_choice<std::optional<Projection>>(verb, "--projection", c.projection,
                                        {{"auto", std::nullopt},
                                         {"latlong", Projection::latlong},
                                         {"angular", Projection::angular},
                                         {"vertical-cross", Projection::vertical_cross}},
                                        "layout of the environments; auto goes by shape: 2:1, 1:1, "
                                        "3:4");

  add_choice<MotionKind>(verb, "--motion", s.motion.kind,
                         {{"still", MotionKind::still},
                          {"rotate", MotionKind::rotate},
                          {"tumble", MotionKind::tumble},
                          {"swing", MotionKind::swing},
                          {"blend", MotionKind::blend},
                          {"light", MotionKind::light}},
                         "how the light moves")
      ->group("Motion");
  add_number(verb, "--degrees", s.motion.degrees, -kMaxDegrees, kMaxDegrees,
             "size of the motion, degrees")
      ->group("Motion");
  add_integer(verb, "--frames", s.frames, 1, kMaxFrames, "frames in the sequence")->group("Motion");
  add_integer(verb, "--stop", s.motion.stop, 1, kMaxFrames, "frame at which the light rests")
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
  verb.add_flag("--no-background", c.no_background,
                "leave out the environment behind the scene, in EXR and PNG")
      ->group("Output");
  add_path(verb, "--metrics", c.metrics, "FILE.csv",
           "one row a frame; without -o no pictures are written")
      ->group("Output");
  verb.add_flag("--against-reference", s.against_reference,
                "also relight exactly, and fill the columns image_rel_rmse and image_max_abs")
      ->group("Output");
  add_threads(verb)->group("Output");

  verb.footer(
      "\nMotions, t = min(frame, stop) / stop, D = --degrees: still; rotate: about +Y by D t^2;\n"
      "tumble: about +Y by 2 D t, then about +X by 1.6 D t^2; swing: about +Y by 0.4 D sin(4 pi "
      "t);\n"
      "blend: (1 - t) A + t B; light: a disc light carried once round over 2 % of A.\n"
      "Metrics: frame, method, wavelets, weight, updates, resets (a digit a band, coarsest "
      "first),\n"
      "lighting_error (area-weighted L1, relative), image_rel_rmse and image_max_abs (against the\n"
      "exact picture, scene only), update_ms, apply_ms, finish_ms, total_ms, bytes (memory "
      "traffic).\n"
      "\nExamples:\n"
      "  haarlight relight bunny.hlt --env lobby.exr --method pbi --wavelets 30 \\\n"
      "      --metrics m.csv --against-reference -o out/bunny --every 10\n"
      "  haarlight relight bunny.hlt --env day.exr --env-to night.hdr --motion blend -o out/dusk\n"
      "  haarlight relight bunny.hlt --env lobby.exr --motion still --frames 1 -o out/one");
  return [command] { command->run(); };
}

}  // namespace haarlight
