// haarlight-study: numbers for bench/curves.py that `haarlight relight` does not print.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "bench/study.h"
#include "core/error.h"

int main(int argc, char** argv) {
  using namespace haarlight;
  CLI::App app{"Numbers for bench/curves.py: see bench/study.h."};
  app.require_subcommand(1);
  bench::StudyOptions options;
  std::string motion = "rotate", method = "pbi", weight = "area", bands = "simple", transport;
  std::string folder;
  std::vector<int> frames;
  int face = 64;
  ShOptions sh;
  LightingOptions lighting;
  const auto common = [&](CLI::App* verb) {
    verb->add_option("--env", options.env)->required();
    verb->add_option("--env-to", options.env_to);
    verb->add_option("--motion", motion);
    verb->add_option("--degrees", options.motion.degrees);
    verb->add_option("--stop", options.motion.stop);
    verb->add_option("--frames", options.frames);
    verb->add_option("-o", options.output, "CSV")->required();
    return verb;
  };
  CLI::App* sh_verb = common(app.add_subcommand("sh", "relight by spherical harmonics"));
  sh_verb->add_option("FILE", transport)->required();
  sh_verb->add_option("--order", sh.order);
  sh_verb->add_option("--terms", sh.terms, "incremental, so many functions a frame");
  sh_verb->add_option("--folder", folder);
  sh_verb->add_option("--save-frames", frames)->delimiter(',');
  CLI::App* chosen = common(app.add_subcommand("chosen", "which wavelets are chosen"));
  chosen->add_option("--face", face);
  chosen->add_option("--method", method);
  chosen->add_option("--wavelets", lighting.wavelets);
  chosen->add_option("--bands", bands)->check(CLI::IsMember({"simple", "exhaustive"}));
  chosen->add_option("--map-frames", frames)->delimiter(',');
  CLI::App* energy = common(app.add_subcommand("energy", "energy by spatial and temporal band"));
  energy->add_option("--face", face);
  CLI::App* budget = common(app.add_subcommand("budget", "frames under a budget in time"));
  double milliseconds = 4;
  budget->add_option("FILE", transport)->required();
  budget->add_option("--ms", milliseconds);
  CLI::App* bits_verb = common(app.add_subcommand("bits", "a transport at fewer bits an entry"));
  int bits = 6;
  bits_verb->add_option("FILE", transport)->required();
  bits_verb->add_option("--bits", bits);
  CLI::App* norms = common(app.add_subcommand("norms", "bounds by norms over groups of rows"));
  norms->add_option("FILE", transport)->required();
  CLI11_PARSE(app, argc, argv);
  try {
    const auto kind = motion_from_name(motion);
    const auto lighting_method = lighting_method_from_name(method);
    if (!kind || !lighting_method) {
      throw Error(ErrorKind::invalid_argument,
                  fmt::format("{} under {}: no such method or motion", method, motion));
    }
    options.motion.kind = *kind;
    lighting.method = *lighting_method;
    lighting.band_choice = bands == "simple" ? BandChoice::simple : BandChoice::exhaustive;
    if (*sh_verb) {
      sh.incremental = sh_verb->count("--terms") > 0;
      bench::study_sh(options, transport, sh, folder, frames);
    } else if (*chosen) {
      bench::study_chosen(options, face, lighting, frames);
    } else if (*energy) {
      bench::study_energy(options, face);
    } else if (*budget) {
      bench::study_budget(options, transport, milliseconds);
    } else if (*bits_verb) {
      bench::study_bits(options, transport, bits);
    } else if (*norms) {
      bench::study_norms(options, transport);
    }
  } catch (const Error& error) {
    fmt::print(stderr, "haarlight-study: {}\n", error.what());
    return 1;
  }
  return 0;
}
