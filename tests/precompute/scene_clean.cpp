// What broken meshes become: triangles dropped with a count, normals made, nothing else changed.

#include "precompute/scene_clean.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

Scene without_normals(Scene scene) {
  scene.normal.assign(scene.position.size(), Vec3{});
  return scene;
}

TEST(SceneClean, DropsAndCountsBrokenTriangles) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const Scene good = scene;
  const auto nan = shapes::add_vertex(scene, {std::nan(""), 0, 0}, {0, 0, 1});
  const auto inf =
      shapes::add_vertex(scene, {0, std::numeric_limits<double>::infinity(), 0}, {0, 0, 1});
  const auto mid = shapes::add_vertex(scene, {0.5, 0, 0}, {0, 0, 1});
  const auto copy = shapes::add_vertex(scene, {1, 0, 0}, {0, 0, 1});
  shapes::add_vertex(scene, {9, 9, 9}, {0, 0, 1});  // unused
  scene.triangle.push_back({{0, 1, nan}, 0});
  scene.triangle.push_back({{0, inf, 2}, 0});
  scene.triangle.push_back({{0, 0, 2}, 0});     // repeated corner
  scene.triangle.push_back({{0, mid, 1}, 0});   // on a line
  scene.triangle.push_back({{2, copy, 0}, 0});  // the first again, by another vertex, reversed
  clean_scene(scene);
  EXPECT_EQ(scene.triangle.size(), 2u);
  EXPECT_EQ(scene.report.dropped_not_finite, 2);
  EXPECT_EQ(scene.report.dropped_degenerate, 2);
  EXPECT_EQ(scene.report.dropped_duplicate, 1);
  EXPECT_EQ(scene.report.unused_vertices, 1);
  EXPECT_EQ(scene.report.normals_made, 0);
  // The cleaned mesh is the good one: two vertices of the diagonal are shared, none is left over.
  EXPECT_EQ(scene.position.size(), 4u);
  for (std::size_t t = 0; t < 2; ++t) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(scene.position[scene.triangle[t].vertex[c]],
                good.position[good.triangle[t].vertex[c]]);
    }
  }
}

TEST(SceneClean, SmoothSurfacesGetSmoothNormals) {
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {}, 1, 4);
  clean_scene(scene = without_normals(scene));
  EXPECT_EQ(scene.report.normals_made, static_cast<std::int64_t>(scene.position.size()));
  // Edges are at most sqrt(6) / 16 = 0.15; a mean of face normals, weighted by angle, is off by
  // less than their square, 0.023.
  for (std::size_t v = 0; v < scene.position.size(); ++v) {
    EXPECT_LT(length(scene.normal[v] - normalize(scene.position[v])), 0.023);
  }
}

TEST(SceneClean, SharedAndSeparateVerticesGetTheSameNormals) {
  Scene shared = shapes::empty_scene();
  shapes::add_sphere(shared, {}, 1, 2);
  Scene separate = shapes::empty_scene();
  for (const Triangle& t : shared.triangle) {
    Triangle own;
    for (std::size_t c = 0; c < 3; ++c) {
      own.vertex[c] = shapes::add_vertex(separate, shared.position[t.vertex[c]], {});
    }
    separate.triangle.push_back(own);
  }
  clean_scene(shared = without_normals(shared));
  clean_scene(separate);
  EXPECT_EQ(shared.position, separate.position);
  EXPECT_EQ(shared.normal, separate.normal);
}

TEST(SceneClean, CreasesStaySharp) {
  Scene scene = shapes::empty_scene();
  shapes::add_box(scene, {0, 0, 0}, {1, 2, 3});
  clean_scene(scene = without_normals(scene));
  EXPECT_EQ(scene.position.size(), 24u);  // three normals at each of eight corners
  for (const Triangle& t : scene.triangle) {
    const Vec3& a = scene.position[t.vertex[0]];
    const Vec3 face =
        normalize(cross(scene.position[t.vertex[1]] - a, scene.position[t.vertex[2]] - a));
    for (const std::uint32_t v : t.vertex) EXPECT_NEAR(dot(scene.normal[v], face), 1, 1e-12);
  }
}

TEST(SceneClean, FacesWoundTheOtherWayDoNotCancel) {
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {}, 1, 3);
  for (std::size_t t = 0; t < scene.triangle.size(); t += 2) {
    std::swap(scene.triangle[t].vertex[0], scene.triangle[t].vertex[1]);
  }
  clean_scene(scene = without_normals(scene));
  for (std::size_t v = 0; v < scene.position.size(); ++v) {
    EXPECT_GT(std::abs(dot(scene.normal[v], normalize(scene.position[v]))), 0.99);
  }
}

TEST(SceneClean, BadNormalsAreReplacedGoodOnesKept) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  scene.normal[0] = {std::nan(""), 0, 0};
  scene.normal[1] = {0, 0, 0};
  scene.normal[2] = {0, 3, 4};  // kept, made unit
  clean_scene(scene);
  EXPECT_EQ(scene.report.normals_made, 2);
  int tilted = 0;
  for (const Vec3& n : scene.normal) {
    EXPECT_NEAR(length(n), 1, 1e-15);
    if (std::abs(n.y - 0.6) < 1e-15) {
      ++tilted;
    } else {
      EXPECT_EQ(n, (Vec3{0, 0, 1}));
    }
  }
  EXPECT_EQ(tilted, 1);
}

TEST(SceneClean, TinyAndHugeScenesKeepTheirTriangles) {
  for (const double scale : {1e-9, 1e9}) {
    Scene scene = shapes::empty_scene();
    shapes::add_sphere(scene, {}, scale, 3);
    const std::size_t count = scene.triangle.size();
    clean_scene(scene);
    EXPECT_EQ(scene.triangle.size(), count) << scale;
  }
}

TEST(SceneClean, TipsOfLargeFansStayFast) {
  Scene scene = shapes::empty_scene();
  const auto tip = shapes::add_vertex(scene, {0, 1, 0}, {});
  constexpr int kFaces = 60000;
  for (int i = 0; i < kFaces; ++i) {
    const double a = 2 * kPi * i / kFaces;
    shapes::add_vertex(scene, {std::cos(a), 0, std::sin(a)}, {});
  }
  for (int i = 0; i < kFaces; ++i) {
    scene.triangle.push_back(
        {{tip, static_cast<std::uint32_t>(1 + (i + 1) % kFaces), static_cast<std::uint32_t>(1 + i)},
         0});
  }
  // The square of 60,000 is not worth waiting for: faces at the tip keep their own normals.
  clean_scene(scene);
  for (const Triangle& t : scene.triangle) {
    const Vec3& a = scene.position[t.vertex[0]];
    const Vec3 face =
        normalize(cross(scene.position[t.vertex[1]] - a, scene.position[t.vertex[2]] - a));
    ASSERT_EQ(a, (Vec3{0, 1, 0}));
    ASSERT_GT(dot(scene.normal[t.vertex[0]], face), 1 - 1e-12);
  }
}

TEST(SceneClean, ImpossibleIndicesAndEmptyScenesAreErrors) {
  const auto kind = [](Scene scene) {
    try {
      clean_scene(scene);
    } catch (const Error& error) {
      return error.kind();
    }
    return ErrorKind::cancelled;
  };
  Scene scene = shapes::empty_scene();
  EXPECT_EQ(kind(scene), ErrorKind::missing);
  shapes::add_quad(scene, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  Scene far = scene;
  far.triangle[0].vertex[1] = 4;
  EXPECT_EQ(kind(far), ErrorKind::format);
  Scene stuff = scene;
  stuff.triangle[1].material = 1;
  EXPECT_EQ(kind(stuff), ErrorKind::format);
  for (Vec3& p : scene.position) p = {};
  EXPECT_EQ(kind(scene), ErrorKind::missing);
}

}  // namespace
}  // namespace haarlight
