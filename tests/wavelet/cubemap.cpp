// Cube map geometry: directions, texels and their solid angles.

#include "wavelet/cubemap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace haarlight {
namespace {

/// The corner formula in quadruple-like precision: a texel's solid angle is the sum over its
/// corners of +-atan2(u v, sqrt(1 + u^2 + v^2)). It loses about 1 / solid angle to cancellation, so
/// long double (2^-64) gives 2^-64 * 4 n^2 / (texel's share) = 2e-12 relative at n = 1024.
long double solid_angle_by_corners(int x, int y, int n) {
  const auto corner = [&](int i, int j) {
    const long double u = 2.0L * i / n - 1, v = 2.0L * j / n - 1;
    return std::atan2(u * v, std::sqrt(1 + u * u + v * v));
  };
  return corner(x + 1, y + 1) - corner(x, y + 1) - corner(x + 1, y) + corner(x, y);
}

TEST(Cubemap, SolidAnglesMatchTheCornerFormula) {
  for (const int n : {1, 2, 4, 16, 64, 256, 1024}) {
    const int step = std::max(1, n / 32);
    for (int y = 0; y < n; y += y + step < n ? step : 1) {
      for (int x = 0; x < n; x += x + step < n ? step : 1) {
        const long double exact = solid_angle_by_corners(x, y, n);
        const double error = static_cast<double>(cube_texel_solid_angle(x, y, n) / exact - 1);
        ASSERT_LE(std::abs(error), n <= 64 ? 2e-14 : 5e-12) << x << ", " << y << " of " << n;
      }
    }
  }
}

TEST(Cubemap, SolidAnglesCoverTheSphere) {
  for (const int n : {1, 2, 3, 8, 64, 512}) {
    const std::vector<double> face = cube_solid_angles(n);
    ASSERT_EQ(face.size(), static_cast<std::size_t>(n) * static_cast<std::size_t>(n));
    long double sum = 0;
    for (const double solid_angle : face) sum += solid_angle;
    // Each is right to some roundings.
    EXPECT_NEAR(static_cast<double>(6 * sum / (4 * std::numbers::pi_v<long double>)), 1, 1e-14)
        << n;
  }
}

TEST(Cubemap, SolidAnglesAreSymmetricToTheBit) {
  const int n = 16;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const double here = cube_texel_solid_angle(x, y, n);
      EXPECT_EQ(here, cube_texel_solid_angle(y, x, n));
      EXPECT_EQ(here, cube_texel_solid_angle(n - 1 - x, y, n));
    }
  }
}

TEST(Cubemap, FacesLieAsTheHeaderSays) {
  const Vec3 expected[6] = {{1, -0.5, -0.25}, {-1, -0.5, 0.25}, {0.25, 1, 0.5},
                            {0.25, -1, -0.5}, {0.25, -0.5, 1},  {-0.25, -0.5, -1}};
  for (int face = 0; face < 6; ++face) {
    const Vec3 d = cube_direction({face, 0.25, 0.5});
    EXPECT_NEAR(length(d - normalize(expected[face])), 0, 1e-15) << face;
    EXPECT_NEAR(length(d), 1, 1e-15);
  }
}

TEST(Cubemap, PointIsTheInverseOfDirection) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 20000; ++i) {
    const CubePoint p{i % 6, uniform(random), uniform(random)};
    const double scale = std::ldexp(1.0, i % 61 - 30);  // any length will do
    const CubePoint q = cube_point(cube_direction(p) * scale);
    ASSERT_EQ(q.face, p.face);
    // Normalising rounds each component by an ulp or two, dividing once more.
    ASSERT_NEAR(q.u, p.u, 1e-15);
    ASSERT_NEAR(q.v, p.v, 1e-15);
  }
}

// All 26 directions of faces, edges and corners, each component moved by an ulp either way.
TEST(Cubemap, EdgesAndCornersAreInRangeAndTakeTheLowerAxis) {
  const auto moved = [](double value, int ulps) {
    if (ulps == 0) return value;
    return std::nextafter(value, ulps > 0 ? 1e300 : -1e300);
  };
  int checked = 0;
  for (int code = 0; code < 27; ++code) {
    const Vec3 base{code % 3 - 1.0, code / 3 % 3 - 1.0, code / 9 - 1.0};
    if (base == Vec3{}) continue;
    for (int nudge = 0; nudge < 27; ++nudge) {
      const Vec3 d{moved(base.x, nudge % 3 - 1), moved(base.y, nudge / 3 % 3 - 1),
                   moved(base.z, nudge / 9 - 1)};
      const CubePoint p = cube_point(d);
      const double ax = std::abs(d.x), ay = std::abs(d.y), az = std::abs(d.z);
      const int axis = ax >= ay && ax >= az ? 0 : ay >= az ? 1 : 2;
      const double along = axis == 0 ? d.x : axis == 1 ? d.y : d.z;
      EXPECT_EQ(p.face, 2 * axis + (along > 0 ? 0 : 1));
      EXPECT_LE(std::abs(p.u), 1);
      EXPECT_LE(std::abs(p.v), 1);
      for (const int n : {1, 2, 64, 1024}) {
        const int x = cube_texel(p.u, n), y = cube_texel(p.v, n);
        EXPECT_TRUE(x >= 0 && x < n && y >= 0 && y < n) << x << ", " << y << " of " << n;
      }
      // And it is the right place: the direction comes back.
      EXPECT_NEAR(length(cube_direction(p) - normalize(d)), 0, 1e-15);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 26 * 27);
}

TEST(Cubemap, TexelsTileTheAxis) {
  for (const int n : {1, 2, 8, 1024}) {
    for (int i = 0; i < n; i += std::max(1, n / 16)) {
      const double left = 2.0 * i / n - 1;  // exact for powers of two
      EXPECT_EQ(cube_texel(left, n), i);
      EXPECT_EQ(cube_texel(left + 1.0 / n, n), i);
      // Just before the next one: 1 is added on the way, which rounds by 2^-53.
      EXPECT_EQ(cube_texel(left + 2.0 / n - 1e-15, n), i);
    }
    EXPECT_EQ(cube_texel(1, n), n - 1) << "the far edge belongs to the last texel";
    EXPECT_EQ(cube_texel(-1, n), 0);
  }
}

TEST(Cubemap, IndicesRunFaceRowColumn) {
  const int n = 4;
  std::size_t next = 0;
  for (int face = 0; face < 6; ++face) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        EXPECT_EQ(cube_index(face, x, y, n), next++);
        const CubePoint p = cube_point(cube_texel_center(face, x, y, n));
        EXPECT_EQ(p.face, face);
        EXPECT_EQ(cube_texel(p.u, n), x);
        EXPECT_EQ(cube_texel(p.v, n), y);
      }
    }
  }
  EXPECT_EQ(Cubemap(n).texels.size(), next);
}

}  // namespace
}  // namespace haarlight
