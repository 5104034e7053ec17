// Which method a scene calls for: relighting, or caches that live while things move.

#pragma once

#include <string>

#include "caching/animated_scene.h"

namespace haarlight {

/// A choice, and the numbers it was made by.
struct MotionPlan {
  enum class Method {
    prt,  ///< precompute and relight: still geometry under distant light
    trc   ///< animate --method trc: known animation, or light from lamps and shining triangles
  };
  Method method = Method::prt;
  std::string why;        ///< one clause with the number that decided
  double moving = 0;      ///< share of the triangles that move at all, [0, 1]
  int moving_lights = 0;  ///< lamps that move or change
  int near_lights = 0;    ///< lamps and triangles that shine, in the scene
  int frames = 1;         ///< of the animation
};

/// Looks at up to 32 frames, spread over the animation; traces nothing.
MotionPlan plan_motion(const AnimatedScene& scene);

/// "prt" or "trc".
const char* to_string(MotionPlan::Method method);

}  // namespace haarlight
