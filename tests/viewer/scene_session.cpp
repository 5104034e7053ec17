// Scenes that move, played and taken hold of, without a window.

#include "viewer/scene_session.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <optional>

#include "caching/path_picture.h"
#include "core/error.h"
#include "core/image_io.h"
#include "data_gen/animations.h"
#include "viewer/scene_run.h"

namespace haarlight::viewer {
namespace {

std::filesystem::path scratch(const std::string& name) {
  const auto folder = std::filesystem::temp_directory_path() /
                      ("haarlight-scene-session-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  return folder / name;
}

std::filesystem::path scene_file(const std::string& name) {
  const auto file = scratch(name + ".glb");
  data_gen::save_animation(file, name);
  return file;
}

const SceneSettings kSmall{24, 18, SceneMethod::path, 2, 0, {}};

double difference(const Image& a, const Image& b) {
  double sum = 0, of = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    sum += l1_norm(RgbD(a.pixels[i]) - RgbD(b.pixels[i])), of += l1_norm(RgbD(b.pixels[i]));
  }
  return sum / of;
}

TEST(SceneSession, PlaysStepsAndGoesRound) {
  SceneSession session(scene_file("cube-in-box"), kSmall);
  EXPECT_EQ(session.frames(), 401);
  EXPECT_TRUE(session.advance());
  EXPECT_EQ(session.frame(), 0);
  session.play(true);
  EXPECT_TRUE(session.advance());
  EXPECT_TRUE(session.advance());
  EXPECT_EQ(session.frame(), 2);
  EXPECT_EQ(session.samples(), 2);  // paths of another frame do not count
  session.step(-3);
  EXPECT_FALSE(session.playing());
  EXPECT_EQ(session.frame(), 400);
  session.play(true);
  EXPECT_TRUE(session.advance());
  EXPECT_EQ(session.frame(), 0);
}

TEST(SceneSession, PathsAddUpWhileItRests) {
  const auto file = scene_file("cube-in-box");
  SceneSession session(file, kSmall);
  for (int i = 0; i < 8; ++i) EXPECT_TRUE(session.advance());
  EXPECT_EQ(session.samples(), 16);
  // The mean of as many pictures by the seeds 1, 3, ..., 15, within a float's rounding.
  const AnimatedScene scene(file);
  const AnimatedFrame frame = scene.at(0);
  const FrameTracer tracer(frame);
  std::vector<RgbD> sum(session.picture().pixels.size());
  for (std::uint64_t seed = 1; seed < 16; seed += 2) {
    const Image one = path_picture(tracer, {24, 18, 2, seed});
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += RgbD(one.pixels[i]) * (1.0 / 8);
  }
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const RgbD off = RgbD(session.picture().pixels[i]) - sum[i];
    EXPECT_LT(l1_norm(off), 1e-6 * (1 + l1_norm(sum[i])));
  }
}

TEST(SceneSession, WhatIsTakenHoldOfFollowsThePointer) {
  SceneSession session(scene_file("moving-light"), kSmall);
  session.advance();
  // The cube's middle at (0.1, 0.25, -0.4) is seen from (0, 1, 0.97) right and below of the middle.
  const AnimatedScene scene(scratch("moving-light.glb"));
  const AnimatedFrame frame = scene.at(0);
  const Camera camera = frame_camera(frame, 24, 18);
  const auto pixel = [&](const Vec3& world) {
    const Vec3 p = camera.orientation.transposed() * (world - camera.position);
    const double scale = 9 / std::tan(0.5 * camera.vertical_fov) / -p.z;
    return std::array{12 + p.x * scale, 9 - p.y * scale};
  };
  const auto at = pixel({0.1, 0.25, -0.4});
  // A lamp is nearer than ten pixels to everything here: its own picture is larger.
  SceneSettings large = kSmall;
  large.width = 240, large.height = 180, large.samples = 1;
  SceneSession big(scratch("moving-light.glb"), large);
  big.advance();
  const auto held = big.grab(10 * at[0], 10 * at[1]);
  ASSERT_TRUE(held);
  EXPECT_FALSE(held->lamp);
  const Image before = big.picture();
  big.drag(*held, 10 * at[0] - 40, 10 * at[1]);
  EXPECT_TRUE(big.advance());
  EXPECT_EQ(big.samples(), 1);  // it begins anew
  EXPECT_GT(difference(big.picture(), before), 0.05);
  // It is there now, and no longer where it was.
  const auto again = big.grab(10 * at[0] - 40, 10 * at[1]);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->node, held->node);
  EXPECT_LT(length(again->point - held->point - again->before), 0.02);
  EXPECT_NE(again->before, Vec3());
  // The lamp stands at (0, 1.7, 0.5) in frame 0; it is dragged to the left.
  const auto lamps = big.lamps_seen();
  ASSERT_EQ(lamps.size(), 1u);
  const auto lamp = big.grab(lamps[0][0] + 2, lamps[0][1] - 3);
  ASSERT_TRUE(lamp);
  EXPECT_TRUE(lamp->lamp);
  big.drag(*lamp, lamps[0][0] - 50, lamps[0][1]);
  big.advance();
  EXPECT_NEAR(big.lamps_seen()[0][0], lamps[0][0] - 50, 1e-6);
  EXPECT_NEAR(big.lamps_seen()[0][1], lamps[0][1], 1e-6);
  // Walls are all around, and nobody's to carry.
  EXPECT_FALSE(big.grab(2, 90));
}

TEST(SceneSession, TheCameraTurnsAboutWhatIsInTheMiddle) {
  SceneSettings settings{64, 48, SceneMethod::path, 1, 0, {}};
  SceneSession session(scene_file("cube-in-box"), settings);
  session.advance();
  const Image before = session.picture();
  session.orbit(0.3, 0.1, 0.2);
  EXPECT_TRUE(session.advance());
  EXPECT_GT(difference(session.picture(), before), 0.05);
  session.orbit(-0.3, -0.1, -0.2);
  session.advance();
  session.orbit(0, 0, 0);
  session.advance();
  EXPECT_LT(difference(session.picture(), before), 1e-6);  // the same paths
}

TEST(SceneSession, CachesDrawTheSameSceneAndThenRest) {
  const auto file = scene_file("cube-in-box");
  SceneSession truth(file, {24, 18, SceneMethod::path, 256, 0, {}});
  truth.advance();
  for (const SceneMethod method : {SceneMethod::irc, SceneMethod::trc}) {
    SceneSession session(file, {24, 18, method, 1, 0, {}});
    EXPECT_TRUE(session.advance());
    // Paths are spread over pixels, records asked for at their middles: edges of this small
    // picture are off by a few percent; a picture without its indirect light would be by 40.
    EXPECT_LT(difference(session.picture(), truth.picture()), 0.15);
    EXPECT_FALSE(session.advance());
    session.set_method(SceneMethod::path);
    EXPECT_TRUE(session.advance());
    EXPECT_EQ(session.samples(), 1);
  }
}

TEST(SceneSession, VirtualLightsDrawTheSameSceneAndGoOnUnderAHand) {
  const auto file = scene_file("moving-light");
  SceneSettings settings{60, 45, SceneMethod::path, 256, 0, {}};
  SceneSession truth(file, settings);
  truth.advance();
  settings.method = SceneMethod::ic, settings.samples = 1;
  const auto move = [](SceneSession& session, double x) {
    const auto lamps = session.lamps_seen();
    const auto lamp = session.grab(lamps[0][0], lamps[0][1]);
    ASSERT_TRUE(lamp && lamp->lamp);
    session.drag(*lamp, lamps[0][0] + x, lamps[0][1]);
  };
  for (const SceneMethod method : {SceneMethod::igi, SceneMethod::ic, SceneMethod::tic}) {
    settings.method = method;
    SceneSession session(file, settings);
    EXPECT_TRUE(session.advance());
    // As above; and the bound of the nearest lights, and few reflections.
    EXPECT_LT(difference(session.picture(), truth.picture()), 0.2);
    EXPECT_FALSE(session.advance());
    move(session, -15);
    EXPECT_TRUE(session.advance());
    EXPECT_FALSE(session.advance());
    // One that sees the lamp there for the first time: the same lights, and records elsewhere.
    SceneSession other(file, settings);
    move(other, -15);
    other.advance();
    EXPECT_LT(difference(session.picture(), other.picture()), 0.02);
    EXPECT_GT(difference(session.picture(), truth.picture()), 0.05);
  }
}

TEST(SceneSession, FewerPixelsWhileItPlaysAndAllAtRest) {
  const auto file = scene_file("cube-in-box");
  SceneSettings settings{48, 36, SceneMethod::igi, 1, 0, {}};
  for (const SceneMethod method : {SceneMethod::igi, SceneMethod::path}) {
    settings.method = method;
    settings.least_rate = 0;
    SceneSession whole(file, settings);
    whole.step(6);
    whole.advance();
    settings.least_rate = 1e9;  // no machine draws that fast
    SceneSession session(file, settings);
    EXPECT_TRUE(session.advance());
    EXPECT_EQ(session.picture().width, 48);
    session.play(true);
    for (const int coarse : {2, 4, 4}) {
      EXPECT_TRUE(session.advance());
      EXPECT_EQ(session.coarseness(), coarse);
      EXPECT_EQ(session.picture().width, 48 / coarse);
      EXPECT_EQ(session.picture().height, 36 / coarse);
    }
    // It may be dragged at; rings of lamps are where the picture shows them.
    const auto lamps = session.lamps_seen();
    ASSERT_EQ(lamps.size(), 1u);
    EXPECT_LT(lamps[0][0], 12);
    session.play(false);
    EXPECT_TRUE(session.advance());
    EXPECT_EQ(session.coarseness(), 1);
    EXPECT_EQ(session.picture().width, 48);
    session.step(3);
    EXPECT_TRUE(session.advance());
    EXPECT_EQ(session.frame(), 6);
    EXPECT_EQ(session.picture().pixels, whole.picture().pixels);
    session.orbit(0.1, 0, 0);
    EXPECT_TRUE(session.advance());
    EXPECT_EQ(session.coarseness(), 2);
  }
  settings.least_rate = 1e-9;  // any machine does
  SceneSession session(file, settings);
  session.play(true);
  for (int i = 0; i < 3; ++i) session.advance();
  EXPECT_EQ(session.coarseness(), 1);
}

TEST(SceneSession, ShowsTheLifeOfRecords) {
  // Of the box of a cube that moves: at first all is new; later the walls, which it hardly changes,
  // have been good for longer than the cube's own records.
  SceneSettings settings{48, 36, SceneMethod::tic, 1, 0, {}};
  SceneSession session(scene_file("cube-in-box"), settings);
  session.advance();
  EXPECT_TRUE(session.life().pixels.empty());
  session.show_life(true);
  const auto means = [&] {
    Rgb sum;
    for (const Rgb& c : session.life().pixels) {
      sum += c * (1.0f / static_cast<float>(session.life().pixels.size()));
    }
    return sum;
  };
  EXPECT_TRUE(session.advance());
  ASSERT_EQ(session.life().pixels.size(), 48u * 36);
  const Rgb first = means();
  EXPECT_LT(first.g, 0.1f);  // a frame of 16 at most
  EXPECT_GT(first.r, 0.8f);
  session.play(true);
  for (int i = 0; i < 20; ++i) session.advance();
  const Rgb later = means();
  EXPECT_GT(later.g, first.g + 0.02f);
  EXPECT_GT(later.r, 0.02f);
  session.show_life(false);
  session.advance();
  EXPECT_TRUE(session.life().pixels.empty());
  // Those of temporal radiance caching: how long they will last.
  session.set_method(SceneMethod::trc);
  session.show_life(true);
  session.advance();
  EXPECT_EQ(session.life().pixels.size(), 48u * 36);
  EXPECT_GT(means().g, 0.1f);
}

TEST(SceneSession, RunsWithoutAWindow) {
  SceneRunOptions options;
  options.scene = scene_file("moving-light");
  options.settings = kSmall;
  options.frames = 6, options.pause_at = 2;
  options.exr = scratch("last.exr"), options.screenshot = scratch("last.png");
  run_scene_headless(options);
  const Image last = load_image(options.exr);
  // Frames 0, 1 and 2, and three pictures more of that: what a session that begins there has.
  SceneSettings there = kSmall;
  there.first = 2;
  SceneSession session(options.scene, there);
  for (int i = 0; i < 4; ++i) session.advance();
  EXPECT_EQ(last.pixels, session.picture().pixels);
  EXPECT_EQ(load_image(options.screenshot).width, 24);
  EXPECT_TRUE(is_scene_file("a.gltf"));
  EXPECT_FALSE(is_scene_file("a.hlt"));
  EXPECT_THROW(SceneSession(scratch("none.glb"), kSmall), Error);
}

}  // namespace
}  // namespace haarlight::viewer
