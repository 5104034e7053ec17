// Virtual lights: closed forms, and the path tracer where the bound does not matter.

#include "caching/virtual_lights.h"

#include <gtest/gtest.h>

#include <cmath>

#include "caching/frame_tracer.h"
#include "caching/halton.h"
#include "caching/interleaved_gather.h"
#include "precompute/bsdf.h"
#include "tests/caching/edited_scene.h"
#include "tests/caching/estimate.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

MovingVisibility ready(const AnimatedFrame& frame) {
  MovingVisibility scene(std::vector<std::uint32_t>(frame.scene.triangle.size(), 0));
  scene.next(frame);
  return scene;
}

// Irradiance at a place by all lights, unbounded, with shadows.
double irradiance(const MovingVisibility& scene, const std::vector<VirtualLight>& lights,
                  const Vec3& world, const Vec3& normal) {
  double sum = 0;
  const Vec3 place = scene.to_local(world);
  for (const VirtualLight& light : lights) {
    const RgbD c = arrival(light, place, normal, 0);
    if (c.g > 0 && !scene.occluded(segment_to(light, place, normal))) sum += c.g;
  }
  return sum;
}

TEST(VirtualLights, FluxInAClosedBoxIsThatOfAFurnace) {
  // Walls of albedo a that shine with E: each reflection carries a times the flux of the one
  // before.
  Scene scene = shapes::empty_scene();
  shapes::add_box(scene, {-1, -1, -1}, {1, 1, 1});
  scene.material[0].albedo = {0.5f, 0.5f, 0.5f};
  AnimatedFrame frame;
  frame.scene = scene;
  frame.emission.push_back({{0.3, 0.3, 0.3}, true});
  const MovingVisibility ready_scene = ready(frame);
  constexpr int kBounces = 4;
  const auto lights = virtual_lights(ready_scene, {1024, kBounces, 1});
  double flux = 0;
  for (const VirtualLight& light : lights) {
    // Half of the paths leave outwards and meet nothing.
    if (light.kind == VirtualLight::Kind::none) continue;
    flux += light.intensity.g * kPi / (ready_scene.scale() * ready_scene.scale());
  }
  // 24 m^2 shine pi E inwards; a + a^2 + ... of it is reflected. Which sides paths leave by is a
  // number of its own: half of them within a few of 512.
  const double wanted = 24 * kPi * 0.3 * (0.5 + 0.25 + 0.125 + 0.0625);
  EXPECT_NEAR(flux, wanted, 0.03 * wanted);
}

TEST(VirtualLights, OneBounceBetweenPlanesIsTheClosedForm) {
  // A lamp close to a small patch far from a point: nearly all flux is reflected there. Seen from
  // a distance d along its normal a patch of intensity I sends I / d^2: here the patch is an
  // endless plain's, so the sum over lights is compared with the integral over the plain instead:
  // E(h') = rho / pi * integral of I h / r^3 * cos^2 / d^2, by quadrature.
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-20, 0, 20}, {40, 0, 0}, {0, 0, -40});
  scene.material[0].albedo = {0.8f, 0.8f, 0.8f};
  AnimatedFrame frame;
  frame.scene = scene;
  frame.emission.resize(1);
  SceneLight lamp;
  lamp.position = {0, 0.5, 0};
  lamp.intensity = {3, 3, 3};
  frame.light.push_back(lamp);
  const MovingVisibility visibility = ready(frame);
  const auto lights = virtual_lights(visibility, {16384, 1, 1});
  const double h = 0.5, top = 2;
  double wanted = 0;
  constexpr int kRings = 20000;
  for (int i = 0; i < kRings; ++i) {
    const double r = 20.0 * (i + 0.5) / kRings, area = 2 * kPi * r * 20.0 / kRings;
    const double arrives = 3 * h / std::pow(r * r + h * h, 1.5);
    wanted += 0.8 / kPi * arrives * area * top * top / std::pow(r * r + top * top, 2);
  }
  const double found = irradiance(visibility, lights, {0, 2, 0}, {0, -1, 0});
  // Halton points: the error falls nearly as 1/N; rotation makes two dimensions one, so that
  // log N / N of 8192 used ones, 0.1 %, with room for its constant.
  EXPECT_NEAR(found, wanted, 0.01 * wanted);
}

TEST(VirtualLights, SumIsThatOfPaths) {
  // A room with a block in it, a lamp and walls of albedo a: irradiance in the middle, of light
  // that has been reflected up to 8 times, which leaves out a share of a^8 at most.
  Scene scene = shapes::empty_scene();
  constexpr double kAlbedo = 0.4;
  scene.material[0].albedo = {0.4f, 0.4f, 0.4f};
  shapes::add_box(scene, {-1, 0, -1}, {1, 2, 1});
  shapes::add_box(scene, {-0.7, 0, -0.6}, {-0.2, 0.5, 0.1});
  AnimatedFrame frame;
  frame.scene = std::move(scene);
  frame.emission.resize(1);
  SceneLight lamp;
  lamp.position = {0.3, 1.4, 0.2}, lamp.intensity = {2, 2, 2};
  frame.light.push_back(lamp);
  const Vec3 place{0.1, 0.9, -0.1}, normal = normalize(Vec3{-1, -0.7, 0.3});

  const FrameTracer tracer(frame);
  ASSERT_TRUE(tracer.bright().empty());
  const Vec3 from = tracer.visibility().to_local(place);
  const Estimate paths = estimate(5, 40000, [&](PathRandom& random) {
    const double u = random.next(), v = random.next();
    return kPi * tracer.radiance(from, cosine_direction(normal, u, v), random, false).g;
  });

  // Scrambled anew, a set of lights is an independent estimate without bias.
  const MovingVisibility visibility = ready(frame);
  constexpr double kNear = 0.3;
  double lost_share = 0;
  const Estimate lights = estimate(9, 30, [&](PathRandom& random) {
    const auto seed = static_cast<std::uint64_t>(random.next() * 1e15);
    double whole = 0, bounded = 0;
    RgbD lost;
    for (const VirtualLight& light : virtual_lights(visibility, {512, 8, seed})) {
      const Vec3 at = visibility.to_local(place);
      const double all = arrival(light, at, normal, 0).g;
      if (!(all > 0) || visibility.occluded(segment_to(light, at, normal))) continue;
      RgbD gone;
      whole += all, bounded += arrival(light, at, normal, kNear * visibility.scale() * 2, &gone).g;
      lost += gone;
    }
    EXPECT_NEAR(bounded + lost.g, whole, 1e-9 * whole);
    lost_share += lost.g / whole / 30;
    return whole;
  });
  EXPECT_GT(lost_share, 0.01);  // the bound had something to take
  // Either way within four standard errors of the difference: one in 16,000 by chance.
  const double error = std::hypot(paths.error, lights.error);
  EXPECT_LT(error, 0.02 * paths.mean);
  EXPECT_NEAR(lights.mean, paths.mean, 4 * error + std::pow(kAlbedo, 8) * paths.mean);
}

TEST(VirtualLights, BackgroundOverAPlainIsPi) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2});
  AnimatedFrame frame;
  frame.scene = scene;
  frame.emission.resize(1);
  frame.background = {1, 1, 1};
  const MovingVisibility visibility = ready(frame);
  const auto lights = virtual_lights(visibility, {2000, 1, 1});
  EXPECT_NEAR(irradiance(visibility, lights, {0, 0, 0}, {0, 1, 0}), kPi, 0.02 * kPi);
}

TEST(VirtualLights, StayWhereNothingMoves) {
  // What a path has not met may move: its lights are the same bits. Fewer change than do not.
  EditedScene edited(4);
  MovingVisibility scene(edited.body());
  std::vector<VirtualLight> before;
  int kept = 0, changed = 0;
  for (int e = 0; e < 60; ++e) {
    scene.next(edited.frame());
    const auto now = virtual_lights(scene, {128, 3, 1});
    ASSERT_EQ(now, virtual_lights(scene, {128, 3, 1}));
    if (before.size() == now.size() && edited.frame().background == RgbD{}) {
      for (std::size_t k = 0; k < now.size(); ++k) ++(now[k] == before[k] ? kept : changed);
    }
    before = now;
    edited.edit();
  }
  EXPECT_GT(changed, 50);
  EXPECT_GT(kept, 5 * changed);
}

TEST(VirtualLights, BoundIsEquationThree) {
  EXPECT_EQ(smooth_step(0.8, 1.2, 0.8), 0);
  EXPECT_EQ(smooth_step(0.8, 1.2, 1.2), 1);
  EXPECT_DOUBLE_EQ(smooth_step(0.8, 1.2, 1.0), 0.5);
  EXPECT_DOUBLE_EQ(smooth_step(0.8, 1.2, 0.9), 3.0 / 16 - 2.0 / 64);
  EXPECT_EQ(smooth_step(0, 0, 0), 1);
}

TEST(VirtualLights, InterleavedPatternsTogetherAskAll) {
  // Away from edges the discontinuity buffer over a plain sums each light once: close to the
  // whole sum, since irradiance hardly changes over three pixels.
  AnimatedFrame frame;
  frame.scene = shapes::empty_scene();
  shapes::add_quad(frame.scene, {-2, 0, 2}, {4, 0, 0}, {0, 0, -4});
  frame.scene.camera = look_at({0, 1, 1.2}, {0, 0, 0}, 0.5, 60, 45);
  frame.emission.resize(1);
  frame.background = {1, 0.5, 0.2};
  const MovingVisibility scene = ready(frame);
  const auto lights = virtual_lights(scene, {300, 1, 1});
  Image picture;
  std::vector<SurfaceRow> rows;
  surface_points(scene, *frame.scene.camera, {}, picture, rows);
  std::vector<std::vector<RgbD>> all, some;
  const auto rays = interleaved_gather(scene, lights, rows, {1, 0, 1}, all);
  EXPECT_LT(interleaved_gather(scene, lights, rows, {3, 0, 1}, some), rays / 8);
  for (std::size_t y = 1; y + 1 < all.size(); ++y) {
    for (std::size_t x = 1; x + 1 < all[y].size(); ++x) {
      // Under an even sky every pixel of the plain is lit alike.
      ASSERT_NEAR(some[y][x].r, all[y][x].r, 1e-9) << x << ' ' << y;
    }
  }
}

TEST(Halton, FillsEvenly) {
  const Halton halton(3);
  for (int d = 0; d < 10; ++d) {
    double mean = 0;
    for (std::uint64_t i = 0; i < 4096; ++i) {
      const double x = halton.at(d, i);
      ASSERT_TRUE(x >= 0 && x < 1);
      mean += x / 4096;
    }
    // Star discrepancy of one dimension: below base * log(N) / N, 0.06 for base 29.
    EXPECT_NEAR(mean, 0.5, 0.02) << d;
  }
}

}  // namespace
}  // namespace haarlight
