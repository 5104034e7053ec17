// Subdivision: the same surfaces, no crack, finer where shadows end.

#include "precompute/subdivide.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

// A ground of 4 x 4 m, of two triangles, under a ball.
Scene ball_over_ground() {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-2, 0, -2}, {0, 0, 4}, {4, 0, 0});
  shapes::add_sphere(scene, {0.2, 0.7, 0.1}, 0.4, 3);
  return scene;
}

Scene fine(const Scene& scene, const SubdivideOptions& options, SubdivideReport* report = nullptr) {
  return subdivide(scene, Visibility(scene), options, report);
}

double area_of(const Scene& scene, const Triangle& t) {
  const Vec3 a = scene.position[t.vertex[0]];
  return 0.5 * length(cross(scene.position[t.vertex[1]] - a, scene.position[t.vertex[2]] - a));
}

TEST(Subdivide, KeepsTheSurfaces) {
  const Scene scene = ball_over_ground();
  SubdivideReport report;
  const Scene finer = fine(scene, {.tolerance = 0.02, .max_vertices = 4000}, &report);
  EXPECT_GT(finer.position.size(), 3 * scene.position.size());
  EXPECT_EQ(report.vertices, static_cast<std::int64_t>(finer.position.size()));
  EXPECT_EQ(report.triangles, static_cast<std::int64_t>(finer.triangle.size()));
  EXPECT_LE(report.vertices, 4000);
  double before = 0, after = 0;
  for (const Triangle& t : scene.triangle) before += area_of(scene, t);
  for (const Triangle& t : finer.triangle) {
    EXPECT_GT(area_of(finer, t), 0);
    after += area_of(finer, t);
  }
  EXPECT_NEAR(after, before, 1e-12 * before);
  // Old vertices stay where they are, with what they had.
  for (std::size_t v = 0; v < scene.position.size(); ++v) {
    EXPECT_EQ(finer.position[v], scene.position[v]);
    EXPECT_EQ(finer.normal[v], scene.normal[v]);
  }
  for (const Vec3& n : finer.normal) EXPECT_NEAR(length(n), 1, 1e-12);
}

// Without T-junctions an edge of the closed ball has two triangles on it, of opposite directions,
// by place; and no place lies inside an edge.
TEST(Subdivide, LeavesNoCrack) {
  // A box has no shared vertices at its edges: places must be split together all the same.
  Scene scene = shapes::empty_scene();
  shapes::add_box(scene, {-1, 0.0625, -1}, {1, 0.5, 1});
  const std::size_t box = scene.triangle.size();
  shapes::add_quad(scene, {-6, 0, -6}, {0, 0, 12}, {12, 0, 0}, 0);
  scene.material.emplace_back();
  for (std::size_t t = box; t < scene.triangle.size(); ++t) scene.triangle[t].material = 1;
  const Scene finer = fine(scene, {.tolerance = 0.02, .max_vertices = 6000});
  using Place = std::tuple<double, double, double>;
  const auto place = [&](std::uint32_t v) {
    return Place{finer.position[v].x, finer.position[v].y, finer.position[v].z};
  };
  std::map<std::pair<Place, Place>, int> edges;
  int triangles = 0;
  for (const Triangle& t : finer.triangle) {
    if (t.material != 0) continue;
    ++triangles;
    for (std::size_t s = 0; s < 3; ++s) {
      ++edges[{place(t.vertex[s]), place(t.vertex[(s + 1) % 3])}];
    }
  }
  EXPECT_GT(triangles, 50);
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(edges.count({edge.second, edge.first}), 1u);
  }
}

TEST(Subdivide, IsFinestAtTheEdgeOfTheShadow) {
  // Seen from the ground around, the ball hides most right below it and less and less outwards;
  // what an edge's ends see differs most where it does so fastest. Far away nothing changes.
  const Scene scene = ball_over_ground();
  SubdivideReport report;
  const Scene finer = fine(scene, {.tolerance = 0.02, .max_vertices = 20000}, &report);
  EXPECT_LE(report.worst, 0.02);
  double near = 0, far = 0;
  int near_count = 0, far_count = 0;
  for (const Triangle& t : finer.triangle) {
    const Vec3 p = finer.position[t.vertex[0]];
    if (p.y != 0) continue;
    const double distance = std::hypot(p.x - 0.2, p.z - 0.1);
    if (distance < 0.8) near += area_of(finer, t), ++near_count;
    if (distance > 1.6) far += area_of(finer, t), ++far_count;
  }
  ASSERT_GT(near_count, 0);
  ASSERT_GT(far_count, 0);
  EXPECT_LT(near / near_count, 0.25 * far / far_count);
}

TEST(Subdivide, KeepsAnglesAndStopsWhereToldTo) {
  const Scene scene = ball_over_ground();
  const Scene finer =
      fine(scene, {.tolerance = 0.001, .longest = 0.1, .shortest = 0.05, .max_vertices = 100000});
  // Rivara 1984: bisecting the longest edge gives no angle below half of the smallest at first.
  const auto smallest = [](const Scene& s) {
    double least = kPi;
    for (const Triangle& t : s.triangle) {
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec3 a = s.position[t.vertex[i]];
        const Vec3 u = normalize(s.position[t.vertex[(i + 1) % 3]] - a);
        const Vec3 v = normalize(s.position[t.vertex[(i + 2) % 3]] - a);
        least = std::min(least, std::acos(std::clamp(dot(u, v), -1.0, 1.0)));
      }
    }
    return least;
  };
  EXPECT_GE(smallest(finer), 0.5 * smallest(scene) - 1e-9);
  // No edge is longer than the longest, and none came from one shorter than the shortest: half of
  // it at least on its triangle's longest side. Longest-edge closure may split a longer neighbour
  // only, so what is shorter than half the shortest was there before.
  const double size = length(Vec3{4, 1.1, 4});
  double longest = 0;
  for (const Triangle& t : finer.triangle) {
    for (std::size_t i = 0; i < 3; ++i) {
      longest = std::max(
          longest, length(finer.position[t.vertex[i]] - finer.position[t.vertex[(i + 1) % 3]]));
    }
  }
  EXPECT_LE(longest, 0.1 * size);
}

TEST(Subdivide, LeavesOpenConvexBodiesAlone) {
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {0, 0, 0}, 1, 4);
  SubdivideReport report;
  const Scene finer = fine(scene, {.tolerance = 0.005, .longest = 1}, &report);
  EXPECT_EQ(finer.position.size(), scene.position.size());
  EXPECT_EQ(report.split_edges, 0);
}

TEST(Subdivide, StaysBelowTheLimit) {
  const Scene scene = ball_over_ground();
  const auto at_first = static_cast<int>(scene.position.size());
  for (const int limit : {1, at_first, at_first + 1, at_first + 40, 1000, 1777}) {
    const Scene finer = fine(scene, {.tolerance = 0.005, .max_vertices = limit});
    EXPECT_LE(finer.position.size(), static_cast<std::size_t>(std::max(limit, at_first)));
  }
  const Scene finer = fine(scene, {.tolerance = 0.005, .max_vertices = 1777});
  EXPECT_GT(finer.position.size(), 1700u);
}

TEST(Subdivide, TheSameOnAnyNumberOfThreads) {
  const Scene scene = ball_over_ground();
  const int before = thread_count();
  std::vector<Vec3> positions[2];
  for (int run = 0; run < 2; ++run) {
    set_thread_count(run == 0 ? 1 : 7);
    positions[run] = fine(scene, {.tolerance = 0.01, .max_vertices = 3000}).position;
  }
  set_thread_count(before);
  EXPECT_EQ(positions[0], positions[1]);
}

TEST(Subdivide, InterpolatesWhatVerticesHave) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {0, 0, 0}, {0, 0, 4}, {4, 0, 0});
  scene.uv = {{0, 0}, {0, 1}, {1, 1}, {1, 0}};
  for (const Vec3& p : scene.position) {
    scene.tint.push_back({static_cast<float>(p.x / 4), static_cast<float>(p.z / 4), 0.5f});
  }
  const Scene finer = fine(scene, {.longest = 0.1});
  EXPECT_GT(finer.position.size(), 100u);
  for (std::size_t v = 0; v < finer.position.size(); ++v) {
    const Vec3 p = finer.position[v];  // multiples of powers of two: exact
    EXPECT_EQ(static_cast<double>(finer.uv[v][0]), p.x / 4);
    EXPECT_EQ(static_cast<double>(finer.uv[v][1]), p.z / 4);
    EXPECT_EQ(static_cast<double>(finer.tint[v].r), p.x / 4);
    EXPECT_EQ(finer.tint[v].b, 0.5f);
  }
}

TEST(Subdivide, RefusesAndStops) {
  const Scene scene = ball_over_ground();
  EXPECT_THROW(fine(scene, {.tolerance = 0}), Error);
  EXPECT_THROW(fine(scene, {.longest = std::nan("")}), Error);
  EXPECT_THROW(fine(scene, {.shortest = -1}), Error);
  EXPECT_THROW(subdivide(scene, Visibility(scene), {}, nullptr, [](double) { return false; }),
               Error);
}

}  // namespace
}  // namespace haarlight
