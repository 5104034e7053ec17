// Irradiance caching and temporal radiance caching against path tracing and against themselves.

#include "caching/caching_method.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <string>

#include "caching/motion_plan.h"
#include "caching/path_picture.h"
#include "core/error.h"
#include "core/image_metrics.h"
#include "core/parallel.h"
#include "data_gen/animations.h"
#include "data_gen/mesh_writer.h"
#include "data_gen/scenes.h"

namespace haarlight {
namespace {

const AnimatedScene& demo(const std::string& name) {
  const auto file = std::filesystem::temp_directory_path() /
                    ("haarlight-" + name + std::to_string(::getpid()) + ".glb");
  data_gen::save_animation(file, name);
  static std::vector<std::unique_ptr<AnimatedScene>> scenes;
  scenes.push_back(std::make_unique<AnimatedScene>(file));
  std::filesystem::remove(file);
  return *scenes.back();
}

CachingOptions small(bool temporal) {
  CachingOptions o;
  o.width = 48, o.height = 36;
  o.hemisphere_samples = 60;
  o.least_spacing = 2;
  o.temporal = temporal;
  o.gradients = TemporalGradients::none;
  return o;
}

TEST(CachingMethod, PictureIsThatOfPaths) {
  const AnimatedScene& scene = demo("cube-in-box");
  CachingOptions o = small(false);
  o.hemisphere_samples = 400;
  CachingMethod method(scene, o);
  const FramePicture found = method.frame(30, {});
  PathMethod paths(scene, {48, 36, 256, 1, true, true});
  const ImageDifference d = compare_images(found.radiance, paths.frame(30, {}).radiance);
  // Noise of 256 paths is 3.5 % here, of records 1 %; what Ward's accuracy of 0.2 leaves is as
  // much.
  EXPECT_LT(d.relative_rmse, 0.06);
  // And without bias beyond the noise of the mean, 1728 pixels of 5 %, with room for gradients.
  double a = 0, b = 0;
  const FramePicture truth = paths.frame(30, {});
  for (std::size_t i = 0; i < found.radiance.pixels.size(); ++i) {
    a += static_cast<double>(luminance(found.radiance.pixels[i]));
    b += static_cast<double>(luminance(truth.radiance.pixels[i]));
  }
  EXPECT_NEAR(a / b, 1, 0.01);
}

TEST(CachingMethod, SameBitsOnAnyNumberOfThreads) {
  const AnimatedScene& scene = demo("cube-in-box");
  CachingOptions o = small(true);
  o.gradients = TemporalGradients::interpolated;
  const auto pictures = [&](int threads) {
    set_thread_count(threads);
    CachingMethod method(scene, o);
    method.prepare(0, 4, {});
    std::vector<std::vector<Rgb>> out;
    for (int f = 0; f < 4; ++f) out.push_back(method.frame(f, {}).radiance.pixels);
    return out;
  };
  const int before = thread_count();
  const auto one = pictures(1), three = pictures(3);
  set_thread_count(before);
  EXPECT_TRUE(one == three);
}

TEST(CachingMethod, NothingIsSampledAgainWhereNothingMoves) {
  // cube-in-box stands still from its last key on, frame 400.
  const AnimatedScene& scene = demo("cube-in-box");
  CachingOptions o = small(true);
  o.age.longest = 3;
  CachingMethod method(scene, o);
  const FramePicture first = method.frame(400, {});
  EXPECT_GT(first.figure[3], 0);
  for (const int f : {401, 402}) {
    const FramePicture next = method.frame(f, {});
    EXPECT_EQ(next.figure[3], 0) << "rays in frame " << f;
    EXPECT_TRUE(next.radiance.pixels == first.radiance.pixels) << f;
  }
  // Then every record in use is replaced by one of the same random numbers: nothing is different
  // but how far neighbours clamp each other, which depends on the order they come in.
  const FramePicture anew = method.frame(403, {});
  EXPECT_GT(anew.figure[1], 0);
  EXPECT_LT(compare_images(anew.radiance, first.radiance).relative_rmse, 0.01);
}

TEST(CachingMethod, RecordsAreReplacedInPlaceOnlyWhereTheyAreSeen) {
  const AnimatedScene& scene = demo("cube-in-box");
  CachingOptions o = small(true);
  o.age.longest = 4;
  CachingMethod method(scene, o);
  constexpr int kFrames = 16;
  for (int f = 0; f < kFrames; ++f) method.frame(f * 1 + 50, {});
  const auto& records = method.irradiance().records();
  int replaced = 0, dropped = 0;
  for (const CacheRecord<RecordValue>& r : records) {
    const int end = r.born + r.life;
    EXPECT_LE(r.last_used, end - 1);
    if (end >= 50 + kFrames) continue;
    int successors = 0;
    for (const CacheRecord<RecordValue>& s : records) {
      successors += s.born == end && s.key == r.key && s.place == r.place;
    }
    EXPECT_EQ(successors, r.last_used == end - 1 ? 1 : 0);
    (successors ? replaced : dropped) += 1;
  }
  EXPECT_GT(replaced, 100);
  EXPECT_GT(dropped, 0);
}

TEST(CachingMethod, InterpolatedRecordsMeetTheirSuccessors) {
  const AnimatedScene& scene = demo("moving-light");
  CachingOptions o = small(true);
  o.gradients = TemporalGradients::interpolated;
  o.age = {0.5, 4};
  CachingMethod method(scene, o);
  method.prepare(10, 9, {});
  const auto& records = method.irradiance().records();
  int met = 0;
  for (const CacheRecord<RecordValue>& r : records) {
    for (const CacheRecord<RecordValue>& s : records) {
      if (s.born != r.born + r.life || s.key != r.key || !(s.place == r.place)) continue;
      const RecordValue then = r.value + r.change * r.life;
      EXPECT_NEAR(then.irradiance.g, s.value.irradiance.g, 1e-9 + 1e-9 * s.value.irradiance.g);
      EXPECT_NEAR(then.rotation_x.g, s.value.rotation_x.g, 1e-6);
      EXPECT_NEAR(then.translation_y.g, s.value.translation_y.g, 1e-6);
      ++met;
    }
  }
  EXPECT_GT(met, 100);
}

TEST(CachingMethod, GradientsAreNearerToTheTruthThanNone) {
  // Records that live for 4 frames under a moving lamp, whatever changes: what they say in the last
  // of them, against what is sampled then with the same random numbers.
  const AnimatedScene& scene = demo("moving-light");
  double accuracy[3] = {};
  for (const auto gradients : {TemporalGradients::none, TemporalGradients::extrapolated,
                               TemporalGradients::interpolated}) {
    CachingOptions o = small(true);
    o.gradients = gradients;
    o.age = {100, 4};
    o.check = 60;
    CachingMethod method(scene, o);
    method.prepare(20, 5, {});
    for (int f = 20; f < 24; ++f) {
      const FramePicture p = method.frame(f, {});
      accuracy[static_cast<std::size_t>(gradients)] = p.figure[9];
      EXPECT_LT(p.figure[10], p.figure[11]) << "reprojection against none, frame " << f;
    }
  }
  // A first derivative, estimated without shadows that move, leaves most of the curve; between two
  // samples a chord leaves little of it.
  EXPECT_LT(1 - accuracy[1], 0.85 * (1 - accuracy[0]));
  EXPECT_LT(1 - accuracy[2], 0.6 * (1 - accuracy[0])) << accuracy[1];
}

TEST(MotionPlan, SaysWhatMoves) {
  const MotionPlan box = plan_motion(demo("cube-in-box"));
  EXPECT_EQ(box.method, MotionPlan::Method::trc);
  EXPECT_EQ(box.moving, 0.5);  // 12 of 24 triangles are the cube's
  EXPECT_EQ(box.moving_lights, 0);
  EXPECT_EQ(box.frames, 401);
  const MotionPlan light = plan_motion(demo("moving-light"));
  EXPECT_EQ(light.method, MotionPlan::Method::trc);
  EXPECT_EQ(light.moving, 0);
  EXPECT_EQ(light.moving_lights, 1);
  // A still scene under distant light.
  const auto file = std::filesystem::temp_directory_path() /
                    ("haarlight-still" + std::to_string(::getpid()) + ".glb");
  data_gen::save_scene(file, data_gen::make_scene("cornell"));
  const MotionPlan still = plan_motion(AnimatedScene(file));
  std::filesystem::remove(file);
  EXPECT_EQ(still.method, MotionPlan::Method::prt) << still.why;
}

TEST(MotionPlan, InteractionIsWhatAPersonTouches) {
  const AnimatedScene& scene = demo("cube-in-box");
  const AnimatedFrame frame = scene.at(0);
  double area[2] = {};
  std::map<std::uint32_t, int> triangles;
  for (std::uint32_t t = 0; t < frame.scene.triangle.size(); ++t) ++triangles[scene.instance_of(t)];
  Vec3 low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9}, low_all = low, high_all = high;
  for (std::uint32_t t = 0; t < frame.scene.triangle.size(); ++t) {
    const auto& v = frame.scene.triangle[t].vertex;
    const Vec3 &a = frame.scene.position[v[0]], &b = frame.scene.position[v[1]],
               &c = frame.scene.position[v[2]];
    const bool cube = triangles[scene.instance_of(t)] == 12;  // walls have 2
    area[cube] += 0.5 * length(cross(b - a, c - a));
    for (const Vec3& p : {a, b, c}) {
      const auto grow = [&p](Vec3& l, Vec3& h) {
        l = {std::min(l.x, p.x), std::min(l.y, p.y), std::min(l.z, p.z)};
        h = {std::max(h.x, p.x), std::max(h.y, p.y), std::max(h.z, p.z)};
      };
      grow(low_all, high_all);
      if (cube) grow(low, high);
    }
  }
  const auto surface = [](const Vec3& d) { return d.x * d.y + d.y * d.z + d.z * d.x; };
  const double passed = surface(high - low) / surface(high_all - low_all);
  const double on_it = area[1] / (area[0] + area[1]);
  const MotionPlan plan = plan_interaction(scene);
  EXPECT_EQ(plan.method, MotionPlan::Method::tic) << plan.why;
  EXPECT_NEAR(plan.touched, passed + on_it - passed * on_it, 1e-9);
  EXPECT_GT(plan.touched, 0.02);
  EXPECT_LT(plan.touched, 0.5);
  // One of many balls touches less than one cube.
  EXPECT_LT(plan_interaction(demo("spheres")).touched, plan.touched);
  EXPECT_NE(plan.why.find("of 1 bodies"), std::string::npos) << plan.why;
}

TEST(CachingMethod, StopsWhenTold) {
  CachingMethod method(demo("cube-in-box"), small(true));
  EXPECT_THROW(method.frame(0, [](double) { return false; }), Error);
}

TEST(CachingMethod, RefusesWhatMakesNoSense) {
  CachingOptions o = small(true);
  o.least_spacing = 10, o.most_spacing = 5;
  EXPECT_THROW(CachingMethod(demo("cube-in-box"), o), Error);
  o = small(true);
  o.age.longest = 0;
  EXPECT_THROW(CachingMethod(demo("cube-in-box"), o), Error);
}

}  // namespace
}  // namespace haarlight
