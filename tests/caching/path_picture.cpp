// Path tracing of moving scenes: furnaces and closed forms.

#include "caching/path_picture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/caching/estimate.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

AnimatedFrame frame_of(Scene scene) {
  AnimatedFrame frame;
  frame.emission.resize(scene.material.size());
  frame.scene = std::move(scene);
  return frame;
}

TEST(PathPicture, ClosedBoxThatShinesIsAFurnace) {
  // Inside a closed box of albedo a whose walls send E: L = E / (1 - a) everywhere.
  Scene scene = shapes::empty_scene();
  shapes::add_box(scene, {-1, -1, -1}, {1, 1, 1});
  scene.material[0].albedo = {0.5f, 0.5f, 0.5f};
  AnimatedFrame frame = frame_of(scene);
  frame.emission[0] = {{0.3, 0.3, 0.3}, true};
  const FrameTracer tracer(frame);
  const Estimate found = estimate(77, 20000, [&](PathRandom& random) {
    const Vec3 way = cosine_direction({0, 1, 0}, random.next(), random.next());
    return tracer.radiance({0, 0, 0}, way, random).g;
  });
  // Five standard errors: a chance of 6e-7 of failing.
  EXPECT_NEAR(found.mean, 0.6, 5 * found.error) << "+- " << found.error;
  EXPECT_LT(found.error, 0.01);
}

TEST(PathPicture, WhiteBodiesVanishInEvenLight) {
  // Albedo 1 under a background of 1: 1 everywhere; glass likewise, since nothing is lost in it.
  for (const SurfaceModel model : {SurfaceModel::phong, SurfaceModel::glass}) {
    Scene scene = shapes::empty_scene();
    shapes::add_sphere(scene, {0, 0, 0}, 1, 3);
    scene.material[0].model = model;
    scene.material[0].albedo = {1, 1, 1};
    AnimatedFrame frame = frame_of(scene);
    frame.background = {1, 1, 1};
    const FrameTracer tracer(frame);
    for (const double x : {0.0, 0.3, 0.9}) {
      const Estimate found = estimate(77, 2000, [&](PathRandom& random) {
        return tracer.radiance({x, 0, 3}, {0, 0, -1}, random).r;
      });
      // A smooth normal over a flat triangle turns a few paths into the body: 1 % of room.
      EXPECT_NEAR(found.mean, 1, 0.01 + 5 * found.error) << x;
    }
  }
}

// A square of Lambert albedo `a` at y = 0 under whatever is added to it.
Scene floor_scene(float a) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-4, 0, 4}, {8, 0, 0}, {0, 0, -8});
  scene.material[0].albedo = {a, a, a};
  return scene;
}

TEST(PathPicture, PointLightOverAPlaneIsTheClosedForm) {
  AnimatedFrame frame = frame_of(floor_scene(0.8f));
  SceneLight light;
  light.position = {0.5, 2, 0};
  light.intensity = {10, 10, 10};
  frame.light.push_back(light);
  const FrameTracer tracer(frame);
  PathRandom random(1);
  const Vec3 eye{0, 3, 0};
  const double found = tracer.radiance(tracer.visibility().to_local(eye), {0, -1, 0}, random).r;
  // L = albedo / pi * I cos / d^2; no noise, floats of the vertices alone.
  const double d2 = 0.25 + 4, wanted = 0.8 / kPi * 10 * (2 / std::sqrt(d2)) / d2;
  EXPECT_NEAR(found, wanted, 1e-5 * wanted);
}

TEST(PathPicture, AreaLightOverAPlaneIsTheClosedForm) {
  // A small square of side s at height h, facing down, above the point: form factor s^2 / (pi h^2)
  // to s^2 / h^2 of itself; exact for a square by Lambert's formula for polygons.
  Scene scene = floor_scene(0.6f);
  scene.material.emplace_back();
  scene.material[1].albedo = {0, 0, 0};
  const double s = 0.5, h = 1.5;
  shapes::add_quad(scene, {-s / 2, h, -s / 2}, {s, 0, 0}, {0, 0, s}, 1);  // faces down
  AnimatedFrame frame = frame_of(scene);
  frame.emission[1].radiance = {7, 7, 7};
  const FrameTracer tracer(frame);
  // E = L sum over edges of angle * cos / 2: four equal edges.
  const Vec3 a{-s / 2, h, -s / 2}, b{s / 2, h, -s / 2};
  const double angle = std::acos(dot(normalize(a), normalize(b)));
  const double tilt = std::abs(normalize(cross(a, b)).y);
  const double wanted = 0.6 / kPi * 7 * 0.5 * 4 * angle * tilt;
  const Vec3 direction = normalize(Vec3{0, -1, -0.4});
  const Vec3 eye = tracer.visibility().to_local(direction * -1.3);
  for (const bool all : {true, false}) {
    const Estimate found = estimate(77, 20000, [&](PathRandom& random) {
      if (all) return tracer.radiance(eye, direction, random).r;
      const auto hit = surface_hit(frame.scene, tracer.visibility(), eye, direction);
      return tracer.direct(*hit, bsdf_at(frame.scene, *hit), random, false).r;
    });
    EXPECT_NEAR(found.mean, wanted, 5 * found.error + 1e-5) << "all bounces: " << all;
    EXPECT_LT(found.error, 0.01 * wanted);
  }
  // From behind it sends nothing.
  PathRandom random(3);
  EXPECT_EQ(tracer.radiance(tracer.visibility().to_local({0, 3, 0}), {0, -1, 0}, random).r, 0);
}

TEST(PathPicture, SameBitsOnAnyNumberOfThreads) {
  Scene scene = floor_scene(0.6f);
  shapes::add_sphere(scene, {0, 1, 0}, 0.5, 2);
  scene.camera = look_at({0, 2, 5}, {0, 0.5, 0}, 0.7, 32, 24);
  AnimatedFrame frame = frame_of(scene);
  frame.background = {1, 0.9, 0.8};
  const FrameTracer tracer(frame);
  const int before = thread_count();
  set_thread_count(1);
  const Image one = path_picture(tracer, {32, 24, 4, 1});
  set_thread_count(3);
  const Image three = path_picture(tracer, {32, 24, 4, 1});
  set_thread_count(before);
  EXPECT_EQ(one.pixels, three.pixels);
}

TEST(PathPicture, StopsWhenTold) {
  Scene scene = floor_scene(0.6f);
  scene.camera = look_at({0, 2, 5}, {0, 0.5, 0}, 0.7, 32, 24);
  const AnimatedFrame frame = frame_of(scene);
  const FrameTracer tracer(frame);
  EXPECT_THROW(path_picture(tracer, {32, 24, 1, 1}, [](double) { return false; }), Error);
}

}  // namespace
}  // namespace haarlight
