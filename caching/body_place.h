// A place on a body, the same one in every frame, and where it is in one of them.

#pragma once

#include <cstdint>

#include "core/vec.h"
#include "precompute/scene.h"

namespace haarlight {

/// A place on a triangle of an animated scene, and which side of it is meant. A plain value.
struct BodyPlace {
  std::uint32_t triangle = 0;
  double b1 = 0, b2 = 0;  ///< barycentric coordinates of the second and third corner
  bool front = true;      ///< the side from which the corners run counter-clockwise

  bool operator==(const BodyPlace&) const = default;
};

/// Where a BodyPlace is in a frame: world, metres; all directions unit, normals on its side. The
/// tangents turn with the body: tangent, bitangent and normal are right-handed.
struct PlaceFrame {
  Vec3 position, geometric_normal;
  Vec3 normal;  ///< interpolated, without normal textures
  Vec3 tangent, bitangent;

  Vec3 to_world(const Vec3& v) const { return tangent * v.x + bitangent * v.y + normal * v.z; }
  Vec3 to_local(const Vec3& v) const {
    return {dot(v, tangent), dot(v, bitangent), dot(v, normal)};
  }
};

/// Finite for triangles of any shape.
PlaceFrame place_in(const Scene& scene, const BodyPlace& place);

}  // namespace haarlight
