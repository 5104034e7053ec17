// Which method a scene calls for.

#include "caching/motion_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <vector>

#include "caching/reprojection.h"

namespace haarlight {

namespace {

struct Box {
  Vec3 low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};
  static constexpr double kFar = std::numeric_limits<double>::infinity();

  void add(const Vec3& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  double surface() const {
    const Vec3 d = high - low;
    return d.x >= 0 ? 2 * (d.x * d.y + d.y * d.z + d.z * d.x) : 0;
  }
  // Whether it is as wide as `all`, or nearly, along two axes: a wall, a floor, a room.
  bool spans(const Box& all) const {
    constexpr double kNearly = 0.8;
    const Vec3 d = high - low, whole = (all.high - all.low) * kNearly;
    return (d.x >= whole.x) + (d.y >= whole.y) + (d.z >= whole.z) >= 2;
  }
};

struct Body {
  Box box;
  double area = 0;
};

}  // namespace

const char* to_string(MotionPlan::Method method) {
  switch (method) {
    case MotionPlan::Method::prt:
      return "prt";
    case MotionPlan::Method::trc:
      return "trc";
    case MotionPlan::Method::tic:
      return "tic";
    case MotionPlan::Method::ic:
      break;
  }
  return "ic";
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

MotionPlan plan_interaction(const AnimatedScene& scene) {
  constexpr double kMost = 0.5;
  MotionPlan plan;
  plan.frames = scene.frames();
  const AnimatedFrame frame = scene.at(0);
  Box all;
  double area = 0;
  std::map<std::uint32_t, Body> body;
  for (std::uint32_t t = 0; t < frame.scene.triangle.size(); ++t) {
    Body& b = body[scene.instance_of(t)];
    const auto [va, vb, vc] = frame.scene.triangle[t].vertex;
    const Vec3 &p = frame.scene.position[va], &q = frame.scene.position[vb],
               &r = frame.scene.position[vc];
    for (const Vec3* corner : {&p, &q, &r}) b.box.add(*corner), all.add(*corner);
    const double size = 0.5 * length(cross(q - p, r - p));
    b.area += size, area += size;
  }
  int bodies = 0;
  for (const auto& [node, b] : body) {
    const double passed = all.surface() > 0 ? b.box.surface() / all.surface() : 0;
    if (b.box.spans(all)) continue;
    ++bodies;
    const double on_it = area > 0 ? b.area / area : 0;
    plan.touched = std::max(plan.touched, 1 - (1 - passed) * (1 - on_it));
  }
  plan.near_lights = static_cast<int>(frame.light.size());
  plan.method = plan.touched < kMost ? MotionPlan::Method::tic : MotionPlan::Method::ic;
  plan.why = fmt::format(
      "a person moves one of {} bodies at a time: at most {:.3g} % of all rays are traced again",
      bodies, 100 * plan.touched);
  return plan;
}

}  // namespace haarlight
