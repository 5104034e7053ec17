// Outdoor light: a clear sky with its sun, and clouds.

#include <algorithm>
#include <cmath>

#include "data_gen/environments.h"
#include "data_gen/noise.h"
#include "data_gen/random.h"

namespace haarlight::data_gen {
namespace {

RgbD blend(const RgbD& a, const RgbD& b, double t) { return a * (1 - t) + b * t; }

double ramp(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

Vec3 seeded_offset(std::uint64_t seed) {
  Random random(seed);
  return {random.between(0, 500), random.between(0, 500), random.between(0, 500)};
}

// From blue overhead to a pale horizon.
RgbD clear_sky(const Vec3& d) {
  return blend({0.72, 0.80, 0.92}, {0.10, 0.22, 0.58}, std::pow(std::max(d.y, 0.0), 0.45));
}

}  // namespace

EnvironmentModel make_sky(std::uint64_t seed) {
  EnvironmentModel model;
  const Vec3 sun = normalize(Vec3{-0.52, 0.62, 0.48}), offset = seeded_offset(seed);
  // The sun's true half angle is 0.266 degrees. Radiance is chosen so that the sun gives about four
  // times the light of the sky, as on a clear day, in the sky's own units.
  model.discs.push_back({sun, 0.266 * kPi / 180, RgbD{52000, 46000, 36000}});
  model.smooth = [sun, offset](const Vec3& d) {
    if (d.y < 0) {
      // Bare ground with large and small spots, hazier towards the horizon.
      const Vec3 place = d * (1.5 / std::max(-d.y, 0.02));
      const double spots = 1 + 0.22 * fractal_noise(place + offset, 4);
      return blend(RgbD{0.26, 0.21, 0.16} * spots, {0.45, 0.47, 0.50}, std::exp(14 * d.y));
    }
    const double toward_sun = std::max(0.0, dot(d, sun));
    // The glow around the sun: wide and narrow.
    return clear_sky(d) + RgbD{1.0, 0.9, 0.72} * (0.5 * std::pow(toward_sun, 12)) +
           RgbD{1.0, 0.95, 0.85} * (9 * std::pow(toward_sun, 900));
  };
  return model;
}

EnvironmentModel make_clouds(std::uint64_t seed) {
  EnvironmentModel model;
  const Vec3 sun = normalize(Vec3{0.45, 0.70, -0.55}), offset = seeded_offset(seed);
  model.smooth = [sun, offset](const Vec3& d) {
    if (d.y < 0) {
      const Vec3 place = d * (2.5 / std::max(-d.y, 0.02));
      const double blades = 1 + 0.25 * fractal_noise(place + offset, 5);
      return blend(RgbD{0.085, 0.130, 0.040} * blades, {0.42, 0.46, 0.48}, std::exp(16 * d.y));
    }
    // Clouds lie on a dome that is flat overhead, so that they shrink towards the horizon.
    const Vec3 place = d * (1.6 / (d.y + 0.18)) + offset;
    const double cover = ramp(-0.25, 0.45, fractal_noise(place, 6));
    const double thick = ramp(0.0, 1.1, fractal_noise(place + Vec3{0.05, 0, -0.04}, 6));
    const double toward_sun = std::max(0.0, dot(d, sun));
    const RgbD lit = RgbD{1.35, 1.30, 1.22} * (1 + 5 * std::pow(toward_sun, 24));
    const RgbD cloud = blend(lit, {0.38, 0.42, 0.50}, thick);
    const RgbD open = clear_sky(d) + RgbD{1.0, 0.93, 0.8} * (60 * std::pow(toward_sun, 500));
    return blend(open, cloud, cover * ramp(-0.02, 0.12, d.y));
  };
  return model;
}

}  // namespace haarlight::data_gen
