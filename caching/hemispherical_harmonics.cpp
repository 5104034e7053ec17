// Hemispherical harmonics by the recurrences of Legendre functions.

#include "caching/hemispherical_harmonics.h"

#include <algorithm>
#include <cmath>

namespace haarlight {
namespace {

constexpr auto kBands = static_cast<std::size_t>(kHarmonicBands);

std::size_t number(std::size_t l, std::size_t m) { return l * (l + 1) + m; }

// K~, times sqrt(2) above m = 0; [l][m].
struct Scales {
  std::array<std::array<double, kBands>, kBands> value{};
  Scales() {
    for (std::size_t l = 0; l < kBands; ++l) {
      double ratio = 1;  // (l - m)! / (l + m)!
      for (std::size_t m = 0; m <= l; ++m) {
        if (m > 0) ratio /= static_cast<double>((l + m) * (l - m + 1));
        value[l][m] = std::sqrt((2.0 * static_cast<double>(l) + 1) / (2 * kPi) * ratio) *
                      (m > 0 ? std::sqrt(2.0) : 1);
      }
    }
  }
};

}  // namespace

Harmonics hemispherical_harmonics(const Vec3& direction) {
  static const Scales scales;
  const double x = 2 * std::clamp(direction.z, 0.0, 1.0) - 1;
  const double root = std::sqrt(std::max(1 - x * x, 0.0));
  const double flat = std::hypot(direction.x, direction.y);
  const double c = flat > 0 ? direction.x / flat : 1, s = flat > 0 ? direction.y / flat : 0;
  Harmonics out{};
  double diagonal = 1;            // P_m^m
  double turn_c = 1, turn_s = 0;  // cos and sin of m phi
  for (std::size_t m = 0; m < kBands; ++m) {
    const auto order = static_cast<double>(m);
    double before = 0, p = diagonal;
    for (std::size_t l = m; l < kBands; ++l) {
      const double h = scales.value[l][m] * p;
      out[number(l, m)] = static_cast<float>(h * turn_c);
      if (m > 0) out[l * (l + 1) - m] = static_cast<float>(h * turn_s);
      const auto degree = static_cast<double>(l);
      const double next =
          ((2 * degree + 1) * x * p - (degree + order) * before) / (degree - order + 1);
      before = p, p = next;
    }
    diagonal *= (2 * order + 1) * root;
    const double next_c = turn_c * c - turn_s * s;
    turn_s = turn_s * c + turn_c * s, turn_c = next_c;
  }
  return out;
}

Harmonics turned_about_z(const Harmonics& even, double cosine, double sine) {
  Harmonics out{};
  double c = 1, s = 0;
  for (std::size_t m = 0; m < kBands; ++m) {
    for (std::size_t l = m; l < kBands; ++l) {
      const auto h = static_cast<double>(even[number(l, m)]);
      out[number(l, m)] = static_cast<float>(h * c);
      if (m > 0) out[l * (l + 1) - m] = static_cast<float>(h * s);
    }
    const double next = c * cosine - s * sine;
    s = s * cosine + c * sine, c = next;
  }
  return out;
}

}  // namespace haarlight
