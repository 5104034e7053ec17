// The motions of the light: angles, ends, and that they rest.

#include "prt/motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/error.h"

namespace haarlight {
namespace {

constexpr MotionKind kAll[] = {MotionKind::still, MotionKind::rotate, MotionKind::tumble,
                               MotionKind::swing, MotionKind::blend,  MotionKind::light};

/// A sky that tells every direction from every other.
Environment sky(float seed) {
  Image image(64, 32);
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 64; ++x) {
      image.at(x, y) = {seed + static_cast<float>(x), 1 + static_cast<float>(y) * seed,
                        static_cast<float>((x * 7 + y * 13) % 11)};
    }
  }
  return Environment(image);
}

double difference(const Rotation& a, const Rotation& b) {
  double largest = 0;
  for (std::size_t i = 0; i < 3; ++i) largest = std::max(largest, length(a.row[i] - b.row[i]));
  return largest;
}

MotionOptions of(MotionKind kind, double degrees = 90, int stop = 99) {
  return {.kind = kind, .degrees = degrees, .stop = stop};
}

// t = frame / stop; angles written out from the definitions, at frames where they are known.
TEST(MotionRotation, FollowsTheDefinitions) {
  const double quarter = kPi / 2;
  EXPECT_LE(
      difference(motion_rotation(of(MotionKind::rotate, 90, 100), 50), rotation_y(quarter / 4)),
      1e-15);
  EXPECT_LE(difference(motion_rotation(of(MotionKind::rotate, 90, 100), 100), rotation_y(quarter)),
            1e-15);
  EXPECT_LE(difference(motion_rotation(of(MotionKind::rotate, 40, 100), 70),
                       rotation_y(40 * 0.49 * kPi / 180)),
            1e-15);
  // First about Y, then about X: a direction on +Y is not moved by the first.
  EXPECT_LE(difference(motion_rotation(of(MotionKind::tumble, 90, 100), 100),
                       rotation_x(1.6 * quarter) * rotation_y(2 * quarter)),
            1e-15);
  EXPECT_LE(length(motion_rotation(of(MotionKind::tumble, 90, 100), 50) * Vec3{0, 1, 0} -
                   rotation_x(0.4 * quarter) * Vec3{0, 1, 0}),
            1e-15);
  // sin(4 pi t) is 1 at t = 1/8, 0 at 1/4, -1 at 3/8.
  EXPECT_LE(
      difference(motion_rotation(of(MotionKind::swing, 90, 80), 10), rotation_y(0.4 * quarter)),
      1e-15);
  EXPECT_LE(difference(motion_rotation(of(MotionKind::swing, 90, 80), 20), Rotation{}), 1e-15);
  EXPECT_LE(
      difference(motion_rotation(of(MotionKind::swing, 90, 80), 30), rotation_y(-0.4 * quarter)),
      1e-15);
  for (const MotionKind kind : {MotionKind::still, MotionKind::blend, MotionKind::light}) {
    EXPECT_EQ(difference(motion_rotation(of(kind), 37), Rotation{}), 0);
  }
}

// Built from angles each time, a rotation is as orthonormal after a million frames as at first.
TEST(MotionRotation, StaysOrthonormal) {
  for (const MotionKind kind : {MotionKind::rotate, MotionKind::tumble, MotionKind::swing}) {
    const MotionOptions options = of(kind, 36000, 1000000);
    for (int frame = 0; frame <= 1000000; frame += 99991) {
      const Rotation r = motion_rotation(options, frame);
      // A product of two matrices of rounded sines: 3 additions of products, 2^-53 each.
      EXPECT_LE(difference(r * r.transposed(), Rotation{}), 1e-15) << frame;
    }
  }
}

TEST(MotionRotation, RestsAtStop) {
  for (const MotionKind kind : kAll) {
    const Rotation at_stop = motion_rotation(of(kind), 99);
    for (const int frame : {100, 130, 1000000}) {
      EXPECT_EQ(difference(motion_rotation(of(kind), frame), at_stop), 0);
    }
    EXPECT_EQ(difference(motion_rotation(of(kind), 0), Rotation{}), 0) << motion_name(kind);
  }
}

TEST(Motion, EveryFrameFromStopOnHasTheSameBits) {
  const HaarLayout layout(16);
  const Environment a = sky(3), b = sky(5);
  for (const MotionKind kind : kAll) {
    Motion motion(of(kind, 90, 10), layout, a, &b);
    const std::vector<Rgb> at_stop = motion.cubemap(10).texels;
    const auto c = motion.coefficients(10);
    const std::vector<Rgb> coefficients(c.begin(), c.end());
    motion.cubemap(3);
    EXPECT_TRUE(motion.cubemap(11).texels == at_stop) << motion_name(kind);
    motion.coefficients(0);
    const auto again = motion.coefficients(500);
    EXPECT_TRUE(std::vector<Rgb>(again.begin(), again.end()) == coefficients) << motion_name(kind);
    // And it did move before, but for still.
    EXPECT_EQ(motion.cubemap(3).texels == at_stop, kind == MotionKind::still) << motion_name(kind);
  }
}

TEST(Motion, CoefficientsAreTheTransformOfTheCubeMap) {
  const HaarLayout layout(8);
  const Environment a = sky(3), b = sky(5);
  for (const MotionKind kind : kAll) {
    Motion motion(of(kind), layout, a, &b);
    for (const int frame : {40, 0, 99, 40}) {
      // In both orders of asking.
      if (frame == 0) motion.cubemap(frame);
      const auto got = motion.coefficients(frame);
      std::vector<Rgb> wanted(got.size());
      haar_forward(layout, motion.cubemap(frame).texels, wanted);
      EXPECT_TRUE(std::vector<Rgb>(got.begin(), got.end()) == wanted) << motion_name(kind);
    }
  }
}

TEST(Motion, RotationsTurnTheEnvironment) {
  const HaarLayout layout(8);
  const Environment a = sky(3);
  for (const MotionKind kind : {MotionKind::rotate, MotionKind::tumble, MotionKind::swing}) {
    Motion motion(of(kind), layout, a);
    EXPECT_TRUE(motion.cubemap(60).texels ==
                environment_to_cubemap(a, 8, motion_rotation(of(kind), 60)).texels)
        << motion_name(kind);
  }
}

TEST(Motion, BlendGoesFromAToB) {
  const HaarLayout layout(8);
  const Environment a = sky(3), b = sky(5);
  Motion motion(of(MotionKind::blend, 90, 4), layout, a, &b);
  const Cubemap from = environment_to_cubemap(a, 8), to = environment_to_cubemap(b, 8);
  EXPECT_TRUE(motion.cubemap(0).texels == from.texels);
  EXPECT_TRUE(motion.cubemap(4).texels == to.texels);
  const Cubemap& between = motion.cubemap(1);
  for (std::size_t k = 0; k < from.texels.size(); ++k) {
    const float wanted = 0.75f * from.texels[k].g + 0.25f * to.texels[k].g;
    EXPECT_NEAR(between.texels[k].g, wanted, 1e-6f * (1 + wanted));
  }
}

// The disc covers 2 pi (1 - cosine) of the sphere, wherever it is.
TEST(Motion, TheDiscHasItsEnergyAndPlaceInEveryFrame) {
  const Environment black(Image(16, 8));
  const Vec3 axis{0.6, 0.64, 0.48};
  for (const int n : {1, 4, 64}) {
    Motion motion(of(MotionKind::light, 90, 20), HaarLayout(n), black);
    const std::vector<double> solid_angle = cube_solid_angles(n);
    for (int frame = 0; frame <= 20; ++frame) {
      const Cubemap& map = motion.cubemap(frame);
      double energy = 0;
      Vec3 moment;
      for (std::size_t k = 0; k < map.texels.size(); ++k) {
        const Rgb& texel = map.texels[k];
        ASSERT_TRUE(texel.r >= 0 && texel.r <= 50 && texel.r == texel.g && texel.g == texel.b);
        const auto face_texels = solid_angle.size();
        const int face = static_cast<int>(k / face_texels);
        const int inside = static_cast<int>(k % face_texels);
        const double light = static_cast<double>(texel.r) * solid_angle[k % face_texels];
        energy += light;
        moment = moment + cube_texel_center(face, inside % n, inside / n, n) * light;
      }
      // Samples stand in a grid of 512 (or 8 n) along a face: a rim texel errs by a sample's row
      // at most, and there are some hundreds of samples along the rim to average it.
      EXPECT_NEAR(energy / (50 * 2 * kPi * (1 - 0.97)), 1, 0.005) << n << ", frame " << frame;
      if (n == 64) {
        const Vec3 middle = motion_disc_center(motion.options(), frame);
        EXPECT_LE(length(normalize(moment) - middle), 0.003) << frame;
        EXPECT_NEAR(dot(middle, axis), std::cos(kPi / 6), 1e-14);
      }
    }
  }
}

TEST(Motion, TheDiscGoesOnceRoundOverADimmedSky) {
  const MotionOptions options = of(MotionKind::light, 90, 100);
  const Vec3 axis{0.6, 0.64, 0.48};
  // Steps of 1/100 turn, right-handed: each turns by 2 pi / 100 about the axis.
  double turned = 0;
  for (int frame = 0; frame < 100; ++frame) {
    const Vec3 a = motion_disc_center(options, frame), b = motion_disc_center(options, frame + 1);
    const Vec3 pa = a - axis * dot(a, axis), pb = b - axis * dot(b, axis);
    turned += std::atan2(dot(cross(pa, pb), axis), dot(pa, pb));
  }
  EXPECT_NEAR(turned, 2 * kPi, 1e-12);
  EXPECT_GT(motion_disc_center(options, 0).y, motion_disc_center(options, 50).y);
  EXPECT_LE(length(motion_disc_center(options, 100) - motion_disc_center(options, 0)), 1e-14);

  Image white(16, 8);
  for (Rgb& p : white.pixels) p = {10, 20, 30};
  Motion motion(options, HaarLayout(16), Environment(white));
  const Cubemap& map = motion.cubemap(0);
  const CubePoint away = cube_point(-motion_disc_center(options, 0));
  const Rgb dark =
      map.texels[cube_index(away.face, cube_texel(away.u, 16), cube_texel(away.v, 16), 16)];
  EXPECT_NEAR(dark.r, 0.2f, 1e-6f);
  EXPECT_NEAR(dark.b, 0.6f, 1e-6f);
  const CubePoint lit = cube_point(motion_disc_center(options, 0));
  EXPECT_NEAR(map.texels[cube_index(lit.face, cube_texel(lit.u, 16), cube_texel(lit.v, 16), 16)].g,
              50.4f, 1e-5f);
}

TEST(Motion, NamesAndErrors) {
  for (const MotionKind kind : kAll) EXPECT_EQ(motion_from_name(motion_name(kind)), kind);
  EXPECT_EQ(motion_from_name("Rotate"), std::nullopt);
  EXPECT_EQ(motion_from_name(""), std::nullopt);

  const HaarLayout layout(4);
  const Environment a = sky(3);
  EXPECT_THROW(Motion(of(MotionKind::blend), layout, a), Error);
  EXPECT_THROW(Motion(of(MotionKind::rotate, 90, 0), layout, a), Error);
  EXPECT_THROW(Motion(of(MotionKind::rotate, std::nan("")), layout, a), Error);
  EXPECT_THROW(motion_rotation(of(MotionKind::rotate, 90, -1), 0), Error);
  Motion motion(of(MotionKind::rotate), layout, a);
  EXPECT_THROW(motion.cubemap(-1), Error);
  EXPECT_THROW(motion_rotation(of(MotionKind::rotate), -1), Error);
}

}  // namespace
}  // namespace haarlight
