// Lights that stand in the scene.

#include "caching/scene_light.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace haarlight {

LightArrival light_at(const SceneLight& light, const Vec3& point) {
  if (light.kind == SceneLight::Kind::directional) {
    return {-light.direction, std::numeric_limits<double>::infinity(), light.intensity};
  }
  const Vec3 way = light.position - point;
  const double distance = length(way);
  if (!(distance > 0)) return {};  // at the light itself: no direction, no light
  LightArrival arrival{way * (1 / distance), distance, light.intensity};
  double share = 1 / (distance * distance);
  if (light.kind == SceneLight::Kind::spot) {
    const double cosine = -dot(arrival.from, light.direction);
    const double whole = std::cos(light.inner), none = std::cos(light.outer);
    const double t = std::clamp((cosine - none) / std::max(whole - none, 1e-3), 0.0, 1.0);
    share *= t * t;
  }
  arrival.irradiance = light.intensity * share;
  return arrival;
}

}  // namespace haarlight
