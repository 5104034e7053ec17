// Polygons keep their area and their shape when cut into triangles.

#include "precompute/polygon.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "core/vec.h"

namespace haarlight {
namespace {

// Sum of triangle areas along the polygon's own area vector: overlaps or flips would show.
double cut_area(const std::vector<Vec3>& corners, bool absolute) {
  Vec3 whole;
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    whole = whole + cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
  }
  const Vec3 axis = normalize(whole);
  double area = 0;
  for (const auto& [a, b, c] : triangulate(corners)) {
    const double part = 0.5 * dot(axis, cross(corners[b] - corners[a], corners[c] - corners[a]));
    area += absolute ? std::abs(part) : part;
  }
  return area;
}

TEST(Polygon, NonConvexKeepsItsAreaInAnyOrientation) {
  // An L and a star, areas by the shoelace formula.
  const std::vector<Vec3> ell{{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {1, 1, 0}, {1, 4, 0}, {0, 4, 0}};
  std::vector<Vec3> star;
  for (int i = 0; i < 10; ++i) {
    const double r = i % 2 == 0 ? 2 : 0.6, a = i * kPi / 5;
    star.push_back({r * std::cos(a), r * std::sin(a), 0});
  }
  const double star_area = 10 * 0.5 * 2 * 0.6 * std::sin(kPi / 5);
  for (const double angle : {0.0, 0.7, 1.6, 2.5, 3.1}) {
    const Rotation turn = rotation_x(angle) * rotation_y(2 * angle + 0.1);
    for (const auto& [shape, area] : {std::pair{ell, 6.0}, std::pair{star, star_area}}) {
      std::vector<Vec3> turned;
      for (const Vec3& p : shape) turned.push_back(turn * p);
      EXPECT_EQ(triangulate(turned).size(), shape.size() - 2);
      // No triangle is flipped and none overlaps: signed and absolute areas are both the whole.
      EXPECT_NEAR(cut_area(turned, false), area, 1e-12);
      EXPECT_NEAR(cut_area(turned, true), area, 1e-12);
    }
  }
}

TEST(Polygon, DegenerateInputStillGivesTriangles) {
  EXPECT_TRUE(triangulate({}).empty());
  const std::vector<Vec3> two{{0, 0, 0}, {1, 0, 0}};
  EXPECT_TRUE(triangulate(two).empty());
  const std::vector<Vec3> same(5, Vec3{1, 1, 1});
  EXPECT_EQ(triangulate(same).size(), 3u);
  const std::vector<Vec3> bow{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_EQ(triangulate(bow).size(), 2u);
  const std::vector<Vec3> nan{{0, 0, 0}, {std::nan(""), 1, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_EQ(triangulate(nan).size(), 2u);
}

TEST(Polygon, HugePolygonsAreFans) {
  std::vector<Vec3> disc;
  for (int i = 0; i < 5000; ++i) {
    const double a = i * 2 * kPi / 5000;
    disc.push_back({std::cos(a), 0, std::sin(a)});
  }
  EXPECT_EQ(triangulate(disc).size(), 4998u);
  // A regular n-gon: n/2 sin(2 pi / n).
  EXPECT_NEAR(cut_area(disc, true), 2500 * std::sin(2 * kPi / 5000), 1e-10);
}

}  // namespace
}  // namespace haarlight
