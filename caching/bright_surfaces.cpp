// Surfaces close to lamps.

#include "caching/bright_surfaces.h"

#include <cmath>

#include "caching/scene_light.h"

namespace haarlight {

BrightSurfaces::BrightSurfaces(const AnimatedFrame& frame, const Visibility& visibility)
    : visibility_(visibility) {
  constexpr double kTimes = 16;
  const Scene& scene = frame.scene;
  const std::size_t count = scene.triangle.size();
  std::vector<double> radiosity(count), area(count);
  double light = 0, all = 0;
  bool near = false;
  for (const SceneLight& lamp : frame.light) {
    near = near || lamp.kind != SceneLight::Kind::directional;
  }
  if (!near) return;  // what is far lights nothing more than the rest
  for (std::size_t t = 0; t < count; ++t) {
    const auto [va, vb, vc] = scene.triangle[t].vertex;
    const Vec3 &a = scene.position[va], &b = scene.position[vb], &c = scene.position[vc];
    const Vec3 normal = cross(b - a, c - a);
    const double size = length(normal);
    if (!(size > 0)) continue;
    const Vec3 middle = (a + b + c) * (1.0 / 3);
    double arrives = 0;
    for (const SceneLight& lamp : frame.light) {
      const LightArrival arrival = light_at(lamp, middle);
      arrives += luminance(arrival.irradiance) * std::abs(dot(arrival.from, normal)) / size;
    }
    area[t] = size / 2;
    radiosity[t] =
        arrives * static_cast<double>(luminance(scene.material[scene.triangle[t].material].albedo));
    light += radiosity[t] * area[t], all += area[t];
  }
  const double least = all > 0 ? kTimes * light / all : 0;
  for (std::uint32_t t = 0; t < count; ++t) {
    if (!(radiosity[t] > least)) continue;
    const auto [a, b, c] = visibility.corners(t);
    const double size = 0.5 * length(cross(b - a, c - a));
    if (!(size > 0)) continue;
    if (number_.empty()) number_.assign(count, -1);
    number_[t] = static_cast<std::int32_t>(bright_.size());
    bright_.push_back({t, size});
    chances_.add(radiosity[t] * area[t]);
  }
}

BrightSurfaces::Sample BrightSurfaces::choose(double u, double v, double w) const {
  const std::size_t i = chances_.choose(u);
  const auto [a, b, c] = visibility_.corners(bright_[i].triangle);
  const double root = std::sqrt(v), b2 = w * root, b1 = root - b2;
  return {{bright_[i].triangle, b1, b2, 0},
          a * (1 - root) + b * b1 + c * b2,
          density(static_cast<std::int32_t>(i))};
}

}  // namespace haarlight
