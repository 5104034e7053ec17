// How textures lie on surfaces: KHR_texture_transform and second coordinates, from glTF to a hit.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/image_io.h"
#include "precompute/gltf_materials.h"
#include "precompute/scene_import.h"
#include "precompute/surface.h"
#include "precompute/texture.h"
#include "tests/core/temporary_folder.h"

namespace haarlight {
namespace {

// The extension's own words in glTF's axes, v down: scale, then turn counter-clockwise as one looks
// at the picture, then move.
std::array<double, 2> by_the_book(double u, double v, double sx, double sy, double angle, double tx,
                                  double ty) {
  const double x = sx * u, y = sy * v;
  return {std::cos(angle) * x + std::sin(angle) * y + tx,
          -std::sin(angle) * x + std::cos(angle) * y + ty};
}

TEST(TextureMap, TransformsAsTheExtensionSays) {
  const nlohmann::json file = nlohmann::json::parse(R"({"materials":[{
      "pbrMetallicRoughness":{
        "baseColorTexture":{"index":0,"texCoord":1,"extensions":{"KHR_texture_transform":{
          "offset":[0.25,-0.5],"rotation":0.7,"scale":[2,3]}}},
        "metallicRoughnessTexture":{"index":0,"texCoord":0,"extensions":{"KHR_texture_transform":{
          "texCoord":1}}}},
      "normalTexture":{"index":0,"texCoord":1}},{}]})");
  const auto materials = gltf_materials(file);
  ASSERT_EQ(materials.size(), 2u);
  const GltfMaterial& m = materials[0];
  EXPECT_TRUE(m.base_map.second);
  EXPECT_TRUE(m.metallic_roughness_map.second);  // the extension's word goes before the texture's
  EXPECT_TRUE(m.normal_map.second);
  EXPECT_EQ(m.normal_map.matrix, TextureMap{}.matrix);
  EXPECT_EQ(materials[1].base_map, TextureMap{});

  Scene scene;
  for (const auto& [u, v] : {std::array{0.0f, 0.0f}, {1.0f, 0.0f}, {0.3f, 0.8f}}) {
    scene.uv.push_back({9, 9});  // not these
    scene.uv2.push_back({u, 1 - v});
    const auto expected =
        by_the_book(static_cast<double>(u), static_cast<double>(v), 2, 3, 0.7, 0.25, -0.5);
    const auto got =
        texture_place(scene, static_cast<std::uint32_t>(scene.uv.size() - 1), m.base_map);
    EXPECT_NEAR(got[0], expected[0], 1e-6);
    EXPECT_NEAR(1 - got[1], expected[1], 1e-6);
  }
}

std::string base64(const std::vector<float>& values) {
  static const char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const auto* bytes = reinterpret_cast<const unsigned char*>(values.data());
  const std::size_t count = values.size() * sizeof(float);
  std::string out;
  for (std::size_t i = 0; i < count; i += 3) {
    unsigned word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (i + k < count ? bytes[i + k] : 0u);
    for (int shift = 18; shift >= 0; shift -= 6) out += kDigits[word >> shift & 63u];
  }
  for (std::size_t k = 0; k < (3 - count % 3) % 3; ++k) out[out.size() - 1 - k] = '=';
  return out;
}

// A square whose first coordinates are all one point of a picture of four colours and whose second
// ones span it, turned by a quarter: each of four places shows the colour that the book says.
TEST(TextureMap, SecondCoordinatesAreSeenByRays) {
  const TemporaryFolder folder;
  Image picture(2, 2);
  picture.pixels = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  save_image(folder / "four.png", picture);
  // Two triangles in the plane z = 0: positions, first and second coordinates.
  const float corner[6][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}};
  std::vector<float> values;
  for (const auto& c : corner) values.insert(values.end(), {c[0], c[1], 0});
  for (int i = 0; i < 6; ++i) values.insert(values.end(), {0.25f, 0.25f});
  for (const auto& c : corner) values.insert(values.end(), {c[0], 1 - c[1]});  // v runs down
  const auto view = [](int offset, int length) {
    return nlohmann::json{{"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}};
  };
  const auto accessor = [](int number, const char* type) {
    return nlohmann::json{
        {"bufferView", number}, {"componentType", 5126}, {"count", 6}, {"type", type}};
  };
  nlohmann::json positions = accessor(0, "VEC3");
  positions["min"] = {0, 0, 0}, positions["max"] = {1, 1, 0};
  const double angle = kPi / 2;
  const nlohmann::json gltf{
      {"asset", {{"version", "2.0"}}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", {{{"mesh", 0}}}},
      {"meshes",
       {{{"primitives",
          {{{"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}, {"TEXCOORD_1", 2}}},
            {"material", 0}}}}}}},
      {"accessors", {positions, accessor(1, "VEC2"), accessor(2, "VEC2")}},
      {"bufferViews", {view(0, 72), view(72, 48), view(120, 48)}},
      {"buffers",
       {{{"byteLength", 168}, {"uri", "data:application/octet-stream;base64," + base64(values)}}}},
      {"images", {{{"uri", "four.png"}}}},
      {"textures", {{{"source", 0}}}},
      {"materials",
       {{{"pbrMetallicRoughness",
          {{"metallicFactor", 0},
           {"baseColorTexture",
            {{"index", 0},
             {"texCoord", 1},
             {"extensions", {{"KHR_texture_transform", {{"rotation", angle}}}}}}}}}}}}};
  std::ofstream(folder / "a.gltf") << gltf.dump();
  const Scene scene = import_scene(folder / "a.gltf");
  ASSERT_EQ(scene.texture.size(), 1u);
  ASSERT_EQ(scene.uv2.size(), scene.position.size());
  const Visibility visibility(scene);
  for (const auto& [x, y] : {std::array{0.25, 0.25}, {0.75, 0.25}, {0.25, 0.75}, {0.75, 0.75}}) {
    const Vec3 from = visibility.to_local({x + 0.01, y - 0.01, 1});
    const auto hit = surface_hit(scene, visibility, from, {0, 0, -1});
    ASSERT_TRUE(hit);
    const auto [u, v] = by_the_book(x, 1 - y, 1, 1, angle, 0, 0);  // glTF's axes
    const auto column = static_cast<std::size_t>((u - std::floor(u)) * 2);
    const auto line = static_cast<std::size_t>((v - std::floor(v)) * 2);
    const Rgb expected = picture.pixels[2 * line + column];
    EXPECT_NEAR(hit->albedo.r, expected.r, 0.1) << x << " " << y;
    EXPECT_NEAR(hit->albedo.g, expected.g, 0.1) << x << " " << y;
    EXPECT_NEAR(hit->albedo.b, expected.b, 0.1) << x << " " << y;
  }
}

}  // namespace
}  // namespace haarlight
