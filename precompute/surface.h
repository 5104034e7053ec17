// What a ray from the camera meets: place, normals, colour.

#pragma once

#include <cstdint>
#include <optional>

#include "core/rgb.h"
#include "core/vec.h"
#include "precompute/point_tracer.h"
#include "precompute/scene.h"
#include "precompute/visibility.h"

namespace haarlight {

/// A place on the scene's surface as seen from one direction.
struct SurfaceHit {
  Vec3 position;          ///< local coordinates of Visibility, in the plane of the triangle
  Vec3 geometric_normal;  ///< unit, towards the viewer
  Vec3 normal;            ///< unit, interpolated, on the side of geometric_normal
  Vec3 to_viewer;         ///< unit
  double distance = 0;    ///< from the viewer, local units
  std::uint32_t material = 0;
  Rgb albedo;  ///< the material's, times texture and tint
};

/// The first surface along a ray (origin local, direction unit), or nothing.
std::optional<SurfaceHit> surface_hit(const Scene& scene, const Visibility& visibility,
                                      const Vec3& origin, const Vec3& direction);

/// Where light is gathered for a hit: just off the surface, with the lobe of its material.
ShadingPoint shading_point(const Scene& scene, const SurfaceHit& hit);

/// A texture's colour at (u, v), v up, repeating, bilinear between the middles of its pixels.
Rgb sample_texture(const Image& texture, double u, double v);

}  // namespace haarlight
