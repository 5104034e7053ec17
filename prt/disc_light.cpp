// Draws round lamps onto cube maps.

#include "prt/disc_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace haarlight {
namespace {

/// Share of a texel's solid angle under the disc, by samples in a square grid.
double disc_share(const Vec3& center, double disc_cosine, int face, int x, int y, int n) {
  // Enough samples for coarse faces too: 512 along a face.
  const int samples = std::max(8, 512 / n);
  double inside = 0, all = 0;
  for (int j = 0; j < samples; ++j) {
    for (int i = 0; i < samples; ++i) {
      const double u = 2 * (x + (i + 0.5) / samples) / n - 1;
      const double v = 2 * (y + (j + 0.5) / samples) / n - 1;
      const double s = 1 + u * u + v * v, solid_angle = 1 / (s * std::sqrt(s));
      all += solid_angle;
      if (dot(cube_direction({face, u, v}), center) >= disc_cosine) inside += solid_angle;
    }
  }
  return inside / all;
}

}  // namespace

void add_disc_light(const Vec3& direction, double cosine, const Rgb& radiance, Cubemap& map) {
  const double radius = std::acos(cosine);
  // No point of a texel is farther from its middle than this: half a diagonal of length
  // sqrt(2) 2 / n, which projecting onto the sphere only shortens.
  const double reach = std::sqrt(2.0) / map.n;
  const double outside = std::cos(std::min(radius + reach, kPi));
  const double inside = radius > reach ? std::cos(radius - reach) : 2.0;
  for (int face = 0; face < 6; ++face) {
    for (int y = 0; y < map.n; ++y) {
      for (int x = 0; x < map.n; ++x) {
        const double to_center = dot(cube_texel_center(face, x, y, map.n), direction);
        if (to_center < outside) continue;
        const double share =
            to_center > inside ? 1.0 : disc_share(direction, cosine, face, x, y, map.n);
        map.texels[cube_index(face, x, y, map.n)] += Rgb(RgbD(radiance) * share);
      }
    }
  }
}

void add_disc_light(const DiscLight& disc, Cubemap& map) {
  check_disc_light(disc);
  add_disc_light(disc.direction, std::cos(disc.half_angle), disc.radiance, map);
}

void check_disc_light(const DiscLight& disc) {
  // The bound lets a direction through that was written with seven digits.
  if (!(std::abs(length(disc.direction) - 1) <= 1e-6)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("direction of a light is ({}, {}, {}), expected unit length",
                            disc.direction.x, disc.direction.y, disc.direction.z));
  }
  if (!(disc.half_angle >= kMinDiscHalfAngle && disc.half_angle <= kPi)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("half-angle of a light is {} radians, expected {} to pi",
                            disc.half_angle, kMinDiscHalfAngle));
  }
  const Rgb& c = disc.radiance;
  if (!is_finite(c) || std::min({c.r, c.g, c.b}) < 0 || std::max({c.r, c.g, c.b}) > 1e12f) {
    throw Error(
        ErrorKind::invalid_argument,
        fmt::format("radiance of a light is ({}, {}, {}), expected 0 to 1e12", c.r, c.g, c.b));
  }
}

}  // namespace haarlight
