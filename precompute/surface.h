// What a ray from the camera meets: place, normals, colour.

#pragma once

#include <cstdint>
#include <optional>

#include "core/rgb.h"
#include "core/vec.h"
#include "precompute/scene.h"
#include "precompute/visibility.h"

namespace haarlight {

/// A place on the scene's surface as seen from one direction.
struct SurfaceHit {
  Vec3 position;          ///< local coordinates of Visibility, in the plane of the triangle
  Vec3 geometric_normal;  ///< unit, towards the viewer
  Vec3 normal;            ///< unit, interpolated and bumped by the material's normal texture; on
                          ///< the side of geometric_normal and, where that is possible, facing
                          ///< to_viewer: bent towards it where it is not
  Vec3 to_viewer;         ///< unit
  double distance = 0;    ///< from the viewer, local units
  std::uint32_t material = 0;
  Rgb albedo;           ///< the material's, times texture and tint
  float metallic = 0;   ///< times texture
  float roughness = 1;  ///< times texture
  bool outside = true;  ///< whether the triangle's corners run counter-clockwise for the viewer
};

/// The first surface along a ray (origin local, direction unit), or nothing.
std::optional<SurfaceHit> surface_hit(const Scene& scene, const Visibility& visibility,
                                      const Vec3& origin, const Vec3& direction);

/// What is at `hit`, which a ray of unit `direction` has found. Normal textures are read as in glTF
/// 2.0, 3.9.3, in the frame that the texture coordinates of the triangle span.
SurfaceHit surface_at(const Scene& scene, const Visibility& visibility, const Visibility::Hit& hit,
                      const Vec3& direction);

}  // namespace haarlight
