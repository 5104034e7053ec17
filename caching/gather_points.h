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
  bool broad = false;     ///< whether it asks for irradiance
  bool glossy = false;    ///< whether it asks for incoming radiance
  std::int32_t lobe = 0;  ///< lobe_table_key(), if so
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

/// Who lights a lobe. Wide ones (GGX alpha above 0.4, Phong exponents below 3): irradiance, by
/// their albedo. Glossy ones (alpha above 0.15, exponents below 60): incoming radiance in
/// hemispherical harmonics, whose shortest wave they are wider than. Narrow ones: rays.
enum class LobeKind { none, wide, glossy, narrow };
LobeKind lobe_kind(const Bsdf& bsdf);

/// What of a surface is lit by irradiance, diffuse parts and wide lobes: the share of it that
/// leaves as radiance towards the viewer, times pi.
RgbD broad_reflectance(const Bsdf& bsdf);

}  // namespace haarlight
