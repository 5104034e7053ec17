// Coordinates about a unit vector.

#pragma once

#include <cmath>

#include "core/vec.h"

namespace haarlight {

/// Three unit vectors at right angles, z the given one. A function of it alone: what is written in
/// these coordinates by one part of the program is read by another. x turns smoothly with z but
/// for the half circle where z.z changes its sign (Duff and others 2017, "Building an Orthonormal
/// Basis, Revisited").
struct Frame {
  Vec3 x, y, z;
  explicit Frame(const Vec3& unit) : z(unit) {
    const double sign = std::copysign(1.0, z.z);
    const double a = -1 / (sign + z.z), b = z.x * z.y * a;
    x = {1 + sign * z.x * z.x * a, sign * b, -sign * z.x};
    y = {b, sign + z.y * z.y * a, -z.y};
  }
  Vec3 to_world(const Vec3& v) const { return x * v.x + y * v.y + z * v.z; }
  Vec3 to_local(const Vec3& v) const { return {dot(x, v), dot(y, v), dot(z, v)}; }
};

}  // namespace haarlight
