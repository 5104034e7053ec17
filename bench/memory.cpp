// How fast this machine reads: the limit that relighting is held against.

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <vector>

#include "bench/inputs.h"
#include "core/parallel.h"
#include "core/simd.h"

namespace haarlight::bench {
namespace {

HAARLIGHT_MULTIVERSION std::uint64_t add_up(const std::uint64_t* words, std::size_t count) {
  std::uint64_t lane[16] = {};
  for (std::size_t i = 0; i + 16 <= count; i += 16) {
    for (std::size_t k = 0; k < 16; ++k) lane[k] += words[i + k];
  }
  std::uint64_t sum = 0;
  for (std::uint64_t l : lane) sum += l;
  return sum;
}

// A plain streaming read of 1 GiB, far more than any cache, on all threads.
void read(benchmark::State& state) {
  const std::size_t words = std::size_t{1} << 27;
  std::vector<std::uint64_t> data(words, 1);
  const int parts = 256;
  std::vector<std::uint64_t> sums(parts);
  for (auto _ : state) {
    parallel_for(parts, [&](int i) {
      const std::size_t size = words / parts;
      sums[static_cast<std::size_t>(i)] =
          add_up(data.data() + static_cast<std::size_t>(i) * size, size);
    });
    benchmark::DoNotOptimize(sums.data());
  }
  std::uint64_t sum = 0;
  for (std::uint64_t s : sums) sum += s;
  if (sum != words) state.SkipWithError("the sum is wrong");
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(words * 8));
}

// Threads that do nothing but read the clock, for 0.2 s: what lies between two readings was taken
// away, by the system or whatever else the machine is busy with.
void gaps(benchmark::State& state) {
  using Clock = std::chrono::steady_clock;
  const auto ms = [](Clock::duration d) {
    return std::chrono::duration<double, std::milli>(d).count();
  };
  const int threads = thread_count();
  // Of frames of these milliseconds, gaps of more than a tenth.
  constexpr std::array<double, 3> kFrames{2, 4, 8};
  std::vector<double> lost(static_cast<std::size_t>(threads)), spun(lost.size());
  std::vector<std::array<double, kFrames.size()>> long_ones(lost.size());
  for (auto _ : state) {
    parallel_for(threads, [&](int i) {
      const auto k = static_cast<std::size_t>(i);
      const Clock::time_point begin = Clock::now();
      Clock::time_point last = begin;
      while (ms(last - begin) < 200) {
        const Clock::time_point now = Clock::now();
        const double gap = ms(now - last);
        if (gap > 0.1) lost[k] += gap;
        for (std::size_t f = 0; f < kFrames.size(); ++f) long_ones[k][f] += gap > 0.1 * kFrames[f];
        last = now;
      }
      spun[k] += ms(last - begin);
    });
  }
  double all_lost = 0, all = 0;
  for (std::size_t k = 0; k < lost.size(); ++k) all_lost += lost[k], all += spun[k];
  if (!(all >= 200.0 * static_cast<double>(threads))) state.SkipWithError("it did not spin");
  state.counters["lost_percent"] = 100 * all_lost / all;
  // Of a frame on all threads, the chance that some thread loses a tenth of it at once.
  for (std::size_t f = 0; f < kFrames.size(); ++f) {
    double all_long = 0;
    for (const auto& of_thread : long_ones) all_long += of_thread[f];
    state.counters[fmt::format("hit_percent_{:g}ms", kFrames[f])] =
        100 * all_long * kFrames[f] * threads / all;
  }
}

}  // namespace

void register_memory() {
  benchmark::RegisterBenchmark("machine.gaps", gaps)->Unit(benchmark::kMillisecond)->UseRealTime();
  benchmark::RegisterBenchmark("memory.read", read)->Unit(benchmark::kMillisecond)->UseRealTime();
}

}  // namespace haarlight::bench
