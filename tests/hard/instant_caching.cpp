// Hard cases of virtual lights and instant caches: rows 40 to 42.

#include <gtest/gtest.h>

#include <cmath>

#include "caching/instant_cache.h"
#include "tests/caching/edited_scene.h"
#include "tests/hard/hard_case.h"

namespace haarlight {
namespace {

TEST(HardCases, Row40_VirtualLightsAtNoDistance) {
  hard::property(
      "a virtual light from afar to no distance: irradiance finite, at most I / (0.8 d)^2, and "
      "what "
      "the bound takes is what it is without");
  VirtualLight light;
  light.kind = VirtualLight::Kind::surface;
  light.geometric_normal = light.normal = {0, -1, 0};
  light.intensity = {2, 1, 0.5};
  constexpr double kLeast = 0.1;
  const double most = 2 / (0.8 * kLeast * 0.8 * kLeast);
  double largest = 0, worst = 0;
  int wrong = 0;
  for (double d = 4; d > 1e-300; d *= 0.7) {
    light.position = {0, d, 0};
    RgbD lost;
    const RgbD found = arrival(light, {0, 0, 0}, {0, 1, 0}, kLeast, &lost);
    if (!is_finite(found) || !is_finite(lost) || found.r < 0 || lost.r < 0) ++wrong;
    largest = std::max(largest, found.r / most);
    const double whole = 2 / (d * d);
    if (d > 1e-70) worst = std::max(worst, std::abs((found.r + lost.r) / whole - 1));
    if (d < 0.8 * kLeast && found.r != 0) ++wrong;
  }
  light.position = {0, 0, 0};
  if (arrival(light, {0, 0, 0}, {0, 1, 0}, kLeast) != RgbD{}) ++wrong;
  if (arrival(light, {0, 0, 0}, {0, 1, 0}, 0) != RgbD{}) ++wrong;
  hard::at_most("wrong", wrong, 0);
  hard::at_most("of the bound", largest, 1);
  hard::at_most("found and lost: relative error", worst, 1e-12);
}

TEST(HardCases, Row41_ShadowRaysOfNoLength) {
  hard::property("between places that coincide or pass each other there is nothing: never blocked");
  EditedScene edited(1);
  MovingVisibility scene(edited.body());
  scene.next(edited.frame());
  PathRandom random(1);
  int wrong = 0, tried = 0;
  for (std::uint32_t t = 0; t < edited.body().size(); ++t) {
    const auto [a, b, c] = scene.corners(t);
    const Vec3 normal = normalize(cross(b - a, c - a));
    const Vec3 place = (a + b + c) * (1.0 / 3);
    for (const double d : {0.0, 1e-300, 1e-12, 1e-8, Visibility::kSurfaceOffset}) {
      for (const double side : {-1.0, 1.0}) {
        const Segment s = segment_between(place, normal, place + normal * d, normal * side);
        ++tried;
        if (!std::isfinite(s.length) || !std::isfinite(s.direction.x + s.direction.y)) ++wrong;
        if (!(std::abs(length(s.direction) - 1) < 1e-6)) ++wrong;
        if (s.length == 0 && scene.occluded(s)) ++wrong;
        if (d == 0 && scene.occluded(s)) ++wrong;
      }
    }
  }
  hard::at_most("wrong", wrong, 0);
  hard::at_least("tried", tried, 100);
}

TEST(HardCases, Row42_CoincidentInstantRecords) {
  hard::property(
      "a hundred thousand instant records in one place, of any reach: at most 24 levels, found "
      "all");
  int missing = 0, deepest = 0;
  for (const double reach : {1e-300, 1e-9, 1e-3, 0.2, 1e9}) {
    NearbyOctree tree(2, reach);
    constexpr std::uint32_t kCount = 20'000;
    // On the border of cells and within one.
    for (const Vec3& place : {Vec3{0, 0, 0}, Vec3{0.1, 0.2, -0.3}}) {
      for (std::uint32_t i = 0; i < kCount; ++i) tree.insert(i, place, {0, 1, 0});
      if (tree.near(place).size() < kCount) ++missing;
    }
    deepest = std::max(deepest, tree.levels());
  }
  hard::at_most("places not found", missing, 0);
  hard::at_most("depth", deepest, NearbyOctree::kDeepest);
}

}  // namespace
}  // namespace haarlight
