// Where the pixels of a picture look: the surfaces that caches must light.

#pragma once

#include <cstddef>
#include <vector>

#include "caching/body_place.h"
#include "caching/frame_tracer.h"
#include "core/camera.h"
#include "core/image.h"

namespace haarlight {

/// A surface that is not only a mirror or glass, seen by a pixel, straight or by way of mirrors.
struct GatherPoint {
  BodyPlace place;
  Visibility::Hit hit;
  Vec3 direction;         ///< of the ray that found it, unit
  RgbD weight;            ///< share of its radiance that reaches the pixel
  Vec3 position, normal;  ///< world; without normal textures
  bool broad = false;     ///< whether it asks for irradiance: is_broad()
};

/// The points of all pixels, a row of the picture at a time.
struct GatherPoints {
  Image without;                                ///< background and shining mirrors, seen
  std::vector<std::vector<GatherPoint>> row;    ///< those of a pixel beside each other
  std::vector<std::vector<std::size_t>> first;  ///< by row and x, width + 1 numbers: into row[y]
};

/// Follows rays through the middles of the pixels, through up to 8 mirrors and panes and while a
/// thousandth of the light is left.
GatherPoints gather_points(const FrameTracer& tracer, const Camera& camera);

/// What of a surface is lit by irradiance: the share of it that leaves as radiance towards the
/// viewer, times pi. Diffuse parts, and lobes so wide (GGX alpha above 0.4, Phong exponents below
/// 3) that their albedo says enough.
RgbD broad_reflectance(const Bsdf& bsdf);
/// Whether a surface has a lobe that is not.
bool has_narrow_lobe(const Bsdf& bsdf);

}  // namespace haarlight
