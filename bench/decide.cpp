// Deciding updates: which wavelets change, without any picture.

#include <benchmark/benchmark.h>

#include <string>

#include "bench/inputs.h"
#include "prt/lighting_tracker.h"

namespace haarlight::bench {
namespace {

// One iteration is the 99 moving frames of `rotate`.
void decide(benchmark::State& state, const LightingOptions& options) {
  const auto& targets = inputs().targets;
  const HaarLayout layout = inputs().transport->layout();
  LightingTracker tracker(layout, options);
  std::size_t deltas = 0, frames = 0;
  for (auto _ : state) {
    state.PauseTiming();
    tracker.start_exact(targets[0]);
    state.ResumeTiming();
    for (std::size_t frame = 1; frame < targets.size(); ++frame) {
      deltas += tracker.advance(targets[frame]).deltas.size();
      ++frames;
    }
  }
  if (deltas > frames * static_cast<std::size_t>(options.wavelets)) {
    state.SkipWithError("an update is over its budget");
  }
  state.counters["ms_per_frame"] =
      benchmark::Counter(1e-3 * static_cast<double>(frames),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

}  // namespace

void register_decide() {
  const auto add = [](const std::string& name, LightingMethod method, BandChoice choice, int k) {
    LightingOptions options;
    options.method = method;
    options.band_choice = choice;
    options.wavelets = k;
    benchmark::RegisterBenchmark(name.c_str(), decide, options)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  };
  add("decide.nwa.k30", LightingMethod::nwa, BandChoice::simple, 30);
  add("decide.bi.k30", LightingMethod::bi, BandChoice::simple, 30);
  add("decide.pbi.k30", LightingMethod::pbi, BandChoice::simple, 30);
  add("decide.pbi.k300", LightingMethod::pbi, BandChoice::simple, 300);
  add("decide.pbi_exhaustive.k30", LightingMethod::pbi, BandChoice::exhaustive, 30);
}

}  // namespace haarlight::bench
