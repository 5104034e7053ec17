// Whether a row of three channels is one grey row times a colour.

#include "precompute/row_color.h"

#include <algorithm>
#include <cmath>

namespace haarlight {
namespace {

double dot_rgb(const RgbD& a, const RgbD& b) { return a.r * b.r + a.g * b.g + a.b * b.b; }
double largest(const RgbD& c) { return std::max({std::abs(c.r), std::abs(c.g), std::abs(c.b)}); }

}  // namespace

double multiple_of(const RgbD& color, const RgbD& base) {
  const double square = dot_rgb(base, base);
  return square > 0 ? dot_rgb(color, base) / square : 0;
}

bool is_multiple(const RgbD& color, const RgbD& base) {
  return largest(color - base * multiple_of(color, base)) <= 0.01 * largest(base);
}

ColorFit fit_color(const float* r, const float* g, const float* b, std::size_t size) {
  double rr = 0, gg = 0, bb = 0, rg = 0, rb = 0, gb = 0;
  for (std::size_t k = 0; k < size; ++k) {
    const auto x = static_cast<double>(r[k]), y = static_cast<double>(g[k]),
               z = static_cast<double>(b[k]);
    rr += x * x, gg += y * y, bb += z * z;
    rg += x * y, rb += x * z, gb += y * z;
  }
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

void to_grey(const RgbD& color, float* r, const float* g, const float* b, std::size_t size) {
  const double square = dot_rgb(color, color);
  if (!(square > 0)) return;
  const auto wr = static_cast<float>(color.r / square), wg = static_cast<float>(color.g / square),
             wb = static_cast<float>(color.b / square);
  for (std::size_t k = 0; k < size; ++k) r[k] = wr * r[k] + wg * g[k] + wb * b[k];
}

}  // namespace haarlight
