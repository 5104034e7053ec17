// The stage for bare meshes: when a ground comes, where the camera stands.

#include "precompute/default_stage.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

// Where a point is in the picture, in pixels; depth along the view.
struct Seen {
  double x, y, depth;
};
Seen project(const Camera& camera, const Vec3& p) {
  const Vec3 v = camera.orientation.transposed() * (p - camera.position);
  const double half = std::tan(0.5 * camera.vertical_fov);
  return {0.5 * camera.width + v.x / -v.z / half * 0.5 * camera.height,
          0.5 * camera.height - v.y / -v.z / half * 0.5 * camera.height, -v.z};
}

Scene ball() {
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {5, 7, -2}, 1.5, 4);
  return scene;
}

// A floor, three walls and a ceiling, all facing inwards; open towards +Z.
Scene room() {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
  shapes::add_quad(scene, {-1, 2, -1}, {2, 0, 0}, {0, 0, 2});
  shapes::add_quad(scene, {-1, 0, -1}, {2, 0, 0}, {0, 2, 0});
  shapes::add_quad(scene, {-1, 0, -1}, {0, 2, 0}, {0, 0, 2});
  shapes::add_quad(scene, {1, 0, -1}, {0, 0, 2}, {0, 2, 0});
  return scene;
}

TEST(DefaultStage, GroundComesUnderBareMeshesOnly) {
  EXPECT_TRUE(needs_ground(ball()));
  Scene box = shapes::empty_scene();
  shapes::add_box(box, {0, 0, 0}, {1, 1, 1});
  EXPECT_TRUE(needs_ground(box));  // its bottom faces down: no floor to stand on
  EXPECT_FALSE(needs_ground(room()));
  Scene plate = ball();
  shapes::add_quad(plate, {0, 5.5, -8}, {0, 0, 12}, {12, 0, 0});
  EXPECT_FALSE(needs_ground(plate));
  Scene shot = ball();
  shot.camera.emplace();
  EXPECT_FALSE(needs_ground(shot));
}

TEST(DefaultStage, GroundIsASquareAtTheLowestPoint) {
  Scene scene = ball();
  const std::size_t before = scene.position.size();
  StageOptions options;
  const Stage stage = set_stage(scene, options);
  EXPECT_TRUE(stage.ground_added);
  EXPECT_TRUE(stage.camera_made);
  ASSERT_EQ(scene.position.size(), before + 4);
  // Six times the ball's width of 3, around its middle.
  for (std::size_t v = before; v < before + 4; ++v) {
    EXPECT_NEAR(scene.position[v].y, 5.5, 1e-12);
    EXPECT_NEAR(std::abs(scene.position[v].x - 5), 9, 1e-12);
    EXPECT_NEAR(std::abs(scene.position[v].z + 2), 9, 1e-12);
  }
  for (std::size_t i = 0; i < 2; ++i) {  // faces up
    const Triangle& t = scene.triangle[scene.triangle.size() - 1 - i];
    const Vec3& a = scene.position[t.vertex[0]];
    EXPECT_GT(cross(scene.position[t.vertex[1]] - a, scene.position[t.vertex[2]] - a).y, 0);
    EXPECT_EQ(scene.material[t.material].albedo, (Rgb{0.5f, 0.5f, 0.5f}));
  }
  EXPECT_FALSE(needs_ground(scene));  // now it has one
}

TEST(DefaultStage, SwitchesAreObeyed) {
  Scene scene = ball();
  EXPECT_FALSE(set_stage(scene, {.ground = GroundMode::off}).ground_added);
  Scene inside = room();
  EXPECT_TRUE(set_stage(inside, {.ground = GroundMode::on}).ground_added);
  Scene shot = ball();
  shot.camera = look_at({0, 0, 9}, {5, 7, -2}, 0.5, 512, 512);
  const Stage own = set_stage(shot, {.width = 64, .height = 32});
  EXPECT_FALSE(own.camera_made);
  EXPECT_EQ(own.camera.position, (Vec3{0, 0, 9}));
  EXPECT_EQ(own.camera.width, 64);
  EXPECT_EQ(own.camera.height, 32);
  const Stage other = set_stage(shot, {.use_scene_camera = false});
  EXPECT_TRUE(other.camera_made);
}

TEST(DefaultStage, CameraHoldsTheMeshAndNotTheGround) {
  for (const auto& [width, height] : {std::pair{512, 512}, {300, 100}, {100, 300}}) {
    Scene scene = ball();
    const Stage stage = set_stage(scene, {.width = width, .height = height});
    const Camera& camera = stage.camera;
    EXPECT_NEAR(camera.vertical_fov, 35 * kPi / 180, 1e-12);
    double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
    for (const Vec3& p : ball().position) {
      const Seen at = project(camera, p);
      EXPECT_GT(at.depth, 0);
      left = std::min(left, at.x), right = std::max(right, at.x);
      top = std::min(top, at.y), bottom = std::max(bottom, at.y);
    }
    EXPECT_GE(left, 0);
    EXPECT_LE(right, width);
    EXPECT_GE(top, 0);
    EXPECT_LE(bottom, height);
    // It fills most of the narrower side.
    EXPECT_GT(std::max((right - left) / width, (bottom - top) / height), 0.85);
    // From the front (+Z), slightly above, upright.
    const Vec3 towards = normalize(camera.position - Vec3{5, 7, -2});
    EXPECT_GT(towards.z, 0.7);
    EXPECT_NEAR(std::asin(towards.y), 20 * kPi / 180, 1e-9);
    EXPECT_NEAR(camera.orientation.row[1].x, 0, 1e-12);
  }
}

TEST(DefaultStage, RoomsAreSeenStraightFromTheFront) {
  const Camera camera = framing_camera(room(), 64, 64);
  EXPECT_NEAR(camera.position.x, 0, 1e-12);
  EXPECT_NEAR(camera.position.y, 1, 1e-12);
  EXPECT_GT(camera.position.z, 1);
}

TEST(DefaultStage, BadOptionsAreRefused) {
  const auto kind = [](const StageOptions& options, Scene scene) {
    try {
      set_stage(scene, options);
    } catch (const Error& error) {
      return error.kind();
    }
    return ErrorKind::cancelled;
  };
  EXPECT_EQ(kind({.ground_size = 0}, ball()), ErrorKind::invalid_argument);
  EXPECT_EQ(kind({.ground_size = std::nan("")}, ball()), ErrorKind::invalid_argument);
  EXPECT_EQ(kind({.width = 0}, ball()), ErrorKind::invalid_argument);
  EXPECT_EQ(kind({}, shapes::empty_scene()), ErrorKind::missing);
}

}  // namespace
}  // namespace haarlight
