// The reference's tree of triangles against every triangle in turn.

#include "tests/reference/triangle_tree.h"

#include <gtest/gtest.h>

#include <random>

#include "core/error.h"
#include "tests/precompute/shapes.h"
#include "tests/reference/ray_triangle.h"

namespace haarlight::reference {
namespace {

// Visibility's corners are rounded to float, and so are these: both then hold the same triangles,
// moved and scaled by a power of two.
TEST(TriangleTree, FindsTheNearestTriangleAsTryingAllDoes) {
  std::mt19937 random(5);
  Scene scene = shapes::empty_scene();
  shapes::add_random_triangles(scene, 300, 0.4, random);
  shapes::add_box(scene, {-0.5, -0.5, -0.5}, {0.25, 0.5, 0.5});
  const Visibility visibility(scene);
  Scene local = scene;
  for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      local.position[scene.triangle[t].vertex[k]] = visibility.corner(t, static_cast<int>(k));
    }
  }
  const TriangleTree tree(local);
  std::uniform_real_distribution<double> place(-1.2, 1.2);
  int hits = 0, doubtful = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 origin{place(random), place(random), place(random)};
    // Every third ray runs along an axis, in the plane of flat boxes now and then.
    const Vec3 direction = i % 3 != 0   ? shapes::random_direction(random)
                           : i % 2 == 0 ? Vec3{0, 1, 0}
                                        : Vec3{0, 0, -1};
    const RayResult expected = trace(visibility, origin, direction);
    // (Rays along an axis are parallel to sides of the box, which says nothing of their margin.)
    if (i % 3 != 0 && expected.margin < 1e-9) {
      ++doubtful;
      continue;
    }
    const auto found = tree.hit(origin, direction);
    ASSERT_EQ(found.has_value(), expected.blocked) << i;
    ASSERT_EQ(tree.hit(origin, direction, true).has_value(), expected.blocked) << i;
    if (!found) continue;
    ++hits;
    ASSERT_NEAR(found->distance, expected.nearest, 1e-12) << i;
    // What comes after: nothing nearer than asked for.
    const auto next = tree.hit(origin, direction, false, found->distance * (1 + 1e-12));
    if (next) {
      ASSERT_GT(next->distance, found->distance) << i;
    }
    ASSERT_FALSE(tree.hit(origin, direction, true, 0, found->distance * (1 - 1e-12))) << i;
  }
  EXPECT_GT(hits, 2000);
  EXPECT_LT(doubtful, 5);
}

TEST(TriangleTree, RefusesAnEmptyScene) {
  try {
    const TriangleTree tree(shapes::empty_scene());
    FAIL() << "an empty scene was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::missing);
  }
}

}  // namespace
}  // namespace haarlight::reference
