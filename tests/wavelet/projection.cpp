// Which pixel is which direction, for every projection.

#include "wavelet/projection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace haarlight {
namespace {

constexpr Projection kAll[] = {Projection::latlong, Projection::angular,
                               Projection::vertical_cross};
constexpr Vec3 kRight{1, 0, 0}, kLeft{-1, 0, 0}, kUp{0, 1, 0}, kDown{0, -1, 0}, kBack{0, 0, 1},
    kFront{0, 0, -1};

struct Place {
  Vec3 direction;
  double u, v;
};

// The six directions, read off the header's description of each layout.
void expect_places(Projection projection, const std::vector<Place>& places) {
  for (const Place& place : places) {
    const PicturePoint p = projection_point(projection, place.direction * 3);
    EXPECT_NEAR(p.u, place.u, 1e-15) << projection_name(projection);
    EXPECT_NEAR(p.v, place.v, 1e-15) << projection_name(projection);
    const auto back = projection_direction(projection, place.u, place.v);
    ASSERT_TRUE(back.has_value());
    EXPECT_NEAR(length(*back - place.direction), 0, 1e-15) << projection_name(projection);
  }
}

TEST(Projection, LatlongAxes) {
  expect_places(Projection::latlong,
                {{kFront, 0.5, 0.5}, {kRight, 0.75, 0.5}, {kLeft, 0.25, 0.5}, {kBack, 1, 0.5}});
  for (const double u : {0.0, 0.3, 1.0}) {
    EXPECT_NEAR(length(*projection_direction(Projection::latlong, u, 0) - kUp), 0, 1e-15);
    EXPECT_NEAR(length(*projection_direction(Projection::latlong, u, 1) - kDown), 0, 1e-15);
  }
  EXPECT_EQ(projection_point(Projection::latlong, kUp).v, 0);
  EXPECT_EQ(projection_point(Projection::latlong, kDown).v, 1);
  EXPECT_NEAR(length(*projection_direction(Projection::latlong, 0, 0.5) - kBack), 0, 1e-15)
      << "the left border is +Z as well";
}

TEST(Projection, AngularAxes) {
  expect_places(Projection::angular, {{kFront, 0.5, 0.5},
                                      {kRight, 0.75, 0.5},
                                      {kLeft, 0.25, 0.5},
                                      {kUp, 0.5, 0.25},
                                      {kDown, 0.5, 0.75}});
  for (int i = 0; i < 12; ++i) {
    const double a = 2 * kPi * i / 12;
    EXPECT_NEAR(length(*projection_direction(Projection::angular, 0.5 + 0.5 * std::cos(a),
                                             0.5 + 0.5 * std::sin(a)) -
                       kBack),
                0, 1e-8)
        << "the whole rim is +Z";
  }
  EXPECT_FALSE(projection_direction(Projection::angular, 0.01, 0.01).has_value());
}

TEST(Projection, VerticalCrossAxes) {
  expect_places(Projection::vertical_cross, {{kFront, 0.5, 1.5 / 4},
                                             {kRight, 2.5 / 3, 1.5 / 4},
                                             {kLeft, 0.5 / 3, 1.5 / 4},
                                             {kUp, 0.5, 0.5 / 4},
                                             {kDown, 0.5, 2.5 / 4},
                                             {kBack, 0.5, 3.5 / 4}});
  for (const double u : {0.1, 0.9}) {
    for (const double v : {0.1, 0.6, 0.9}) {
      EXPECT_FALSE(projection_direction(Projection::vertical_cross, u, v).has_value());
    }
  }
}

// Seen from inside, right of a place is clockwise of it about its own direction's up: going right
// and then down turns as x and y of the picture do. With a mirrored layout the sign would flip.
TEST(Projection, NothingIsMirrored) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  const double h = 1e-5;
  for (const Projection projection : kAll) {
    int checked = 0;
    while (checked < 2000) {
      const double u = uniform(random), v = uniform(random);
      const auto here = projection_direction(projection, u, v);
      const auto right = projection_direction(projection, u + h, v);
      const auto below = projection_direction(projection, u, v + h);
      if (!here || !right || !below) continue;
      // Not over a fold of the cross, where right of a face may be nothing near.
      if (length(*right - *here) > 1e-3 || length(*below - *here) > 1e-3) continue;
      const double turn = dot(cross(*right - *here, *below - *here), *here);
      EXPECT_GT(turn, 0) << projection_name(projection) << " at " << u << ", " << v;
      ++checked;
    }
  }
  // The same at the middle by hand: +X lies right of -Z, and -Y below.
  EXPECT_GT(dot(cross(kRight, kDown), kFront), 0);
}

TEST(Projection, PointAndDirectionAreInverse) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  for (const Projection projection : kAll) {
    for (int i = 0; i < 20000; ++i) {
      const Vec3 d = normalize({normal(random), normal(random), normal(random)});
      const PicturePoint p = projection_point(projection, d);
      ASSERT_TRUE(p.u >= 0 && p.u <= 1 && p.v >= 0 && p.v <= 1);
      const auto back = projection_direction(projection, p.u, p.v);
      ASSERT_TRUE(back.has_value());
      // (u, v) round to 1e-16, and angles are 2 pi times that; near the rim of an angular map
      // nothing worse, as the tangential scale only shrinks.
      ASSERT_NEAR(length(*back - d), 0, 5e-15) << projection_name(projection);
    }
  }
}

TEST(Projection, EdgesAndCornersOfTheCubeStayInThePicture) {
  for (const Projection projection : kAll) {
    for (int code = 0; code < 27; ++code) {
      const Vec3 d{code % 3 - 1.0, code / 3 % 3 - 1.0, code / 9 - 1.0};
      if (d == Vec3{}) continue;
      const PicturePoint p = projection_point(projection, d);
      const auto back = projection_direction(projection, p.u, p.v);
      ASSERT_TRUE(back.has_value()) << projection_name(projection) << " " << code;
      EXPECT_NEAR(length(*back - normalize(d)), 0, 1e-8) << projection_name(projection);
    }
  }
}

// Walking down the middle column of the cross goes over +Y, -Z, -Y and +Z without a jump, and along
// its row over -X, -Z and +X.
TEST(Projection, TheCrossFoldsWithoutJumps) {
  const auto walk = [](bool down) {
    Vec3 last;
    const int steps = 4000;  // a face of the cross has a quarter or a third of them
    for (int i = 0; i <= steps; ++i) {
      const double t = static_cast<double>(i) / steps;
      const auto d = down ? projection_direction(Projection::vertical_cross, 0.5, t)
                          : projection_direction(Projection::vertical_cross, t, 1.5 / 4);
      ASSERT_TRUE(d.has_value());
      // A face is 2 wide and at least 1000 steps long, and projecting onto the sphere shortens.
      EXPECT_LE(i == 0 ? 0 : length(*d - last), 2e-3 + 1e-9) << i;
      last = *d;
    }
  };
  walk(true);
  walk(false);
}

TEST(Projection, ShapesAndNames) {
  EXPECT_EQ(projection_of_shape(1024, 512), Projection::latlong);
  EXPECT_EQ(projection_of_shape(600, 600), Projection::angular);
  EXPECT_EQ(projection_of_shape(768, 1024), Projection::vertical_cross);
  EXPECT_EQ(projection_of_shape(1024, 768), std::nullopt);
  EXPECT_EQ(projection_of_shape(1023, 512), std::nullopt);
  EXPECT_EQ(projection_of_shape(0, 0), std::nullopt);
  EXPECT_EQ(projection_of_shape(2000000000, 1000000000), Projection::latlong);
  for (const Projection projection : kAll) {
    EXPECT_EQ(projection_from_name(projection_name(projection)), projection);
  }
  EXPECT_EQ(projection_name(Projection::vertical_cross), "vertical-cross");
  EXPECT_EQ(projection_from_name("LatLong"), std::nullopt);
}

}  // namespace
}  // namespace haarlight
