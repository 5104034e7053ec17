// Slow, plainly right visibility: one ray against every triangle, in double.
//
// Moeller and Trumbore 1997, "Fast, Minimum Storage Ray/Triangle Intersection".

#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "precompute/scene.h"
#include "precompute/visibility.h"

namespace haarlight::reference {

struct RayResult {
  bool blocked = false;
  double nearest = std::numeric_limits<double>::infinity();  ///< distance along the ray
  std::uint32_t triangle = 0;                                ///< the nearest, if blocked
  /// How near the ray comes to the border of any triangle in front of it, in barycentric units
  /// (smaller for triangles seen edge-on). A single precision ray may differ below ~1e-5.
  double margin = std::numeric_limits<double>::infinity();
};

/// Only triangles for which `counts(number)` holds are there.
template <typename Counts>
RayResult trace(const Visibility& visibility, const Vec3& origin, const Vec3& direction,
                const Counts& counts) {
  RayResult result;
  for (std::uint32_t t = 0; t < visibility.triangle_count(); ++t) {
    if (!counts(t)) continue;
    const Vec3 a = visibility.corner(t, 0);
    const Vec3 e1 = visibility.corner(t, 1) - a, e2 = visibility.corner(t, 2) - a;
    const Vec3 p = cross(direction, e2);
    const double determinant = dot(e1, p);
    // Edge-on rays: the barycentric coordinates blow up, and so does their error.
    const double edge_on = std::abs(determinant) / (length(e1) * length(e2));
    if (determinant == 0) {
      result.margin = 0;
      continue;
    }
    const Vec3 s = origin - a;
    const Vec3 q = cross(s, e1);
    const double u = dot(s, p) / determinant, v = dot(direction, q) / determinant;
    const double distance = dot(e2, q) / determinant;
    if (!(distance > 0)) continue;
    const double inside = std::min({u, v, 1 - u - v});
    result.margin = std::min(result.margin, std::abs(inside) * std::min(1.0, edge_on));
    if (inside > 0) {
      result.blocked = true;
      if (distance < result.nearest) result.nearest = distance, result.triangle = t;
    }
  }
  return result;
}

inline RayResult trace(const Visibility& visibility, const Vec3& origin, const Vec3& direction) {
  return trace(visibility, origin, direction, [](std::uint32_t) { return true; });
}

}  // namespace haarlight::reference
