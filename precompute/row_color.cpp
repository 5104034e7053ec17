// Whether a row of three channels is one grey row times a colour.

#include "precompute/row_color.h"

#include <algorithm>
#include <cmath>

#include "core/simd.h"

namespace haarlight {
namespace {

typedef float Eight __attribute__((vector_size(32), aligned(4)));

double dot_rgb(const RgbD& a, const RgbD& b) { return a.r * b.r + a.g * b.g + a.b * b.b; }
double largest(const RgbD& c) { return std::max({std::abs(c.r), std::abs(c.g), std::abs(c.b)}); }

// Sums of r r, g g, b b, r g, r b and g b: eight lanes a block, in single precision, and blocks in
// double. A block of 512 is right to 2^-24 times 64 at worst, far below the per cent that matters.
HAARLIGHT_MULTIVERSION
void sum_products(const float* r, const float* g, const float* b, std::size_t size, double* sum) {
  constexpr std::size_t kBlock = 512;
  std::fill_n(sum, 6, 0.0);
  for (std::size_t begin = 0; begin < size; begin += kBlock) {
    const std::size_t end = std::min(size, begin + kBlock);
    Eight lane[6] = {};
    std::size_t k = begin;
    for (; k + 8 <= end; k += 8) {
      const Eight x = *reinterpret_cast<const Eight*>(r + k);
      const Eight y = *reinterpret_cast<const Eight*>(g + k);
      const Eight z = *reinterpret_cast<const Eight*>(b + k);
      lane[0] += x * x, lane[1] += y * y, lane[2] += z * z;
      lane[3] += x * y, lane[4] += x * z, lane[5] += y * z;
    }
    for (; k < end; ++k) {
      const Eight rest{r[k] * r[k]}, other{g[k] * g[k]}, third{b[k] * b[k]};
      lane[0] += rest, lane[1] += other, lane[2] += third;
      lane[3] += Eight{r[k] * g[k]}, lane[4] += Eight{r[k] * b[k]}, lane[5] += Eight{g[k] * b[k]};
    }
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t l = 0; l < 8; ++l) sum[i] += static_cast<double>(lane[i][l]);
    }
  }
}

}  // namespace

double multiple_of(const RgbD& color, const RgbD& base) {
  const double square = dot_rgb(base, base);
  return square > 0 ? dot_rgb(color, base) / square : 0;
}

bool is_multiple(const RgbD& color, const RgbD& base) {
  return largest(color - base * multiple_of(color, base)) <= 0.01 * largest(base);
}

ColorFit fit_color(const float* r, const float* g, const float* b, std::size_t size) {
  double sum[6];
  sum_products(r, g, b, size, sum);
  const double rr = sum[0], gg = sum[1], bb = sum[2], rg = sum[3], rb = sum[4], gb = sum[5];
  const double trace = rr + gg + bb;
  if (!(trace > 0)) return {};
  // Power iteration from the channels' norms: all entries of the matrix are nearly always positive,
  // its largest eigenvalue far above the next, and what is wanted is known to a per cent.
  RgbD v{std::sqrt(rr), std::sqrt(gg), std::sqrt(bb)};
  double value = 0;
  for (int i = 0; i < 30; ++i) {
    v *= 1 / std::sqrt(dot_rgb(v, v));
    const RgbD next{rr * v.r + rg * v.g + rb * v.b, rg * v.r + gg * v.g + gb * v.b,
                    rb * v.r + gb * v.g + bb * v.b};
    value = dot_rgb(v, next);
    if (!(largest(next) > 0)) break;
    v = next;
  }
  ColorFit fit;
  fit.color = v * (1 / largest(v));
  fit.residual = std::sqrt(std::max(0.0, 1 - value / trace));
  return fit;
}

HAARLIGHT_MULTIVERSION
void to_grey(const RgbD& color, float* r, const float* g, const float* b, std::size_t size) {
  const double square = dot_rgb(color, color);
  if (!(square > 0)) return;
  const auto wr = static_cast<float>(color.r / square), wg = static_cast<float>(color.g / square),
             wb = static_cast<float>(color.b / square);
  for (std::size_t k = 0; k < size; ++k) r[k] = wr * r[k] + wg * g[k] + wb * b[k];
}

}  // namespace haarlight
