// A linear Rec.709 colour, and its double precision twin for differences and sums.

#pragma once

#include <cmath>

namespace haarlight {

/// Three channels of linear Rec.709. The unit is whatever the context says: radiance
/// (W m^-2 sr^-1) for light and pictures, a plain factor for albedo.
template <typename T>
struct BasicRgb {
  T r = 0, g = 0, b = 0;

  constexpr BasicRgb() = default;
  constexpr BasicRgb(T red, T green, T blue) : r(red), g(green), b(blue) {}
  template <typename U>
  constexpr explicit BasicRgb(const BasicRgb<U>& o)
      : r(static_cast<T>(o.r)), g(static_cast<T>(o.g)), b(static_cast<T>(o.b)) {}

  constexpr BasicRgb& operator+=(const BasicRgb& o) {
    r += o.r, g += o.g, b += o.b;
    return *this;
  }
  constexpr BasicRgb& operator-=(const BasicRgb& o) {
    r -= o.r, g -= o.g, b -= o.b;
    return *this;
  }
  constexpr BasicRgb& operator*=(T s) {
    r *= s, g *= s, b *= s;
    return *this;
  }
  friend constexpr BasicRgb operator+(BasicRgb a, const BasicRgb& c) { return a += c; }
  friend constexpr BasicRgb operator-(BasicRgb a, const BasicRgb& c) { return a -= c; }
  friend constexpr BasicRgb operator-(const BasicRgb& a) { return {-a.r, -a.g, -a.b}; }
  friend constexpr BasicRgb operator*(BasicRgb a, T s) { return a *= s; }
  friend constexpr BasicRgb operator*(T s, BasicRgb a) { return a *= s; }
  /// Channel by channel, as light passes a coloured surface.
  friend constexpr BasicRgb operator*(const BasicRgb& a, const BasicRgb& c) {
    return {a.r * c.r, a.g * c.g, a.b * c.b};
  }
  friend constexpr bool operator==(const BasicRgb&, const BasicRgb&) = default;
};

using Rgb = BasicRgb<float>;
using RgbD = BasicRgb<double>;

/// Sum of absolute channels: the norm by which wavelets are ranked (one list for all channels).
template <typename T>
T l1_norm(const BasicRgb<T>& c) {
  return std::abs(c.r) + std::abs(c.g) + std::abs(c.b);
}

/// Rec.709 luminance of a linear colour.
template <typename T>
constexpr T luminance(const BasicRgb<T>& c) {
  return T(0.2126) * c.r + T(0.7152) * c.g + T(0.0722) * c.b;
}

template <typename T>
bool is_finite(const BasicRgb<T>& c) {
  return std::isfinite(c.r) && std::isfinite(c.g) && std::isfinite(c.b);
}

}  // namespace haarlight
