// What sums in double cost beside sums in float: the same columns, the same loop over chunks, the
// same pixels at the end; the sums alone differ. The float kernel is the library's with 8 rows a
// register instead of 4.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "bench/inputs.h"
#include "core/huge_page_vector.h"
#include "core/parallel.h"
#include "prt/apply_kernel.h"
#include "prt/lighting_tracker.h"

namespace haarlight::bench {
namespace {

#if defined(__x86_64__)
#define HAARLIGHT_AVX2 __attribute__((target("avx2,fma")))

constexpr std::size_t kBatch = 64;

void transpose_bits(std::uint64_t* m) {
  std::uint64_t mask = 0x00000000ffffffffull;
  for (unsigned width = 32; width != 0; width >>= 1, mask ^= mask << width) {
    for (unsigned k = 0; k < 64; k = (k + width + 1) & ~width) {
      const std::uint64_t swapped = (m[k] >> width ^ m[k + width]) & mask;
      m[k] ^= swapped << width;
      m[k + width] ^= swapped;
    }
  }
}

float scale_of(std::uint16_t bits) {
  return std::bit_cast<float>(static_cast<std::uint32_t>(bits) << 16);
}

struct Cursors {
  const std::uint16_t* scales[kBatch];
  const std::int8_t* values[kBatch];
};

HAARLIGHT_AVX2 inline __m256 eight_rows(const std::int8_t* q) {
  return _mm256_cvtepi32_ps(
      _mm256_cvtepi8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(q))));
}

HAARLIGHT_AVX2 void add_block(std::uint64_t columns, const ColumnTask* tasks, Cursors& at, bool rgb,
                              float* totals) {
  __m256 sum[6];
  for (int i = 0; i < 6; ++i) sum[i] = _mm256_loadu_ps(totals + 8 * i);
  const int stride = rgb ? 1 : 0;
  for (; columns; columns &= columns - 1) {
    const auto t = static_cast<std::size_t>(std::countr_zero(columns));
    const std::int8_t* q = at.values[t];
    const std::uint16_t* scales = at.scales[t];
    at.values[t] += rgb ? 48 : 16;
    at.scales[t] += rgb ? 3 : 1;
    _mm_prefetch(reinterpret_cast<const char*>(q + 256), _MM_HINT_T0);
#pragma GCC unroll 3
    for (int ch = 0; ch < 3; ++ch) {
      const __m256 factor =
          _mm256_set1_ps(scale_of(scales[ch * stride]) * static_cast<float>(tasks[t].delta[ch]));
      const std::int8_t* rows = q + 16 * ch * stride;
      sum[2 * ch] = _mm256_fmadd_ps(eight_rows(rows), factor, sum[2 * ch]);
      sum[2 * ch + 1] = _mm256_fmadd_ps(eight_rows(rows + 8), factor, sum[2 * ch + 1]);
    }
  }
  for (int i = 0; i < 6; ++i) _mm256_storeu_ps(totals + 8 * i, sum[i]);
}

void add_columns(const std::uint64_t* rgb_blocks, std::span<const ColumnTask> tasks,
                 float* totals) {
  for (std::size_t first = 0; first < tasks.size(); first += kBatch) {
    const std::size_t count = std::min(kBatch, tasks.size() - first);
    const ColumnTask* batch = tasks.data() + first;
    Cursors at;
    for (std::size_t t = 0; t < count; ++t) {
      at.scales[t] = batch[t].blocks.scales;
      at.values[t] = batch[t].blocks.values;
    }
    for (std::size_t word = 0; word < 4; ++word) {
      std::uint64_t columns_of[64] = {};
      for (std::size_t t = 0; t < count; ++t) columns_of[t] = batch[t].blocks.present[word];
      transpose_bits(columns_of);
      for (std::size_t bit = 0; bit < 64; ++bit) {
        if (columns_of[bit] == 0) continue;
        add_block(columns_of[bit], batch, at, rgb_blocks[word] >> bit & 1,
                  totals + (64 * word + bit) * kBlockTotals);
      }
    }
  }
}

void add_columns(const std::uint64_t* rgb_blocks, std::span<const ColumnTask> tasks,
                 double* totals) {
  apply_columns(rgb_blocks, tasks, totals);
}

// A frame's columns into sums of either kind, chunk by chunk, and the chunk's pixels.
template <typename Sum>
void stream(const Transport& transport, std::span<const WaveletDelta> columns,
            HugePageVector<Sum>& sums, std::vector<Rgb>& pixels) {
  parallel_for(transport.chunk_count(), [&](int chunk) {
    thread_local std::vector<ColumnTask> tasks;
    tasks.clear();
    for (const WaveletDelta& column : columns) {
      const ColumnBlocks blocks = transport.column(chunk, column.index);
      if (!blocks.present) continue;
      tasks.push_back({blocks, {column.delta.r, column.delta.g, column.delta.b}});
      const auto* bytes = reinterpret_cast<const char*>(blocks.present);
      for (std::uint32_t at = 0; at < blocks.bytes && columns.size() <= 512; at += 64) {
        __builtin_prefetch(bytes + at, 0, 2);
      }
    }
    if (tasks.empty()) return;
    Sum* chunk_sums = sums.data() + static_cast<std::size_t>(chunk) * kChunkTotals;
    add_columns(transport.rgb_blocks(chunk), tasks, chunk_sums);
    const std::size_t first_row = static_cast<std::size_t>(chunk) * kChunkRows;
    for (std::size_t row = 0; row < static_cast<std::size_t>(kChunkRows); ++row) {
      const std::uint32_t output = transport.row_output()[first_row + row];
      if (output == kNoOutput) continue;
      const Sum* sum = chunk_sums + row / kBlockRows * kBlockTotals + row % kBlockRows;
      const Rgb& color = transport.row_color()[first_row + row];
      pixels[output] = {static_cast<float>(sum[0]) * color.r,
                        static_cast<float>(sum[kBlockRows]) * color.g,
                        static_cast<float>(sum[2 * kBlockRows]) * color.b};
    }
  });
}

// BI at `wavelets` a frame over the moving frames: decided beforehand. The error is that of the
// sums after all frames of one iteration, relative to the largest, against double.
template <typename Sum>
void accumulate(benchmark::State& state, int wavelets) {
  const auto& targets = inputs().targets;
  const Transport& transport = *inputs().transport;
  LightingOptions options;
  options.method = LightingMethod::bi;
  options.wavelets = wavelets;
  LightingTracker tracker(transport.layout(), options);
  const LightingUpdate first = tracker.start_exact(targets[0]);
  std::vector<LightingUpdate> updates;
  for (std::size_t f = 1; f < targets.size(); ++f) updates.push_back(tracker.advance(targets[f]));
  HugePageVector<Sum> sums;
  const std::size_t size = static_cast<std::size_t>(transport.chunk_count()) * kChunkTotals;
  sums.resize(size);
  std::vector<Rgb> pixels(transport.info().output_count());
  for (auto _ : state) {
    state.PauseTiming();
    std::fill(sums.begin(), sums.end(), Sum(0));
    stream(transport, first.deltas, sums, pixels);
    state.ResumeTiming();
    for (const LightingUpdate& update : updates) stream(transport, update.deltas, sums, pixels);
  }
  HugePageVector<double> exact;
  exact.resize(size);
  stream(transport, first.deltas, exact, pixels);
  for (const LightingUpdate& update : updates) stream(transport, update.deltas, exact, pixels);
  double error = 0, largest = 0;
  for (std::size_t i = 0; i < size; ++i) {
    error = std::max(error, std::abs(static_cast<double>(sums[i]) - exact[i]));
    largest = std::max(largest, std::abs(exact[i]));
  }
  if (!(error <= 1e-3 * largest)) state.SkipWithError("the sums are not those of the columns");
  state.counters["drift"] = error / largest;
  state.counters["ms_per_frame"] = benchmark::Counter(
      1e-3 * static_cast<double>(state.iterations()) * static_cast<double>(updates.size()),
      benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
#endif

}  // namespace

void register_accumulate() {
#if defined(__x86_64__)
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) return;
  const auto add = [](const std::string& name, auto function, int k) {
    benchmark::RegisterBenchmark(name.c_str(), function, k)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  };
  for (const int k : {30, 100}) {
    add("sums.double.k" + std::to_string(k), accumulate<double>, k);
    add("sums.float.k" + std::to_string(k), accumulate<float>, k);
  }
#endif
}

}  // namespace haarlight::bench
