// Plans: nothing is simulated that a scene does not call for, and what is left out costs what the
// plan says.

#include "precompute/plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "data_gen/merl.h"
#include "precompute/material_import.h"
#include "precompute/plan_scene.h"
#include "precompute/precompute.h"
#include "precompute/precompute_mesh.h"
#include "precompute/scene_objects.h"
#include "tests/core/temporary_folder.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

const EffectEstimate& row(const Plan& plan, const std::string& effect) {
  const auto at = std::find_if(plan.rows.begin(), plan.rows.end(),
                               [&](const EffectEstimate& r) { return r.effect == effect; });
  EXPECT_NE(at, plan.rows.end()) << effect;
  return *at;
}

PlanOptions quick() {
  PlanOptions options;
  options.trace.face_size = 16;
  options.costs = false;
  return options;
}

Camera camera_for(int size) { return look_at({0.5, 2.5, 4}, {0, 0.3, 0}, 0.7, size, size); }

// A room without a front and a roof, seen through the front.
Scene room(const Rgb& albedo) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
  shapes::add_quad(scene, {-1, 0, -1}, {2, 0, 0}, {0, 1.5, 0});
  shapes::add_quad(scene, {-1, 0, -1}, {0, 1.5, 0}, {0, 0, 2});
  shapes::add_quad(scene, {1, 0, -1}, {0, 0, 2}, {0, 1.5, 0});
  scene.material[0].albedo = albedo;
  return scene;
}

// ---- objects ------------------------------------------------------------------------------------

TEST(SceneObjects, ConvexBodiesAreFound) {
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {0, 0, 0}, 1, 4);
  shapes::add_box(scene, {2, 0, 0}, {3, 1, 1});  // each face has its own vertices
  shapes::add_quad(scene, {-9, -3, -9}, {0, 0, 18}, {18, 0, 0});
  const SceneObjects objects = find_objects(scene);
  ASSERT_EQ(objects.count(), 3);
  EXPECT_EQ(objects.convex, (std::vector<bool>{true, true, false}));  // a plane is not closed
}

TEST(SceneObjects, ADentIsNotConvex) {
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {0, 0, 0}, 1, 3);
  ASSERT_TRUE(find_objects(scene).convex[0]);
  Scene dented = scene;
  dented.position[100] = 0.9 * dented.position[100];
  EXPECT_FALSE(find_objects(dented).convex[0]);
  Scene open = scene;
  open.triangle.pop_back();
  EXPECT_FALSE(find_objects(open).convex[0]);
  // Inside out it still is a convex body.
  Scene flipped = scene;
  for (Triangle& t : flipped.triangle) std::swap(t.vertex[0], t.vertex[1]);
  EXPECT_TRUE(find_objects(flipped).convex[0]);
}

// ---- plans --------------------------------------------------------------------------------------

// A convex, diffuse object in the open needs no ray at all: not for the plan, not for its vertices.
TEST(Plan, AConvexBodyNeedsNoRay) {
  const TemporaryFolder folder;
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {0, 0, 0}, 1, 3);
  const Plan plan = plan_mesh(scene, quick());
  EXPECT_EQ(plan.rays, 0);
  EXPECT_FALSE(row(plan, "shadows").needed);
  EXPECT_FALSE(row(plan, "self-occlusion").needed);
  EXPECT_FALSE(row(plan, "interreflection").needed);
  EXPECT_EQ(plan.effects, (Effects{false, 0, false, false, false, false}));
  EXPECT_EQ(plan.error, 0);

  MeshOptions options;
  options.trace.face_size = 16;
  options.trace.effects = plan.effects;
  options.subdivide = false;
  const MeshReport report =
      precompute_mesh(scene, camera_for(64), options, folder.path() / "ball.hlt");
  EXPECT_EQ(report.run.rays, 0);
  EXPECT_EQ(report.run.ray_counts.shadow, 0);

  // And it is right: with rays the light is the same.
  MeshOptions traced = options;
  traced.trace.effects.shadows = true;
  const MeshReport with =
      precompute_mesh(scene, camera_for(64), traced, folder.path() / "traced.hlt");
  EXPECT_GT(with.run.rays, 0);
  const Transport a = Transport::open(folder.path() / "ball.hlt");
  const Transport b = Transport::open(folder.path() / "traced.hlt");
  EXPECT_EQ(a.chunk_bytes(), b.chunk_bytes());
  for (int j = 0; j < a.layout().size(); ++j) {
    EXPECT_EQ(a.column_norms()[static_cast<std::size_t>(j)],
              b.column_norms()[static_cast<std::size_t>(j)]);
  }
}

TEST(Plan, ABlackRoomNeedsNoBounce) {
  const Plan plan = plan_image(room({0, 0, 0}), camera_for(64), quick());
  EXPECT_FALSE(row(plan, "interreflection").needed);
  EXPECT_EQ(plan.effects.bounces, 0);
  const Plan white = plan_image(room({0.8f, 0.8f, 0.8f}), camera_for(64), quick());
  EXPECT_TRUE(row(white, "interreflection").needed);
  EXPECT_GE(white.effects.bounces, 2);
  EXPECT_GT(row(white, "interreflection").error, 0.05);
}

// A grey scene is stored in one channel, at a third of the bytes of three.
TEST(Plan, AGreySceneNeedsOneChannel) {
  const TemporaryFolder folder;
  const Plan grey = plan_image(room({0.8f, 0.8f, 0.8f}), camera_for(64), quick());
  EXPECT_FALSE(row(grey, "color").needed);
  EXPECT_FALSE(grey.effects.color);

  Scene colored = room({0.8f, 0.8f, 0.8f});
  Material red;
  red.albedo = {0.8f, 0.1f, 0.1f};
  colored.material.push_back(red);
  for (std::size_t t = 4; t < colored.triangle.size(); ++t) colored.triangle[t].material = 1;
  const Plan bleeding = plan_image(colored, camera_for(64), quick());
  EXPECT_TRUE(row(bleeding, "color").needed);

  PrecomputeOptions options;
  options.trace.face_size = 16;
  options.error = 0;
  options.trace.effects = grey.effects;
  options.trace.effects.bounces = 1;
  options.trace.paths = 512;
  const auto one = precompute_image(room({0.8f, 0.8f, 0.8f}), camera_for(32), options,
                                    folder.path() / "grey.hlt");
  EXPECT_EQ(one.rgb_blocks, 0);
  options.trace.effects.color = true;
  const auto three =
      precompute_image(colored, camera_for(32), options, folder.path() / "colored.hlt");
  EXPECT_GT(three.rgb_blocks, three.blocks / 2);
  const double ratio =
      static_cast<double>(Transport::open(folder.path() / "colored.hlt").chunk_bytes()) /
      static_cast<double>(Transport::open(folder.path() / "grey.hlt").chunk_bytes());
  // Blocks have 18 bytes grey and 54 in colour, beside bits of presence; some rows stay grey.
  EXPECT_GT(ratio, 1.5);
  EXPECT_LE(ratio, 3.1);
}

TEST(Plan, WhatMaterialsDoNotHaveIsNotLookedFor) {
  const Plan plan = plan_image(room({0.5f, 0.5f, 0.5f}), camera_for(64), quick());
  for (const char* effect : {"gloss", "specular", "caustics", "view dependence"}) {
    EXPECT_FALSE(row(plan, effect).needed) << effect;
    EXPECT_EQ(row(plan, effect).error, 0) << effect;
  }
  EXPECT_FALSE(plan.effects.gloss || plan.effects.specular || plan.effects.caustics);
}

TEST(Plan, MirrorsCallForSpecularAndCaustics) {
  Scene scene = room({0.5f, 0.5f, 0.5f});
  Material mirror;
  mirror.model = SurfaceModel::mirror;
  mirror.albedo = {0.9f, 0.9f, 0.9f};
  scene.material.push_back(mirror);
  shapes::add_sphere(scene, {0, 0.5, 0}, 0.5, 4, 1);
  const Plan plan = plan_image(scene, camera_for(64), quick());
  EXPECT_TRUE(plan.effects.specular);
  EXPECT_TRUE(plan.effects.caustics);
  EXPECT_GT(row(plan, "specular").error, 0.05);
  EXPECT_GT(row(plan, "caustics").error, 0.01);
}

// A table of a BRDF looks different from each side as a lobe does, which no probe of a fixed view
// sees.
TEST(Plan, MeasuredMaterialsCallForTerms) {
  const TemporaryFolder folder;
  data_gen::write_merl(folder.path() / "a.binary", {}, {40, 30, 40});
  Scene scene = room({0.5f, 0.5f, 0.5f});
  set_measured(scene, 0, folder.path() / "a.binary");
  const Plan plan = plan_mesh(scene, quick());
  EXPECT_TRUE(plan.effects.gloss);
  EXPECT_TRUE(row(plan, "gloss").needed);
  EXPECT_GT(row(plan, "gloss").error, 0.01);
  EXPECT_NE(row(plan, "gloss").why.find("100 %"), std::string::npos) << row(plan, "gloss").why;
  EXPECT_TRUE(row(plan, "view dependence").needed);
  EXPECT_GT(row(plan, "view dependence").error, 0.01);
}

// What is left out stays below half the error allowed, whatever that is.
TEST(Plan, LeavesOutMoreTheMoreErrorIsAllowed) {
  Scene scene = room({0.3f, 0.3f, 0.3f});
  int most = kMostBounces + 1;
  for (const double error : {0.002, 0.02, 0.5}) {
    PlanOptions options = quick();
    options.error = error;
    const Plan plan = plan_image(scene, camera_for(64), options);
    EXPECT_LE(plan.error, 0.5 * error);
    EXPECT_LT(plan.effects.bounces, most) << error;
    most = plan.effects.bounces + (plan.effects.bounces == 0 ? 1 : 0);
  }
}

TEST(Plan, SamePlanEveryTimeAndAsJson) {
  const Scene scene = room({0.5f, 0.4f, 0.3f});
  const Plan a = plan_image(scene, camera_for(64), quick());
  const Plan b = plan_image(scene, camera_for(64), quick());
  EXPECT_EQ(to_json(a, false), to_json(b, false));
  const auto json = nlohmann::json::parse(to_json(a, true));
  EXPECT_EQ(json["effects"], to_string(a.effects));
  EXPECT_EQ(json["rows"].size(), a.rows.size());
  EXPECT_TRUE(json["rows"][0].contains("seconds"));
  EXPECT_FALSE(nlohmann::json::parse(to_json(a, false))["rows"][0].contains("seconds"));
}

TEST(Plan, CostsAreOfTheOrderOfARun) {
  const TemporaryFolder folder;
  const Scene scene = room({0.5f, 0.5f, 0.5f});
  PlanOptions options = quick();
  options.costs = true;
  const Plan plan = plan_image(scene, camera_for(96), options);
  PrecomputeOptions run;
  run.trace = options.trace;
  run.trace.effects = plan.effects;
  const auto report = precompute_image(scene, camera_for(96), run, folder.path() / "room.hlt");
  EXPECT_GT(plan.seconds, 0);
  EXPECT_GT(plan.look_seconds, 0);
  const double chunks =
      static_cast<double>(Transport::open(folder.path() / "room.hlt").chunk_bytes());
  EXPECT_GT(plan.bytes, 0.5 * chunks);
  EXPECT_LT(plan.bytes, 2 * chunks);
  EXPECT_EQ(report.rgb_blocks, 0);
}

}  // namespace
}  // namespace haarlight
