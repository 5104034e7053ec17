// Scenes that move: keys, clips, morphs, cameras and lights read from glTF.

#include "caching/animated_scene.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>

#include "caching/keyframes.h"
#include "core/error.h"
#include "core/image_io.h"
#include "data_gen/animations.h"
#include "tests/caching/small_gltf.h"

namespace haarlight {
namespace {

using nlohmann::json;

std::filesystem::path scratch(const std::string& name) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("haarlight-animated-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  return folder / name;
}

std::filesystem::path written(SmallGltf file, const std::string& name) {
  std::ofstream(scratch(name + ".bin"), std::ios::binary) << file.bytes;
  file.gltf["buffers"] = json::array({{{"uri", name + ".bin"}, {"byteLength", file.bytes.size()}}});
  const auto path = scratch(name + ".gltf");
  std::ofstream(path) << file.gltf.dump();
  return path;
}

void expect_near(const Vec3& found, const Vec3& wanted) {
  // Keys are floats: 2^-24 of numbers up to 4, a few operations on them.
  EXPECT_LT(length(found - wanted), 4e-6) << found.x << " " << found.y << " " << found.z;
}

TEST(AnimatedScene, NodesClipsMorphsLightsAndMaterialsMoveTogether) {
  const AnimatedScene scene(written(SmallGltf(), "small"), 2);  // half a second a frame
  EXPECT_EQ(scene.frames(), 3);
  ASSERT_EQ(scene.triangle_count(), 1u);
  EXPECT_EQ(scene.instance_of(0), 1u);

  // Halfway: moved by 2, turned by 45 degrees about z, corner 0 lifted by half of 2.
  const AnimatedFrame half = scene.at(1);
  const double c = std::sqrt(0.5);
  expect_near(half.scene.position[0], {2, 0, 1});
  expect_near(half.scene.position[1], {2 + c, c, 0});
  expect_near(half.scene.position[2], {2 - c, c, 0});
  EXPECT_NEAR(half.emission[0].radiance.b, 0.25, 1e-7);
  ASSERT_TRUE(half.scene.camera);
  expect_near(half.scene.camera->position, {0, 0, 9});
  ASSERT_EQ(half.light.size(), 1u);
  expect_near(half.light[0].position, {0, 5, 0});
  expect_near(half.light[0].direction, {0, 0, -1});
  EXPECT_NEAR(half.light[0].intensity.g, 1.5, 1e-12);

  // Before the first key and after the last their values hold, also a billion frames on.
  const AnimatedFrame last = scene.at(2), late = scene.at(1'000'000'000);
  expect_near(last.scene.position[1], {4, 1, 0});
  EXPECT_EQ(last.scene.position, late.scene.position);
}

TEST(AnimatedScene, SpotsFadeBetweenTheirCones) {
  SceneLight light;
  light.kind = SceneLight::Kind::spot;
  light.intensity = {8, 8, 8};
  light.inner = 0.2, light.outer = 0.6;
  const auto at = [&](double angle) {
    return light_at(light, Vec3{std::sin(angle), 0, -std::cos(angle)} * 2.0).irradiance.r;
  };
  EXPECT_NEAR(at(0.1), 2, 1e-12);  // 8 / 2^2
  EXPECT_EQ(at(0.7), 0);
  EXPECT_GT(at(0.4), 0);
  EXPECT_LT(at(0.4), 2);
  EXPECT_EQ(light_at(light, light.position).irradiance, RgbD());  // no direction, no NaN
}

TEST(Keyframes, CubicSplinesThroughACubicAreThatCubic) {
  // x(t) = t^3 - 2 t at t = 0, 2 and 3: a Hermite spline with its slopes is the cubic itself.
  Keyframes keys;
  keys.interpolation = Interpolation::cubic;
  for (const double t : {0.0, 2.0, 3.0}) {
    keys.time.push_back(t);
    for (const double v : {3 * t * t - 2, t * t * t - 2 * t, 3 * t * t - 2})
      keys.value.push_back(v);
  }
  std::array<double, 1> out{};
  for (const double t : {0.0, 0.3, 1.1, 1.9, 2.0, 2.7, 3.0}) {
    keys.at(t, out);
    EXPECT_NEAR(out[0], t * t * t - 2 * t, 1e-12) << t;
  }
}

TEST(Keyframes, RotationsTakeTheShorterArcAtAnEvenRate) {
  Keyframes keys;
  keys.width = 4, keys.rotation = true;
  keys.time = {0, 1};
  const double a = 1.2;  // radians about y; the second key has its sign turned
  keys.value = {0, 0, 0, 1, 0, -std::sin(a / 2), 0, -std::cos(a / 2)};
  std::array<double, 4> q{};
  for (const double t : {0.0, 0.25, 0.5, 1.0}) {
    keys.at(t, q);
    const double sign = q[3] < 0 ? -1 : 1;  // q and -q are one rotation
    EXPECT_NEAR(sign * q[1], std::sin(t * a / 2), 1e-12);
    EXPECT_NEAR(sign * q[3], std::cos(t * a / 2), 1e-12);
  }
}

TEST(AnimatedScene, APictureBehindEverythingTurnsByKeys) {
  // Blue, but for a red quarter about +X: u = 3/4.
  Image picture(16, 8);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 16; ++x) {
      picture.at(x, y) = x >= 10 && x < 14 ? Rgb{1, 0, 0} : Rgb{0, 0, 1};
    }
  }
  save_image(scratch("sky.exr"), picture);
  SmallGltf file;
  const auto time = file.add({0, 1}, "SCALAR", 1);
  const auto turn = file.add({0, static_cast<float>(kPi)}, "SCALAR", 1);
  file.gltf["scenes"][0]["extras"]["haarlight"]["environment"] = {{"uri", "sky.exr"}};
  json pointed{{"path", "pointer"}};
  pointed["extensions"]["KHR_animation_pointer"]["pointer"] =
      "/scenes/0/extras/haarlight/environment/rotation";
  file.gltf["animations"].push_back({{"samplers", {{{"input", time}, {"output", turn}}}},
                                     {"channels", {{{"sampler", 0}, {"target", pointed}}}}});
  const AnimatedScene scene(written(file, "sky"), 2);  // half a second a frame
  // A quarter turn a frame about +Y: from +X to -Z and to -X.
  const Vec3 where[] = {{1, 0, 0}, {0, 0, -1}, {-1, 0, 0}};
  for (int frame = 0; frame < 3; ++frame) {
    const AnimatedFrame now = scene.at(frame);
    for (int other = 0; other < 3; ++other) {
      const RgbD light = now.background_from(where[other]);
      EXPECT_NEAR(light.r, other == frame ? 1 : 0, 1e-6) << frame << other;
      EXPECT_NEAR(light.b, other == frame ? 0 : 1, 1e-6) << frame << other;
    }
  }
  file.gltf["scenes"][0]["extras"]["haarlight"]["environment"] = {{"uri", "nowhere.exr"}};
  EXPECT_THROW(AnimatedScene(written(file, "no sky")), Error);
}

TEST(AnimatedScene, WhatAPersonCarriesStaysThere) {
  AnimatedScene scene(written(SmallGltf(), "carried"), 2);
  const AnimatedFrame before = scene.at(1);
  // Node 1, the triangle, hangs on node 0; node 3 is the lamp.
  scene.carry(0, {0, 1, 0});
  scene.carry(1, {0.5, 0, 0});
  ASSERT_EQ(scene.light_nodes(), std::vector<std::uint32_t>{3});
  scene.carry(3, {0, 0, 2});
  Camera camera = look_at({1, 2, 3}, {0, 0, 0}, 0.5, 8, 8);
  scene.set_camera(camera);
  const AnimatedFrame after = scene.at(1);
  for (std::size_t v = 0; v < 3; ++v) {
    expect_near(after.scene.position[v], before.scene.position[v] + Vec3{0.5, 1, 0});
  }
  expect_near(after.light[0].position, before.light[0].position + Vec3{0, 0, 2});
  EXPECT_EQ(after.scene.camera, camera);
  scene.carry(0, {}), scene.carry(1, {}), scene.carry(3, {});
  scene.set_camera({});
  EXPECT_EQ(scene.at(1).scene.position, before.scene.position);
  EXPECT_EQ(scene.at(1).scene.camera, before.scene.camera);
  EXPECT_THROW(scene.carry(4, {}), Error);
}

TEST(AnimatedScene, WrongAnimationsAreRefusedByName) {
  const auto refused = [](SmallGltf& file, const std::string& name) {
    try {
      const AnimatedScene scene(written(file, name));
      return std::string();
    } catch (const Error& error) {
      return std::string(error.what());
    }
  };
  SmallGltf node, keys, pointer, reach;
  node.gltf["animations"][0]["channels"][0]["target"]["node"] = 77;
  EXPECT_NE(refused(node, "node"), "");
  keys.gltf["animations"][0]["samplers"][0]["output"] = 1;  // three vectors for two keys
  EXPECT_NE(refused(keys, "keys").find("expected 6 numbers"), std::string::npos);
  pointer.gltf["animations"][1]["channels"][1]["target"]["extensions"]["KHR_animation_pointer"]
              ["pointer"] = "/materials/0/name";
  EXPECT_NE(refused(pointer, "pointer").find("/materials/0/name"), std::string::npos);
  reach.gltf["accessors"][6]["count"] = 1'000'000'000'000;
  EXPECT_NE(refused(reach, "reach"), "");
}

TEST(AnimatedScene, DataScenesAreReadAsTheyWereMade) {
  for (const auto& entry : data_gen::animations()) {
    const auto file = scratch(std::string(entry.name) + ".glb");
    const std::size_t triangles = data_gen::save_animation(file, entry.name);
    const AnimatedScene scene(file);
    EXPECT_EQ(scene.triangle_count(), triangles) << entry.name;
    EXPECT_EQ(scene.frames(), 401) << entry.name;
    const AnimatedFrame a = scene.at(10), b = scene.at(11);
    EXPECT_TRUE(a.scene.camera) << entry.name;
    EXPECT_EQ(a.light.size(), 1u) << entry.name;
    const bool moves =
        a.scene.position != b.scene.position || a.light[0].position != b.light[0].position;
    EXPECT_TRUE(moves) << entry.name;
  }
}

TEST(AnimatedScene, DataScenesAreAsLargeAsThoseOfThePapers) {
  // Gautron and others 2007, section 6; Debattista and others 2009, Figure 1.
  const std::pair<const char*, double> wanted[] = {
      {"flying-kite", 28e3}, {"spheres", 64e3}, {"interior", 200e3}, {"cornell-bunny", 65e3}};
  for (const auto& [name, size] : wanted) {
    const auto triangles = static_cast<double>(
        data_gen::save_animation(scratch(std::string("size ") + name + ".glb"), name));
    EXPECT_NEAR(triangles, size, 0.1 * size) << name;
  }
}

TEST(AnimatedScene, AKiteOfPaintedClothIsRead) {
  const auto file = scratch("kite.glb");
  data_gen::save_animation(file, "flying-kite");
  const AnimatedScene animation(file);
  const AnimatedFrame a = animation.at(0), b = animation.at(13);
  // The cloth: where its material is, a picture of 128 x 128 with a blue disc about (0.5, 0.66).
  const auto cloth = std::find_if(a.scene.material.begin(), a.scene.material.end(),
                                  [](const Material& m) { return m.name == "kite cloth"; });
  ASSERT_NE(cloth, a.scene.material.end());
  ASSERT_GE(cloth->texture, 0);
  const Image& picture = a.scene.texture[static_cast<std::size_t>(cloth->texture)];
  EXPECT_EQ(picture.width, 128);
  const Rgb disc = picture.at(70, 128 * 40 / 100);
  EXPECT_GT(disc.b, 2 * disc.r);
  // It bends: a rigid body keeps all distances, a cloth that waves does not.
  const auto material = static_cast<std::uint32_t>(cloth - a.scene.material.begin());
  double most = 0;
  for (const Triangle& t : a.scene.triangle) {
    if (t.material != material) continue;
    const auto side = [&](const AnimatedFrame& f) {
      return length(f.scene.position[t.vertex[0]] - f.scene.position[t.vertex[2]]);
    };
    most = std::max(most, std::abs(side(b) / side(a) - 1));
    for (const std::uint32_t v : t.vertex) {
      EXPECT_GE(a.scene.uv[v][1], -1e-6f);
      EXPECT_LE(a.scene.uv[v][1], 1 + 1e-6f);
    }
  }
  EXPECT_GT(most, 1e-3);
}

TEST(AnimatedScene, AsManyBunniesBounceAsAreAskedFor) {
  for (const int count : {1, 4, 9}) {
    const auto file = scratch("bunnies.glb");
    data_gen::AnimationOptions options;
    options.count = count;
    Scene tetrahedron;  // in place of the bunny, so that the file is small
    tetrahedron.position = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    tetrahedron.normal.assign(4, {0, 1, 0}), tetrahedron.uv.resize(4);
    tetrahedron.triangle = {{{0, 2, 1}, 0}, {{0, 1, 3}, 0}, {{0, 3, 2}, 0}, {{1, 2, 3}, 0}};
    options.figure = tetrahedron;
    EXPECT_EQ(data_gen::save_animation(file, "bunnies", options), 12u + 9 * 4u);
    const AnimatedScene scene(file);
    const AnimatedFrame a = scene.at(3), b = scene.at(9);
    std::set<std::uint32_t> moved;
    for (std::uint32_t t = 0; t < scene.triangle_count(); ++t) {
      const auto v = a.scene.triangle[t].vertex[0];
      if (a.scene.position[v] != b.scene.position[v]) moved.insert(scene.instance_of(t));
    }
    EXPECT_EQ(moved.size(), static_cast<std::size_t>(count));
  }
  data_gen::AnimationOptions ten;
  ten.count = 10;
  EXPECT_THROW(data_gen::save_animation(scratch("ten.glb"), "bunnies", ten), Error);
}

}  // namespace
}  // namespace haarlight
