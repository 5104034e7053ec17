// Three-vectors and rotations in double precision.

#pragma once

#include <array>
#include <cmath>

namespace haarlight {

/// A point (metres) or a direction (unit length unless said otherwise); right-handed, +Y up.
struct Vec3 {
  double x = 0, y = 0, z = 0;

  friend constexpr Vec3 operator+(const Vec3& a, const Vec3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend constexpr Vec3 operator-(const Vec3& a, const Vec3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend constexpr Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vec3 operator*(const Vec3& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3 operator*(double s, const Vec3& a) { return a * s; }
  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
};

constexpr double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
constexpr Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(const Vec3& a) { return std::sqrt(dot(a, a)); }
/// Requires a non-zero, finite vector.
inline Vec3 normalize(const Vec3& a) { return a * (1.0 / length(a)); }

/// A rotation, rows of an orthonormal 3x3 matrix. Always built from angles, never by chaining
/// many products, so that it stays orthonormal to rounding however long a motion runs.
struct Rotation {
  std::array<Vec3, 3> row{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};

  constexpr Vec3 operator*(const Vec3& v) const {
    return {dot(row[0], v), dot(row[1], v), dot(row[2], v)};
  }
  bool operator==(const Rotation&) const = default;
  constexpr Rotation transposed() const {
    return {{Vec3{row[0].x, row[1].x, row[2].x}, Vec3{row[0].y, row[1].y, row[2].y},
             Vec3{row[0].z, row[1].z, row[2].z}}};
  }
  /// (*this) after `first`.
  constexpr Rotation operator*(const Rotation& first) const {
    const Rotation t = first.transposed();
    Rotation out;
    for (int i = 0; i < 3; ++i) {
      out.row[static_cast<std::size_t>(i)] = {dot(row[static_cast<std::size_t>(i)], t.row[0]),
                                              dot(row[static_cast<std::size_t>(i)], t.row[1]),
                                              dot(row[static_cast<std::size_t>(i)], t.row[2])};
    }
    return out;
  }
};

/// Right-handed rotation about +X / +Y by `radians`: rotation_y(pi/2) takes +Z to +X.
inline Rotation rotation_x(double radians) {
  const double c = std::cos(radians), s = std::sin(radians);
  return {{Vec3{1, 0, 0}, Vec3{0, c, -s}, Vec3{0, s, c}}};
}
inline Rotation rotation_y(double radians) {
  const double c = std::cos(radians), s = std::sin(radians);
  return {{Vec3{c, 0, s}, Vec3{0, 1, 0}, Vec3{-s, 0, c}}};
}

inline constexpr double kPi = 3.14159265358979323846;

}  // namespace haarlight
