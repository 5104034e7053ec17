// Eight vertices at a time over all tasks: their 24 sums stay in registers meanwhile.

#include "cpca/weight_kernel.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace haarlight {
namespace {

#if defined(__x86_64__)
__attribute__((target("avx2,fma"))) void add_weights_avx2(std::span<const WeightTask> tasks,
                                                          std::size_t vertices, double* sums) {
  for (std::size_t v = 0; v < vertices; v += kWeightLanes) {
    double* r = sums + v;
    double* g = r + vertices;
    double* b = g + vertices;
    __m256d r0 = _mm256_loadu_pd(r), r1 = _mm256_loadu_pd(r + 4);
    __m256d g0 = _mm256_loadu_pd(g), g1 = _mm256_loadu_pd(g + 4);
    __m256d b0 = _mm256_loadu_pd(b), b1 = _mm256_loadu_pd(b + 4);
    for (const WeightTask& task : tasks) {
      const __m256i wide = _mm256_cvtepi16_epi32(
          _mm_loadu_si128(reinterpret_cast<const __m128i*>(task.weights + v)));
      const __m256d low = _mm256_cvtepi32_pd(_mm256_castsi256_si128(wide));
      const __m256d high = _mm256_cvtepi32_pd(_mm256_extracti128_si256(wide, 1));
      const __m256d fr = _mm256_broadcast_sd(task.factor);
      const __m256d fg = _mm256_broadcast_sd(task.factor + 1);
      const __m256d fb = _mm256_broadcast_sd(task.factor + 2);
      r0 = _mm256_fmadd_pd(low, fr, r0);
      r1 = _mm256_fmadd_pd(high, fr, r1);
      g0 = _mm256_fmadd_pd(low, fg, g0);
      g1 = _mm256_fmadd_pd(high, fg, g1);
      b0 = _mm256_fmadd_pd(low, fb, b0);
      b1 = _mm256_fmadd_pd(high, fb, b1);
    }
    _mm256_storeu_pd(r, r0);
    _mm256_storeu_pd(r + 4, r1);
    _mm256_storeu_pd(g, g0);
    _mm256_storeu_pd(g + 4, g1);
    _mm256_storeu_pd(b, b0);
    _mm256_storeu_pd(b + 4, b1);
  }
}
#endif

using Kernel = void (*)(std::span<const WeightTask>, std::size_t, double*);

Kernel pick() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return add_weights_avx2;
#endif
  return add_weights_portable;
}

}  // namespace

void add_weights_portable(std::span<const WeightTask> tasks, std::size_t vertices, double* sums) {
  for (std::size_t v = 0; v < vertices; v += kWeightLanes) {
    for (const WeightTask& task : tasks) {
      for (std::size_t ch = 0; ch < 3; ++ch) {
        double* sum = sums + ch * vertices + v;
        for (std::size_t l = 0; l < kWeightLanes; ++l) {
          sum[l] += task.factor[ch] * static_cast<double>(task.weights[v + l]);
        }
      }
    }
  }
}

void add_weights(std::span<const WeightTask> tasks, std::size_t vertices, double* sums) {
  static const Kernel kernel = pick();
  kernel(tasks, vertices, sums);
}

}  // namespace haarlight
