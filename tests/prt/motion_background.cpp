// What is drawn behind the scene is the light that relights it.

#include "prt/motion_background.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "prt/image_relighter.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

constexpr int kWidth = 48, kHeight = 32;

/// A transport that covers `coverage` of every pixel, seen by a camera looking at `target`.
Transport covering(float coverage, const Vec3& target) {
  fixtures::SmallTransport small = fixtures::small_transport(4, kWidth, kHeight, 1);
  small.info.camera = look_at({0, 0, 0}, target, 0.9, kWidth, kHeight);
  for (TileRows& tile : small.tiles) {
    if (!tile.coverage.empty()) tile.coverage.assign(kTileRows, coverage);
  }
  return build_transport(small.info, small.tiles, small.thresholds);
}

Environment constant(const Rgb& radiance) {
  Image picture(16, 8);
  for (Rgb& pixel : picture.pixels) pixel = radiance;
  return Environment(picture);
}

Environment random_environment(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  Image picture(32, 16);
  for (Rgb& pixel : picture.pixels) pixel = {uniform(random), uniform(random), uniform(random)};
  return Environment(picture);
}

MotionOptions motion(MotionKind kind) {
  MotionOptions options;
  options.kind = kind;
  options.stop = 8;
  return options;
}

TEST(MotionBackground, TurnedEnvironmentsAreDrawnTurned) {
  const Transport transport = covering(0.25f, {0, 0, -1});
  const Environment light = random_environment(2);
  for (const MotionKind kind :
       {MotionKind::still, MotionKind::rotate, MotionKind::tumble, MotionKind::swing}) {
    const MotionOptions options = motion(kind);
    Image drawn(kWidth, kHeight);
    composite_motion_background(transport, options, 5, light, nullptr, drawn);
    const Rotation back = motion_rotation(options, 5).transposed();
    for (int y = 0; y < kHeight; y += 7) {
      for (int x = 0; x < kWidth; x += 5) {
        const Vec3 seen = transport.info().camera.direction(x + 0.5, y + 0.5);
        const Rgb wanted = 0.75f * light.radiance(back * seen);
        EXPECT_LT(l1_norm(drawn.at(x, y) - wanted), 1e-6) << motion_name(kind);
      }
    }
  }
}

TEST(MotionBackground, ABlendIsTheWeightedSumAndAddsToThePicture) {
  const Transport transport = covering(0.5f, {1, 0.2, 0});
  const Environment a = random_environment(3), b = random_environment(4);
  for (const int frame : {0, 2, 8, 20}) {
    Image drawn(kWidth, kHeight);
    for (Rgb& pixel : drawn.pixels) pixel = {7, 8, 9};
    composite_motion_background(transport, motion(MotionKind::blend), frame, a, &b, drawn);
    const float t = static_cast<float>(std::min(frame, 8)) / 8;
    for (int y = 0; y < kHeight; y += 5) {
      for (int x = 0; x < kWidth; x += 5) {
        const Vec3 seen = transport.info().camera.direction(x + 0.5, y + 0.5);
        const Rgb wanted =
            Rgb{7, 8, 9} + 0.5f * ((1 - t) * a.radiance(seen) + t * b.radiance(seen));
        // Values up to 10 in float, a handful of roundings of 2^-24 each.
        EXPECT_LT(l1_norm(drawn.at(x, y) - wanted), 3 * 10 * 0x1p-21);
      }
    }
  }
}

TEST(MotionBackground, TheDiscIsDrawnWhereTheLightComesFrom) {
  const MotionOptions options = motion(MotionKind::light);
  const Environment dim = constant({1, 2, 3});
  Motion light(options, HaarLayout(64), dim);
  for (const int frame : {0, 3, 6}) {
    const Transport transport = covering(0, motion_disc_center(options, frame));
    Image drawn(kWidth, kHeight);
    composite_motion_background(transport, options, frame, dim, nullptr, drawn);
    // The lighting itself, looked up: equal but at the rim, which texels and pixels blur.
    const Cubemap& cubemap = light.cubemap(frame);
    const double rim = std::acos(kDiscCosine);
    int inside = 0, outside = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const Vec3 seen = transport.info().camera.direction(x + 0.5, y + 0.5);
        const double angle =
            std::acos(std::min(1.0, dot(seen, motion_disc_center(options, frame))));
        // Half diagonals: of a pixel 0.9 / 32 * 0.7 rad, of a texel at most sqrt(2) / 64 rad, of
        // which the looked-up one may lie as far again.
        if (std::abs(angle - rim) < 0.02 + 2 * 0.0222) continue;
        const CubePoint point = cube_point(seen);
        const Rgb wanted = cubemap.texels[cube_index(point.face, cube_texel(point.u, 64),
                                                     cube_texel(point.v, 64), 64)];
        EXPECT_LT(l1_norm(drawn.at(x, y) - wanted), 1e-4) << x << " " << y;
        (angle < rim ? inside : outside) += 1;
      }
    }
    EXPECT_GT(inside, 50);
    EXPECT_GT(outside, 50);
  }
}

TEST(MotionBackground, RefusesAnotherSizeAndABlendOfOne) {
  const Transport transport = covering(0, {0, 0, -1});
  const Environment light = constant({1, 1, 1});
  Image small(kWidth, kHeight - 1), right(kWidth, kHeight);
  EXPECT_THROW(
      composite_motion_background(transport, motion(MotionKind::still), 0, light, nullptr, small),
      Error);
  EXPECT_THROW(
      composite_motion_background(transport, motion(MotionKind::blend), 0, light, nullptr, right),
      Error);
}

}  // namespace
}  // namespace haarlight
