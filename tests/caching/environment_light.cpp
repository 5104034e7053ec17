// A picture as light of scenes that move: furnaces, a constant background, closed forms.

#include "caching/environment_light.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "caching/frame_tracer.h"
#include "caching/hemisphere.h"
#include "caching/reprojection.h"
#include "tests/caching/estimate.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

// Lat-long, `low` all over, `high` in a patch of `patch` pixels squared above the horizon on +X.
std::shared_ptr<const EnvironmentLight> picture_light(float low, float high, int patch = 2) {
  Image picture(64, 32);
  for (Rgb& p : picture.pixels) p = {low, low, low};
  // u = 3/4 is +X; the middle of the patch is a quarter turn below the top's and the horizon's
  // mean.
  for (int y = 8 - patch / 2; y < 8 + patch / 2; ++y) {
    for (int x = 48 - patch / 2; x < 48 + patch / 2; ++x) picture.at(x, y) = {high, high, high};
  }
  return std::make_shared<const EnvironmentLight>(Environment(picture));
}

Vec3 any_direction(PathRandom& random) {
  const double y = 2 * random.next() - 1, turn = 2 * kPi * random.next();
  const double ring = std::sqrt(1 - y * y);
  return {ring * std::sin(turn), y, ring * std::cos(turn)};
}

TEST(EnvironmentLight, ChancesAreADensityAndSamplesHaveIt) {
  const auto light = picture_light(0.1f, 500);
  // The integral of the density over all directions is 1.
  const Estimate whole = estimate(
      41, 200'000, [&](PathRandom& random) { return light->pdf(any_direction(random)) * 4 * kPi; });
  EXPECT_NEAR(whole.mean, 1, 5 * whole.error);
  // Of all samples as many fall on the patch as its density says, and each bears its own.
  const auto on_patch = [](const Vec3& d) { return d.x > 0.6 && d.y > 0.6; };
  const Estimate wanted = estimate(41, 200'000, [&](PathRandom& random) {
    const Vec3 d = any_direction(random);
    return on_patch(d) ? light->pdf(d) * 4 * kPi : 0;
  });
  const Estimate found = estimate(41, 20'000, [&](PathRandom& random) {
    const double u = random.next(), v = random.next();
    const auto sample = light->sample(u, v);
    EXPECT_NEAR(sample.pdf, light->pdf(sample.from), 1e-9 * sample.pdf);
    EXPECT_NEAR(length(sample.from), 1, 1e-12);
    return on_patch(sample.from) ? 1.0 : 0.0;
  });
  EXPECT_NEAR(found.mean, wanted.mean, 5 * (found.error + wanted.error));
  EXPECT_GT(found.mean, 0.5);  // it is where the light is
}

TEST(EnvironmentLight, WhiteBodiesVanishInAnEvenPicture) {
  for (const SurfaceModel model : {SurfaceModel::phong, SurfaceModel::glass}) {
    Scene scene = shapes::empty_scene();
    shapes::add_sphere(scene, {0, 0, 0}, 1, 3);
    scene.material[0].model = model;
    scene.material[0].albedo = {1, 1, 1};
    AnimatedFrame frame;
    frame.scene = scene, frame.emission.resize(1);
    frame.environment = picture_light(1, 1);
    frame.environment_turn = rotation_y(0.4);
    const FrameTracer tracer(frame);
    for (const double x : {0.0, 0.3, 0.9}) {
      const Estimate found = estimate(41, 2000, [&](PathRandom& random) {
        return tracer.radiance({x, 0, 3}, {0, 0, -1}, random).r;
      });
      // A smooth normal over a flat triangle turns a few paths into the body: 1 % of room.
      EXPECT_NEAR(found.mean, 1, 0.01 + 5 * found.error) << x;
    }
  }
}

// A grey floor with a grey ball and a shiny one on it.
AnimatedFrame still_life() {
  AnimatedFrame frame;
  Scene& scene = frame.scene;
  scene = shapes::empty_scene();
  scene.material[0].albedo = {0.6f, 0.6f, 0.6f};
  scene.material.push_back(scene.material[0]);
  scene.material[1].model = SurfaceModel::metallic_roughness;
  scene.material[1].metallic = 1, scene.material[1].roughness = 0.3f;
  shapes::add_quad(scene, {-4, 0, 4}, {8, 0, 0}, {0, 0, -8});
  shapes::add_sphere(scene, {-0.5, 0.5, 0}, 0.5, 2);
  const std::size_t first = scene.triangle.size();
  shapes::add_sphere(scene, {0.6, 0.5, 0}, 0.5, 2);
  for (std::size_t t = first; t < scene.triangle.size(); ++t) scene.triangle[t].material = 1;
  frame.emission.resize(2);
  return frame;
}

TEST(EnvironmentLight, AnEvenPictureIsAConstantBackground) {
  AnimatedFrame picture = still_life(), constant = still_life();
  picture.environment = picture_light(0.7f, 0.7f);
  const double level = static_cast<double>(0.7f);
  constant.background = {level, level, level};
  const FrameTracer by_picture(picture), by_constant(constant);
  const Vec3 eye = by_picture.visibility().to_local({0, 1.5, 4});
  for (const Vec3& aim : {Vec3{-0.5, 0.3, 0}, Vec3{0.6, 0.6, 0}, Vec3{0, 0, 0.4}}) {
    const Vec3 way = normalize(by_picture.visibility().to_local(aim) - eye);
    const auto of = [&](const FrameTracer& tracer) {
      return estimate(41, 8000,
                      [&](PathRandom& random) { return tracer.radiance(eye, way, random).g; });
    };
    const Estimate a = of(by_picture), b = of(by_constant);
    // Five standard errors of the difference: a chance of 6e-7 of failing.
    EXPECT_NEAR(a.mean, b.mean, 5 * std::hypot(a.error, b.error) + 1e-6);
    EXPECT_GT(b.mean, 0.05);
  }
}

TEST(EnvironmentLight, APatchOverAPlaneIsItsIntegralAndTurns) {
  // A floor under a bright patch: L = albedo / pi times the integral of radiance times cosine,
  // which is the floor's whatever way the patch has turned about +Y. A wall is lit from one side.
  AnimatedFrame frame;
  frame.scene = shapes::empty_scene();
  frame.scene.material[0].albedo = {0.5f, 0.5f, 0.5f};
  shapes::add_quad(frame.scene, {-4, 0, 4}, {8, 0, 0}, {0, 0, -8});
  frame.emission.resize(1);
  frame.environment = picture_light(0, 1000);
  double wanted = 0;
  constexpr int kSteps = 1200;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < 2 * kSteps; ++j) {
      const double y = (i + 0.5) / kSteps, turn = kPi * (j + 0.5) / kSteps,
                   ring = std::sqrt(1 - y * y);
      const Vec3 d{ring * std::sin(turn), y, ring * std::cos(turn)};
      wanted += frame.environment->radiance(d).r * y * (kPi / kSteps / kSteps);
    }
  }
  wanted *= 0.5 / kPi;
  for (const double turn : {0.0, 1.0}) {
    frame.environment_turn = rotation_y(turn);
    const FrameTracer tracer(frame);
    const Vec3 eye = tracer.visibility().to_local({0.3, 2, 0.2});
    const auto hit = surface_hit(frame.scene, tracer.visibility(), eye, {0, -1, 0});
    ASSERT_TRUE(hit);
    const Bsdf bsdf = bsdf_at(frame.scene, *hit);
    for (const bool all : {true, false}) {
      const Estimate found = estimate(41, 20'000, [&](PathRandom& random) {
        if (all) return tracer.radiance(eye, {0, -1, 0}, random).r;
        return tracer.environment_light(*hit, bsdf, random, false).r;
      });
      // The quadrature has cells of 1/19 of a pixel: 0.2 % of room.
      EXPECT_NEAR(found.mean, wanted, 5 * found.error + 0.002 * wanted) << turn << all;
      EXPECT_LT(found.error, 0.02 * wanted);
    }
    // The patch comes from +X turned by `turn`: rotation_y takes +Z to +X.
    const Vec3 middle = rotation_y(turn) * normalize(Vec3{1, 1, 0});
    EXPECT_GT(frame.background_from(middle).r, 500);
    EXPECT_EQ(frame.background_from(rotation_y(2) * middle).r, 0);
  }
}

// The irradiance of a place whose normal is up by the picture turned about +Y: only light from
// above counts, so that turning it does not change it; by midpoints over the upper half.
double irradiance_of(const EnvironmentLight& light, const Vec3& normal) {
  constexpr int kHeights = 600, kTurns = 2400;
  double sum = 0;
  for (int j = 0; j < kHeights; ++j) {
    for (int k = 0; k < kTurns; ++k) {
      const double y = (j + 0.5) / kHeights, ring = std::sqrt(1 - y * y),
                   phi = 2 * kPi * k / kTurns;
      const Vec3 w{ring * std::sin(phi), y, ring * std::cos(phi)};
      sum += light.radiance(w).g * std::max(dot(w, normal), 0.0) * 2 * kPi / kHeights / kTurns;
    }
  }
  return sum;
}

TEST(EnvironmentLight, RecordsSeeASmallSun) {
  AnimatedFrame now;
  now.scene = shapes::empty_scene();
  shapes::add_quad(now.scene, {-3, 0, 3}, {6, 0, 0}, {0, 0, -6});
  now.emission.resize(1);
  now.environment = picture_light(0.1f, 5000);
  AnimatedFrame next = now;
  next.environment_turn = rotation_y(0.4);
  const FrameTracer tracer(now);
  const FrameChange change(now, next);
  const BodyPlace place{0, 0, 0.5, true};
  const PlaceFrame at = place_in(now.scene, place);
  const double wanted = irradiance_of(*now.environment, {0, 1, 0});
  constexpr int kRecords = 100;
  double later = 0;
  const Estimate found = estimate(13, kRecords, [&](PathRandom& random) {
    const auto key = static_cast<std::uint64_t>(random.next() * 1e15);
    Hemisphere h = stratified_hemisphere(400, key);
    std::vector<SeenPlace> seen;
    gather_hemisphere(tracer, at, key, h, &seen);
    later += record_value(reprojected(h, seen, place, change)).irradiance.g / kRecords;
    return record_value(h).irradiance.g;
  });
  // Midpoints resolve the bilinear patch to 1e-3.
  EXPECT_NEAR(found.mean, wanted, 4 * found.error + 2e-3 * wanted);
  // The patch is under 2 % of the hemisphere: strata alone would spread by 40 %.
  EXPECT_LT(found.error * std::sqrt(kRecords), 0.05 * wanted);
  // Turned about the normal the sun gives the same light from elsewhere.
  EXPECT_NEAR(later, wanted, 4 * found.error + 5e-3 * wanted);
}

}  // namespace
}  // namespace haarlight
