// Which method a scene calls for.

#include "caching/motion_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "caching/reprojection.h"

namespace haarlight {

const char* to_string(MotionPlan::Method method) {
  return method == MotionPlan::Method::prt ? "prt" : "trc";
}

MotionPlan plan_motion(const AnimatedScene& scene) {
  constexpr int kLooks = 32;
  MotionPlan plan;
  plan.frames = scene.frames();
  const AnimatedFrame start = scene.at(0);
  std::vector<bool> moves(start.scene.triangle.size()), lamp_moves(start.light.size());
  bool colors = false;
  const int looks = std::min(kLooks, plan.frames - 1);
  for (int i = 1; i <= looks; ++i) {
    const auto number = static_cast<int>(std::int64_t{i} * (plan.frames - 1) / looks);
    const AnimatedFrame then = scene.at(number);
    const FrameChange change(start, then);
    for (std::uint32_t t = 0; t < moves.size(); ++t) moves[t] = moves[t] || change.moves(t);
    for (std::size_t n = 0; n < lamp_moves.size(); ++n) {
      const SceneLight &a = start.light[n], &b = then.light[n];
      lamp_moves[n] = lamp_moves[n] || !(a.position == b.position) ||
                      !(a.direction == b.direction) || !(a.intensity == b.intensity);
    }
    for (std::size_t m = 0; m < start.emission.size(); ++m) {
      const Material &a = start.scene.material[m], &b = then.scene.material[m];
      colors = colors || !(a.albedo == b.albedo) || a.metallic != b.metallic ||
               a.roughness != b.roughness ||
               !(start.emission[m].radiance == then.emission[m].radiance);
    }
  }
  const auto moving = std::count(moves.begin(), moves.end(), true);
  plan.moving = moves.empty() ? 0 : static_cast<double>(moving) / static_cast<double>(moves.size());
  plan.moving_lights = static_cast<int>(std::count(lamp_moves.begin(), lamp_moves.end(), true));
  plan.near_lights = static_cast<int>(start.light.size());
  for (const Triangle& t : start.scene.triangle) {
    if (l1_norm(start.emission[t.material].radiance) > 0) ++plan.near_lights;
  }
  if (moving > 0 || plan.moving_lights > 0 || colors) {
    plan.method = MotionPlan::Method::trc;
    plan.why = fmt::format("{:.3g} % of the triangles and {} of {} lamps move in {} frames{}",
                           100 * plan.moving, plan.moving_lights, start.light.size(), plan.frames,
                           colors ? ", and materials change" : "");
  } else if (plan.near_lights > 0) {
    plan.method = MotionPlan::Method::trc;
    plan.why = fmt::format(
        "nothing moves, but {} lamps and shining triangles are in the scene, "
        "which distant light is not",
        plan.near_lights);
  } else {
    plan.why = "0 % of the triangles move, and no light is in the scene: it is distant";
  }
  return plan;
}

}  // namespace haarlight
