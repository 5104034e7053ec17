// A round lamp infinitely far away: radiance inside a cone of directions.

#pragma once

#include "core/rgb.h"
#include "core/vec.h"
#include "wavelet/cubemap.h"

namespace haarlight {

/// Smaller discs would fall between the samples by which the rim is measured.
inline constexpr double kMinDiscHalfAngle = 0.01;  ///< radians

struct DiscLight {
  Vec3 direction{0, 1, 0};   ///< unit, to the disc's middle
  double half_angle = 0.2;   ///< radians, [kMinDiscHalfAngle, pi]
  Rgb radiance{50, 50, 50};  ///< W m^-2 sr^-1, finite, >= 0
  bool operator==(const DiscLight&) const = default;
};

/// Adds to every texel the disc's radiance times the share of the texel's solid angle it covers.
/// `cosine` is that of the half-angle. No heap use.
void add_disc_light(const Vec3& direction, double cosine, const Rgb& radiance, Cubemap& map);

/// The same by the struct. Throws Error{invalid_argument} for a disc out of range.
void add_disc_light(const DiscLight& disc, Cubemap& map);

/// Throws Error{invalid_argument} naming what is out of range.
void check_disc_light(const DiscLight& disc);

}  // namespace haarlight
