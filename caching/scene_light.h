// Lights that stand in the scene, as KHR_lights_punctual has them.

#pragma once

#include "core/rgb.h"
#include "core/vec.h"

namespace haarlight {

/// A light without size.
struct SceneLight {
  enum class Kind { point, spot, directional };
  Kind kind = Kind::point;
  Vec3 position;             ///< world, metres; not of a directional one
  Vec3 direction{0, 0, -1};  ///< that its light travels, unit; not of a point
  RgbD intensity;            ///< point and spot: W/sr; directional: W/m^2 across its direction
  double inner = 0;          ///< spot: half angle of the full light, radians
  double outer = 0.7853981633974483;  ///< spot: half angle where it ends, radians, > inner
};

/// The irradiance that a light sends to `point` across the direction it comes from, without
/// occlusion, and where it comes from. KHR_lights_punctual, inner and outer cone angles.
struct LightArrival {
  Vec3 from;            ///< unit, towards the light
  double distance = 0;  ///< metres; infinite for a directional light
  RgbD irradiance;      ///< W/m^2; zero at the light itself
};
LightArrival light_at(const SceneLight& light, const Vec3& point);

}  // namespace haarlight
