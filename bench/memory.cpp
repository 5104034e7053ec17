// How fast this machine reads: the limit that relighting is held against.

#include <benchmark/benchmark.h>

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

}  // namespace

void register_memory() {
  benchmark::RegisterBenchmark("memory.read", read)->Unit(benchmark::kMillisecond)->UseRealTime();
}

}  // namespace haarlight::bench
