// Equation 4 for many points.

#include "caching/record_blocks.h"

#include <algorithm>
#include <cmath>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace haarlight {
namespace {

// At the record itself the weight has no end; at its edge it is not quite nothing, so that a point
// that only one reaches has light.
constexpr float kLeastDistance = 1e-6f, kLeastWeight = 1e-9f;

// Lanes are added in one order.
float total(const float* lane) {
  return ((lane[0] + lane[4]) + (lane[2] + lane[6])) + ((lane[1] + lane[5]) + (lane[3] + lane[7]));
}

#if defined(__x86_64__)
// Without fma: so are the sums of the portable version.
__attribute__((target("avx2"))) void add_records_avx2(std::span<const RecordBlock* const> blocks,
                                                      std::span<const WeightedPoint> points,
                                                      const RecordReach& reach,
                                                      std::uint8_t* used) {
  const __m256 far = _mm256_set1_ps(reach.far), near = _mm256_set1_ps(reach.near);
  const __m256 less = _mm256_set1_ps(reach.least), one = _mm256_set1_ps(1);
  const __m256 least_distance = _mm256_set1_ps(kLeastDistance);
  const __m256 least_weight = _mm256_set1_ps(kLeastWeight);
  for (const WeightedPoint& point : points) {
    __m256 at[6];
    for (std::size_t a = 0; a < 6; ++a) at[a] = _mm256_set1_ps(point.at[a < 3 ? a : a + 1]);
    __m256 sum[4] = {_mm256_setzero_ps(), _mm256_setzero_ps(), _mm256_setzero_ps(),
                     _mm256_setzero_ps()};
    __m256 any_near = _mm256_setzero_ps();
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const RecordBlock& block = *blocks[b];
      __m256 square[6];
      for (std::size_t a = 0; a < 6; ++a) {
        const __m256 d = _mm256_sub_ps(_mm256_load_ps(block.at[a].data()), at[a]);
        square[a] = _mm256_mul_ps(d, d);
      }
      const __m256 way = _mm256_add_ps(_mm256_add_ps(square[0], square[1]), square[2]);
      const __m256 turn = _mm256_add_ps(_mm256_add_ps(square[3], square[4]), square[5]);
      const __m256 q = _mm256_add_ps(_mm256_sqrt_ps(way), _mm256_sqrt_ps(turn));
      const __m256 inside = _mm256_cmp_ps(q, far, _CMP_LT_OQ);
      const int lanes = _mm256_movemask_ps(inside);
      if (lanes == 0) continue;
      used[b] = static_cast<std::uint8_t>(used[b] | lanes);
      any_near = _mm256_or_ps(any_near, _mm256_cmp_ps(q, near, _CMP_LT_OQ));
      __m256 w = _mm256_sub_ps(_mm256_div_ps(one, _mm256_max_ps(q, least_distance)), less);
      w = _mm256_and_ps(_mm256_max_ps(w, least_weight), inside);
      for (std::size_t c = 0; c < 3; ++c) {
        sum[c] = _mm256_add_ps(sum[c], _mm256_mul_ps(w, _mm256_load_ps(block.light[c].data())));
      }
      sum[3] = _mm256_add_ps(sum[3], w);
    }
    alignas(32) float lane[4][8];
    for (std::size_t c = 0; c < 4; ++c) _mm256_store_ps(lane[c], sum[c]);
    RecordSum& out = *point.sum;
    out.r += total(lane[0]), out.g += total(lane[1]), out.b += total(lane[2]);
    out.weight += total(lane[3]);
    out.near = out.near || _mm256_movemask_ps(any_near) != 0;
  }
}
#endif

using Kernel = void (*)(std::span<const RecordBlock* const>, std::span<const WeightedPoint>,
                        const RecordReach&, std::uint8_t*);

Kernel pick_kernel() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return add_records_avx2;
#endif
  return add_records_portable;
}

const Kernel kKernel = pick_kernel();

}  // namespace

void add_records_portable(std::span<const RecordBlock* const> blocks,
                          std::span<const WeightedPoint> points, const RecordReach& reach,
                          std::uint8_t* used) {
  for (const WeightedPoint& point : points) {
    float sum[4][8] = {};
    bool near = false;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const RecordBlock& block = *blocks[b];
      for (std::size_t i = 0; i < 8; ++i) {
        const auto square = [&](std::size_t a) {
          const float d = block.at[a][i] - point.at[a < 3 ? a : a + 1];
          return d * d;
        };
        const float q = std::sqrt((square(0) + square(1)) + square(2)) +
                        std::sqrt((square(3) + square(4)) + square(5));
        if (!(q < reach.far)) continue;
        used[b] = static_cast<std::uint8_t>(used[b] | 1u << i);
        near = near || q < reach.near;
        const float w = std::max(1 / std::max(q, kLeastDistance) - reach.least, kLeastWeight);
        for (std::size_t c = 0; c < 3; ++c) sum[c][i] += w * block.light[c][i];
        sum[3][i] += w;
      }
    }
    RecordSum& out = *point.sum;
    out.r += total(sum[0]), out.g += total(sum[1]), out.b += total(sum[2]);
    out.weight += total(sum[3]);
    out.near = out.near || near;
  }
}

void add_records(std::span<const RecordBlock* const> blocks, std::span<const WeightedPoint> points,
                 const RecordReach& reach, std::uint8_t* used) {
  kKernel(blocks, points, reach, used);
}

}  // namespace haarlight
