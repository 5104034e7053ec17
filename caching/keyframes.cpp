// A value that changes along keys in time.

#include "caching/keyframes.h"

#include <algorithm>
#include <cmath>

namespace haarlight {
namespace {

void make_unit(std::span<double> q) {
  double square = 0;
  for (const double x : q) square += x * x;
  if (!(square > 0)) {
    std::fill(q.begin(), q.end(), 0.0);
    q.back() = 1;
    return;
  }
  for (double& x : q) x /= std::sqrt(square);
}

void turn_between(const double* a, const double* b, double u, std::span<double> out) {
  double cosine = 0;
  for (std::size_t k = 0; k < 4; ++k) cosine += a[k] * b[k];
  const double sign = cosine < 0 ? -1 : 1;
  const double angle = std::acos(std::min(std::abs(cosine), 1.0));
  const double sine = std::sin(angle);
  // Below this the arc is straight to rounding.
  const bool straight = sine < 1e-9;
  const double first = straight ? 1 - u : std::sin((1 - u) * angle) / sine;
  const double second = sign * (straight ? u : std::sin(u * angle) / sine);
  for (std::size_t k = 0; k < 4; ++k) out[k] = first * a[k] + second * b[k];
}

}  // namespace

void Keyframes::at(double seconds, std::span<double> out) const {
  const bool cubic = interpolation == Interpolation::cubic;
  const std::size_t stride = cubic ? 3 * width : width;
  const auto key = [&](std::size_t i) { return value.data() + i * stride + (cubic ? width : 0); };
  const auto after = std::upper_bound(time.begin(), time.end(), seconds);
  const auto next = static_cast<std::size_t>(after - time.begin());
  if (next == 0 || next == time.size()) {
    const double* end = key(next == 0 ? 0 : next - 1);
    std::copy(end, end + width, out.begin());
  } else {
    const std::size_t i = next - 1;
    const double span = time[next] - time[i], u = (seconds - time[i]) / span;
    const double *a = key(i), *b = key(next);
    if (interpolation == Interpolation::step) {
      std::copy(a, a + width, out.begin());
    } else if (cubic) {
      const double u2 = u * u, u3 = u2 * u;
      for (std::size_t k = 0; k < width; ++k) {
        const double leaves = a[width + k] * span;
        const double comes = value[next * stride + k] * span;
        out[k] = (2 * u3 - 3 * u2 + 1) * a[k] + (u3 - 2 * u2 + u) * leaves +
                 (3 * u2 - 2 * u3) * b[k] + (u3 - u2) * comes;
      }
    } else if (rotation) {
      turn_between(a, b, u, out);
    } else {
      for (std::size_t k = 0; k < width; ++k) out[k] = a[k] + u * (b[k] - a[k]);
    }
  }
  if (rotation) make_unit(out);
}

}  // namespace haarlight
