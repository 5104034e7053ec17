// haarlight-bench: kernels and whole frames, measured against what the machine can do.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "bench/inputs.h"
#include "bench/summary.h"
#include "core/error.h"
#include "core/parallel.h"
#include "precompute/scene_import.h"
#include "prt/apply_kernel.h"
#include "prt/motion.h"

namespace haarlight::bench {

void expect_repeated(benchmark::State& state, const RowSums& sums, const RowSums& once) {
  const auto times = static_cast<double>(state.iterations());
  for (std::size_t i = 0; i < sums.totals().size(); ++i) {
    if (std::abs(sums.totals()[i] - times * once.totals()[i]) > 1e-9 * times) {
      state.SkipWithError("the sums are not those of the columns");
      return;
    }
  }
}

Inputs& inputs() {
  static Inputs all;
  return all;
}

namespace {

int run(const std::string& transport, const std::string& environment, const std::string& scene) {
  Inputs& in = inputs();
  register_memory();
  register_kernels();
  register_cpca_kernels();
  if (!transport.empty()) {
    in.transport = Transport::open(transport);
    const Environment light = load_environment(environment);
    Motion motion({}, in.transport->layout(), light);
    for (int frame = 0; frame < 100; ++frame) {
      const auto target = motion.coefficients(frame);
      in.targets.emplace_back(target.begin(), target.end());
    }
    fmt::print("transport {}: {}x{}, {:.1f} MiB of columns; {} kernel\n", transport,
               in.transport->width(), in.transport->height(),
               static_cast<double>(in.transport->chunk_bytes()) / 1048576, apply_kernel_name());
    register_decide();
    register_relight();
    register_accumulate();
  }
  if (!scene.empty()) {
    in.scene = import_scene(scene);
    register_rays();
  }
  if (!in.light_scene.empty()) {
    fmt::print("full light: {}, {}x{} pixels, faces of {}x{}\n", in.light_scene, in.light_size,
               in.light_size, in.light_face, in.light_face);
    register_full_light();
  }
  fmt::print("{} threads\n", thread_count());
  Collector collector;
  benchmark::RunSpecifiedBenchmarks(&collector);
  collector.print_summary();
  return 0;
}

}  // namespace
}  // namespace haarlight::bench

int main(int argc, char** argv) {
  // Seven repetitions and their median, unless the command line says otherwise (it comes later).
  std::vector<std::string> defaults{argv[0], "--benchmark_repetitions=7",
                                    "--benchmark_report_aggregates_only=true",
                                    "--benchmark_min_time=0.2"};
  std::vector<char*> arguments;
  for (std::string& text : defaults) arguments.push_back(text.data());
  for (int i = 1; i < argc; ++i) arguments.push_back(argv[i]);
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());

  CLI::App app{
      "Measures relighting and ray tracing, and prints ratios to the machine's own limits.\n"
      "All --benchmark_* flags of Google Benchmark work; --benchmark_filter=REGEX picks cases:\n"
      "memory.read, machine.gaps, haar.*, topk.*, apply.grey.*, apply.rgb.*, finish.*, sh.*, "
      "judge, raster.*, "
      "cpca.*, "
      "decide.*, apply.*, frame.*, sums.* (with --transport), rays.* (with --scene), "
      "light.*, "
      "run.*"};
  std::string transport, environment, scene;
  CLI::Option* file = app.add_option("--transport", transport,
                                     "transport file (.hlt); without it relighting is left out");
  CLI::Option* light = app.add_option("--env", environment, "environment, turned by `rotate`");
  file->needs(light);
  light->needs(file);
  app.add_option("--scene", scene, "scene for the ray cases; without it they are left out");
  haarlight::bench::Inputs& in = haarlight::bench::inputs();
  in.light_scene = "cornell", in.light_size = 64, in.light_face = 64;
  app.add_option("--light-scene", in.light_scene,
                 "scene of haarlight-data for full light transport; empty: left out")
      ->capture_default_str();
  app.add_option("--light-size", in.light_size, "pixels along its picture")
      ->capture_default_str()
      ->check(CLI::Range(8, 4096));
  app.add_option("--light-face", in.light_face, "texels along a face of its lighting")
      ->capture_default_str()
      ->check(CLI::IsMember({4, 8, 16, 32, 64, 128, 256}));
  CLI11_PARSE(app, count, arguments.data());
  try {
    return haarlight::bench::run(transport, environment, scene);
  } catch (const haarlight::Error& error) {
    fmt::print(stderr, "haarlight-bench: {}\n", error.what());
    return 1;
  }
}
