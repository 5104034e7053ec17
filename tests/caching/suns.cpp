// Small suns of a picture: their energy, and pictures by few directions against paths.

#include "caching/suns.h"

#include <gtest/gtest.h>

#include <cmath>

#include "caching/interleaved_gather.h"
#include "caching/path_picture.h"
#include "caching/virtual_lights.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

// A grey-blue sky with a sun `wide` pixels wide and `high` ones high, 0.7 degrees each, `top`
// pixels from the top.
std::shared_ptr<const EnvironmentLight> sky(int wide, int high, float sun, int top = 80) {
  Image picture(512, 256);
  for (Rgb& p : picture.pixels) p = {0.2f, 0.25f, 0.4f};
  const int left = wide < 512 ? 300 : 0;
  for (int y = top; y < top + high; ++y) {
    for (int x = left; x < left + wide; ++x) picture.at(x, y) = {sun, 0.9f * sun, 0.7f * sun};
  }
  return std::make_shared<const EnvironmentLight>(Environment(picture));
}

// By midpoints over the sphere, so many that a pixel has 8 x 8.
RgbD irradiance(const Vec3& normal, const auto& radiance) {
  constexpr int kTurns = 4096, kHeights = 2048;
  RgbD sum;
  for (int j = 0; j < kHeights; ++j) {
    const double y = std::cos(kPi * (j + 0.5) / kHeights), ring = std::sqrt(1 - y * y);
    const double solid_angle = 2 * kPi * kPi * ring / kTurns / kHeights;
    for (int k = 0; k < kTurns; ++k) {
      const double phi = 2 * kPi * (k + 0.5) / kTurns;
      const Vec3 w{ring * std::sin(phi), y, ring * std::cos(phi)};
      const double cosine = dot(w, normal);
      if (cosine > 0) sum += radiance(w) * (cosine * solid_angle);
    }
  }
  return sum;
}

TEST(Suns, TakeWhatTheRestIsWithout) {
  const auto light = sky(2, 2, 3000);
  ASSERT_EQ(light->suns().size(), 1u);
  const Suns::Sun& sun = light->suns()[0];
  const Vec3 normal = normalize(Vec3{0.3, 1, -0.2});
  const double cosine = dot(sun.from, normal);
  ASSERT_GT(cosine, 0.2);
  const RgbD all = irradiance(normal, [&](const Vec3& w) { return light->radiance(w); });
  const RgbD rest =
      irradiance(normal, [&](const Vec3& w) { return light->radiance_without_suns(w); });
  // Looks of cells are a twelfth of a bilinear pixel wide: 1e-3 of its light; and one direction for
  // 2 degrees, second order: 2e-4.
  EXPECT_NEAR(rest.g + sun.irradiance.g * cosine, all.g, 3e-3 * all.g);
  EXPECT_NEAR(rest.b + sun.irradiance.b * cosine, all.b, 3e-3 * all.b);
  EXPECT_GT(sun.irradiance.g * cosine, 0.3 * all.g);
  // What is left of it is no brighter than it may be.
  double mean = 0;
  for (const Vec3& w : {Vec3{1, 0, 0}, Vec3{0, 0, 1}}) mean += luminance(light->radiance(w)) / 2;
  EXPECT_LT(luminance(light->radiance_without_suns(sun.from)), 40 * mean);
  EXPECT_GT(luminance(light->radiance(sun.from)), 4000 * mean);
}

TEST(Suns, AreSmallAndBright) {
  EXPECT_TRUE(sky(2, 2, 1)->suns().empty());           // five times the sky
  EXPECT_TRUE(sky(60, 60, 3000)->suns().empty());      // a window of 42 degrees
  EXPECT_EQ(sky(512, 2, 3000, 0)->suns().size(), 1u);  // about the pole, in all columns
}

TEST(Suns, PictureByFewDirectionsIsThatOfPaths) {
  // A floor, a wall beside it and a box on it: light straight from the sun, its shadow, and what
  // the sunny floor sends to the wall.
  AnimatedFrame frame;
  Scene& scene = frame.scene;
  scene = shapes::empty_scene();
  scene.material[0].albedo = {0.7f, 0.7f, 0.7f};
  shapes::add_quad(scene, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2});
  shapes::add_quad(scene, {-1, 0, -1}, {2, 0, 0}, {0, 1.5, 0});
  shapes::add_box(scene, {-0.5, 0.01, -0.5}, {0, 0.5, 0});
  frame.emission.resize(1);
  scene.camera = look_at({0.5, 1.3, 3}, {0, 0.4, -0.3}, 0.6, 32, 24);
  frame.environment = sky(2, 2, 3000);
  frame.environment_turn = rotation_y(2.4);
  const FrameTracer tracer(frame);
  PathPictureOptions options;
  options.width = 32, options.height = 24, options.samples = 256, options.centred = true;
  const Image paths = path_picture(tracer, options);

  MovingVisibility visibility(std::vector<std::uint32_t>(scene.triangle.size(), 0));
  visibility.next(frame);
  Image few;
  std::vector<SurfaceRow> rows;
  surface_points(visibility, *scene.camera, {}, few, rows);
  double direct = 0, whole = 0, wanted = 0, off = 0;
  for (const Rgb& c : few.pixels) direct += static_cast<double>(c.g);
  std::vector<std::vector<RgbD>> indirect;
  interleaved_gather(visibility, virtual_lights(visibility, {1024, 4, 1}), rows, {1, 0.01, 1},
                     indirect);
  for (int y = 0; y < 24; ++y) {
    const SurfaceRow& row = rows[static_cast<std::size_t>(y)];
    for (int x = 0; x < 32; ++x) {
      double sum = static_cast<double>(few.at(x, y).g);
      for (std::size_t i = row.first[static_cast<std::size_t>(x)];
           i < row.first[static_cast<std::size_t>(x) + 1]; ++i) {
        sum += row.point[i].weight.g * indirect[static_cast<std::size_t>(y)][i].g;
      }
      const double truth = static_cast<double>(paths.at(x, y).g);
      whole += sum, wanted += truth, off += std::abs(sum - truth);
    }
  }
  EXPECT_GT(direct, 0.3 * wanted);  // most of it comes straight from the sun, or is seen
  // 32 to 64 lights of each kind: a few per cent, all pixels alike; penumbras but on edges.
  EXPECT_NEAR(whole, wanted, 0.04 * wanted);
  EXPECT_LT(off, 0.08 * wanted);
}

}  // namespace
}  // namespace haarlight
