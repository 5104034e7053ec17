// Applying updates to a transport, and whole frames.

#include <benchmark/benchmark.h>

#include <cmath>
#include <string>
#include <vector>

#include "bench/inputs.h"
#include "core/image_metrics.h"
#include "prt/image_relighter.h"
#include "prt/lighting_tracker.h"

namespace haarlight::bench {
namespace {

LightingOptions options_of(LightingMethod method, int wavelets) {
  LightingOptions options;
  options.method = method;
  options.wavelets = wavelets;
  return options;
}

bool resets_bands(LightingMethod method) { return method == LightingMethod::pbi; }

// The relighter's picture against T * shown in one call: both round to float, and the running sums
// have rounded in double a few thousand times.
void verify(benchmark::State& state, const ImageRelighter& relighter,
            const LightingTracker& tracker) {
  const Image right = relight_once(relighter.transport(), tracker.shown());
  if (compare_images(relighter.picture(), right).relative_rmse > 1e-6) {
    state.SkipWithError("the picture is not T * shown");
  }
}

// Streaming alone: the updates of the 99 moving frames are decided beforehand and applied without
// finishing pixels. The bytes are those asked for: columns of T, and sums read and written.
void apply(benchmark::State& state, LightingMethod method, int wavelets) {
  const auto& targets = inputs().targets;
  const Transport& transport = *inputs().transport;
  LightingTracker tracker(transport.layout(), options_of(method, wavelets));
  const LightingUpdate first = tracker.start_exact(targets[0]);
  std::vector<LightingUpdate> updates;
  const std::size_t frames = method == LightingMethod::reference
                                 ? std::min<std::size_t>(targets.size(), 6)
                                 : targets.size();
  for (std::size_t f = 1; f < frames; ++f) updates.push_back(tracker.advance(targets[f]));
  RowSums sums(transport);
  sums.expect_resets(resets_bands(method));
  double transport_bytes = 0, sum_bytes = 0;
  for (auto _ : state) {
    state.PauseTiming();
    sums.apply(first);
    state.ResumeTiming();
    for (const LightingUpdate& update : updates) {
      const ApplyStats stats = sums.apply(update);
      transport_bytes += static_cast<double>(stats.transport_bytes);
      sum_bytes += static_cast<double>(stats.sum_bytes);
    }
  }
  const auto applied =
      static_cast<double>(state.iterations()) * static_cast<double>(updates.size());
  using benchmark::Counter;
  state.counters["bytes_per_second"] = Counter(transport_bytes + sum_bytes, Counter::kIsRate);
  state.counters["transport_bytes_per_second"] = Counter(transport_bytes, Counter::kIsRate);
  state.counters["MB_per_frame"] = (transport_bytes + sum_bytes) / applied / 1e6;
  state.counters["ms_per_frame"] = Counter(1e-3 * applied, Counter::kIsRate | Counter::kInvert);
}

// Decide, apply and finish: what a viewer pays for a frame.
void frame(benchmark::State& state, LightingMethod method, int wavelets) {
  const auto& targets = inputs().targets;
  const Transport& transport = *inputs().transport;
  ImageRelighter relighter(transport);
  relighter.expect_resets(resets_bands(method));
  LightingTracker tracker(transport.layout(), options_of(method, wavelets));
  double frames = 0, error = 0;
  for (auto _ : state) {
    state.PauseTiming();
    relighter.apply(tracker.start_exact(targets[0]));
    state.ResumeTiming();
    for (std::size_t f = 1; f < targets.size(); ++f) {
      relighter.apply(tracker.advance(targets[f]));
      ++frames;
    }
  }
  verify(state, relighter, tracker);
  tracker.start_exact(targets[0]);
  for (std::size_t f = 1; f < targets.size(); ++f) {
    tracker.advance(targets[f]);
    error += lighting_error(transport.layout(), tracker.shown(), targets[f]);
  }
  using benchmark::Counter;
  state.counters["ms_per_frame"] = Counter(1e-3 * frames, Counter::kIsRate | Counter::kInvert);
  state.counters["lighting_error"] = error / static_cast<double>(targets.size() - 1);
  state.counters["extra_bytes"] = static_cast<double>(relighter.extra_bytes());
  state.counters["transport_file_bytes"] = static_cast<double>(transport.chunk_bytes());
}

}  // namespace

void register_relight() {
  const auto add = [](const std::string& name, auto function, LightingMethod method, int k) {
    benchmark::RegisterBenchmark(name.c_str(), function, method, k)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  };
  add("apply.nwa.k30", apply, LightingMethod::nwa, 30);
  add("apply.bi.k30", apply, LightingMethod::bi, 30);
  add("apply.pbi.k30", apply, LightingMethod::pbi, 30);
  add("apply.reference", apply, LightingMethod::reference, 1);
  for (const int k : {10, 20, 30, 60, 100, 300}) {
    add("frame.nwa.k" + std::to_string(k), frame, LightingMethod::nwa, k);
    add("frame.pbi.k" + std::to_string(k), frame, LightingMethod::pbi, k);
  }
  add("frame.bi.k30", frame, LightingMethod::bi, 30);
  add("frame.bi.k100", frame, LightingMethod::bi, 100);
}

}  // namespace haarlight::bench
