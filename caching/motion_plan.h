// Which method a scene calls for: relighting, or caches that live while things move.

#pragma once

#include <string>

#include "caching/animated_scene.h"

namespace haarlight {

/// A choice, and the numbers it was made by.
struct MotionPlan {
  enum class Method {
    prt,  ///< precompute and relight: still geometry under distant light
    trc,  ///< animate --method trc: known animation, or light from lamps and shining triangles
    tic,  ///< animate --method tic: a person moves things, most rays stay as they are
    ic    ///< animate --method ic: a person moves things, and what moves touches most rays
  };
  Method method = Method::prt;
  std::string why;        ///< one clause with the number that decided
  double moving = 0;      ///< share of the triangles that move at all, [0, 1]
  int moving_lights = 0;  ///< lamps that move or change
  int near_lights = 0;    ///< lamps and triangles that shine, in the scene
  int frames = 1;         ///< of the animation
  double touched = 0;     ///< interactive: estimated share of rays to be traced again, [0, 1]
};

/// Looks at up to 32 frames, spread over the animation; traces nothing.
MotionPlan plan_motion(const AnimatedScene& scene);

/// For a scene in which a person moves bodies, one at a time, with no frame known beforehand. What
/// is traced again when a body moves: rays from records on it, by its share of the surface, and
/// rays that pass it, by its box's share of the surface of the scene's box: that is how often lines
/// through one convex body meet another in it (Cauchy; Santalo 1976). The body with the largest
/// share decides; bodies whose box fills most of the scene's are the room and stay. `ic` from a
/// half on, else `tic`.
MotionPlan plan_interaction(const AnimatedScene& scene);

/// "prt", "trc", "tic" or "ic".
const char* to_string(MotionPlan::Method method);

}  // namespace haarlight
