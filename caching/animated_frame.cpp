// What is behind a scene.

#include "caching/animated_scene.h"
#include "caching/emitters.h"

namespace haarlight {

RgbD AnimatedFrame::background_from(const Vec3& direction) const {
  if (!environment) return background;
  return background + environment->radiance(environment_turn.transposed() * direction);
}

RgbD AnimatedFrame::background_without_suns(const Vec3& direction) const {
  if (!environment) return background;
  return background + environment->radiance_without_suns(environment_turn.transposed() * direction);
}

std::vector<SceneLight> AnimatedFrame::suns() const {
  std::vector<SceneLight> lamps;
  if (!environment) return lamps;
  for (const Suns::Sun& sun : environment->suns()) {
    SceneLight lamp;
    lamp.kind = SceneLight::Kind::directional;
    lamp.direction = environment_turn * -sun.from;
    lamp.intensity = sun.irradiance;
    lamps.push_back(lamp);
  }
  return lamps;
}

AnimatedFrame::BackgroundSample AnimatedFrame::sample_background(double u, double v) const {
  if (!environment) {
    const Vec3 from = even_direction(u, v);
    return {from, background * (4 * kPi)};
  }
  const EnvironmentLight::Sample sample = environment->sample_without_suns(u, v);
  const Vec3 from = environment_turn * sample.from;
  return {from, background_without_suns(from) * (1 / sample.pdf)};
}

}  // namespace haarlight
