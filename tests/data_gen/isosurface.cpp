// Closed surfaces from functions of space.

#include "data_gen/isosurface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <utility>

#include "data_gen/figures.h"
#include "tests/data_gen/volume.h"

namespace haarlight::data_gen {
namespace {

// Directed edges that have no opposite, or are there twice; none of a closed surface.
std::size_t open_edges(const Scene& scene) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const Triangle& t : scene.triangle) {
    for (std::size_t c = 0; c < 3; ++c) ++edges[{t.vertex[c], t.vertex[(c + 1) % 3]}];
  }
  std::size_t open = 0;
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    if (back == edges.end() || back->second != count) ++open;
  }
  return open;
}

TEST(Isosurface, ASphereIsClosedAndHasItsVolume) {
  const Vec3 center{0.3, -0.2, 0.1};
  const double r = 0.8;
  const Scene ball = isosurface([&](const Vec3& p) { return sphere_distance(p, center, r); },
                                {-1, -1.5, -1}, {1.5, 1, 1.2}, 40);
  EXPECT_EQ(open_edges(ball), 0u);
  // Most vertices lie on the sphere, facets below it by about h^2 / (8 r): h = 2.5 / 40 across and
  // up to sqrt 2 times that along a diagonal: 0.1 % of r, three times that of the volume, inwards.
  const double whole = 4 * kPi / 3 * r * r * r;
  EXPECT_LT(volume(ball), whole);
  EXPECT_NEAR(volume(ball), whole, 0.005 * whole);
  for (std::size_t v = 0; v < ball.position.size(); ++v) {
    const Vec3 out = normalize(ball.position[v] - center);
    // Vertices keep a twentieth of a cell from its border: sqrt 3 of that where it is a corner.
    EXPECT_NEAR(length(ball.position[v] - center), r, 0.05 * 2.5 / 40 * std::sqrt(3.0));
    EXPECT_GT(dot(ball.normal[v], out), 1 - 1e-4);
  }
}

TEST(Isosurface, FiguresAreClosedAndStandOnTheFloor) {
  for (const Scene& figure : {as_figure(make_bunny(40), 0.5), as_figure(make_statue(60), 1.2)}) {
    EXPECT_EQ(open_edges(figure), 0u);
    EXPECT_GT(volume(figure), 0);  // corners run counter-clockwise seen from outside
    double low = 1e9, high = -1e9;
    for (const Vec3& p : figure.position) low = std::min(low, p.y), high = std::max(high, p.y);
    EXPECT_NEAR(low, 0, 1e-12);
    EXPECT_TRUE(std::abs(high - 0.5) < 1e-12 || std::abs(high - 1.2) < 1e-12);
  }
}

TEST(Isosurface, DistancesAreZeroOnTheirBodies) {
  EXPECT_NEAR(ellipsoid_distance({3, 2, 1}, {1, 2, 1}, {2, 5, 7}), 0, 1e-12);
  EXPECT_NEAR(rod_distance({0.5, 0.15, 0}, {0, 0, 0}, {1, 0, 0}, 0.1, 0.2), 0, 1e-12);
  // Far apart the union is the nearer; equal bodies swell by k / 4.
  EXPECT_EQ(smooth_union(1, 3, 0.5), 1);
  EXPECT_NEAR(smooth_union(1, 1, 0.5), 1 - 0.125, 1e-12);
}

}  // namespace
}  // namespace haarlight::data_gen
