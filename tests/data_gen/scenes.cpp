// The project's own scenes: sound meshes, the same every time, and whole in the files they go to.

#include "data_gen/scenes.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/image_io.h"
#include "data_gen/mesh_writer.h"
#include "data_gen/png.h"
#include "tests/reference/triangle_tree.h"

namespace haarlight::data_gen {
namespace {

using Point = std::array<float, 3>;

// A triangle as a file holds it: corners in order, normals with them, the material's number.
struct FileTriangle {
  std::array<Point, 3> position, normal;
  std::uint32_t material = 0;
  friend auto operator<=>(const FileTriangle&, const FileTriangle&) = default;
};

Point floats(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

std::vector<FileTriangle> triangles_of(const Scene& scene) {
  std::vector<FileTriangle> out;
  for (const Triangle& t : scene.triangle) {
    FileTriangle f;
    for (std::size_t k = 0; k < 3; ++k) {
      f.position[k] = floats(scene.position[t.vertex[k]]);
      f.normal[k] = floats(scene.normal[t.vertex[k]]);
    }
    f.material = t.material;
    out.push_back(f);
  }
  std::sort(out.begin(), out.end());
  return out;
}

class TemporaryFolder {
 public:
  TemporaryFolder()
      : path_(std::filesystem::temp_directory_path() /
              ("haarlight_scenes_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

std::string read_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

TEST(Scenes, MeshesAreSound) {
  for (const SceneEntry& entry : scenes()) {
    const Scene scene = entry.make(1);
    ASSERT_EQ(scene.normal.size(), scene.position.size()) << entry.name;
    ASSERT_EQ(scene.uv.size(), scene.position.size()) << entry.name;
    EXPECT_TRUE(scene.camera.has_value()) << entry.name;
    for (const Vec3& normal : scene.normal) ASSERT_NEAR(length(normal), 1, 1e-12) << entry.name;
    for (const Triangle& t : scene.triangle) {
      ASSERT_LT(t.material, scene.material.size()) << entry.name;
      for (const auto v : t.vertex) ASSERT_LT(v, scene.position.size()) << entry.name;
      // As a file holds them: no triangle may have lost its area to rounding.
      std::array<Vec3, 3> corner;
      for (std::size_t k = 0; k < 3; ++k) {
        const Point p = floats(scene.position[t.vertex[k]]);
        corner[k] = {p[0], p[1], p[2]};
      }
      const Vec3 area = cross(corner[1] - corner[0], corner[2] - corner[0]);
      ASSERT_GT(length(area), 0) << entry.name;
      // Smooth normals stay on their triangle's outside, but for the folds of a leaf's tip.
      const Vec3 flat = normalize(area);
      for (const auto v : t.vertex) ASSERT_GT(dot(flat, scene.normal[v]), -0.2) << entry.name;
    }
    for (const Material& m : scene.material) {
      // Matt things as bright as things are; a texture's colours are in it.
      const bool matt = m.model == SurfaceModel::phong && m.texture < 0;
      for (const float channel : {m.albedo.r, m.albedo.g, m.albedo.b}) {
        EXPECT_GE(channel, m.name == "black" ? 0.0f : 1e-3f) << entry.name << " " << m.name;
        EXPECT_LT(channel, matt ? 0.9f : 1.001f) << entry.name << " " << m.name;
      }
    }
  }
}

TEST(Scenes, PlantIsIntricateButAffordable) {
  const Scene plant = make_scene("plant");
  EXPECT_GT(plant.triangle.size(), 20000u);
  EXPECT_LT(plant.triangle.size(), 100000u);
  EXPECT_GT(plant.material.size(), 8u);
}

// Overbeck 2006, section 6.3: 40,029 vertices, largely on the ground.
TEST(Scenes, StreetHasFortyThousandVerticesMostOfThemOnTheGround) {
  const Scene street = make_scene("street");
  EXPECT_GE(street.position.size(), 36000u);
  EXPECT_LE(street.position.size(), 44000u);
  std::size_t on_ground = 0;
  for (std::size_t v = 0; v < street.position.size(); ++v) {
    on_ground += street.position[v].y < 0.14 && street.normal[v].y > 0.99;
  }
  EXPECT_GT(on_ground, street.position.size() / 2);
}

TEST(Scenes, OnlyPlantSpheresAndStreetAreLarge) {
  for (const SceneEntry& entry : scenes()) {
    if (entry.name != "plant" && entry.name != "spheres" && entry.name != "street") {
      EXPECT_LE(entry.make(1).triangle.size(), 30'000u) << entry.name;
    }
  }
}

// How often a material's triangles walk each edge one way and the other: once each if it bounds a
// body.
bool is_closed(const Scene& scene, const std::string& material) {
  using Corner = std::array<double, 3>;
  std::map<std::pair<Corner, Corner>, int> walked;
  for (const Triangle& t : scene.triangle) {
    if (scene.material[t.material].name != material) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 &a = scene.position[t.vertex[k]], &b = scene.position[t.vertex[(k + 1) % 3]];
      ++walked[{{a.x, a.y, a.z}, {b.x, b.y, b.z}}];
    }
  }
  for (const auto& [edge, times] : walked) {
    const auto back = walked.find({edge.second, edge.first});
    if (times != 1 || back == walked.end() || back->second != 1) return false;
  }
  return !walked.empty();
}

// Glass must know its inside, and metal must not show its own.
TEST(Scenes, BodiesOfGlassAndMetalAreClosed) {
  for (const char* body : {"crown glass", "slab", "green glass"}) {
    EXPECT_TRUE(is_closed(make_scene("glass"), body)) << body;
  }
  EXPECT_TRUE(is_closed(make_scene("ring"), "gold"));
  EXPECT_TRUE(is_closed(make_scene("metals"), "copper 3"));
  EXPECT_TRUE(is_closed(make_scene("convex"), "clay"));
  EXPECT_FALSE(is_closed(make_scene("cornell"), "red"));
}

TEST(Scenes, ConvexIsConvex) {
  const Scene scene = make_scene("convex");
  double highest = -1;
  for (const Triangle& t : scene.triangle) {
    const Vec3 a = scene.position[t.vertex[0]];
    const Vec3 n =
        normalize(cross(scene.position[t.vertex[1]] - a, scene.position[t.vertex[2]] - a));
    for (const Vec3& p : scene.position) highest = std::max(highest, dot(n, p - a));
  }
  // No corner above any triangle's plane. An ellipsoid's quads are not flat: one of their diagonals
  // lies inside by less than its height over the chord, 2 pi / 64 wide.
  EXPECT_LT(highest, 1e-3);
}

// From nowhere in the room but through the window: every way out crosses the window's opening.
TEST(Scenes, RoomIsLitThroughItsWindowOnly) {
  const Scene scene = make_scene("room");
  const reference::TriangleTree tree(scene);
  std::mt19937 random(4);
  std::normal_distribution<double> gauss;
  int out = 0;
  for (int i = 0; i < 40'000; ++i) {
    const Vec3 from{0.3, 1.2, 0.9};
    const Vec3 direction = normalize(Vec3{gauss(random), gauss(random), gauss(random)});
    if (tree.hit(from, direction, true)) continue;
    ++out;
    const double distance = (-2.5 - from.x) / direction.x;
    ASSERT_GT(distance, 0);
    const Vec3 at = from + direction * distance;
    EXPECT_TRUE(at.y > 0.85 && at.y < 2.25 && at.z > -1.0 && at.z < 0.7) << at.y << " " << at.z;
  }
  EXPECT_GT(out, 200);
}

TEST(Scenes, LeavesAreClosed) {
  // Every edge of a closed sheet belongs to two triangles that walk it in opposite directions.
  const Scene plant = make_scene("plant");
  using Corner = std::array<double, 3>;
  std::map<std::pair<Corner, Corner>, int> walked;
  std::size_t leaf_triangles = 0;
  for (const Triangle& t : plant.triangle) {
    if (plant.material[t.material].name.find("leaf") == std::string::npos) continue;
    ++leaf_triangles;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 &a = plant.position[t.vertex[k]], &b = plant.position[t.vertex[(k + 1) % 3]];
      ++walked[{{a.x, a.y, a.z}, {b.x, b.y, b.z}}];
    }
  }
  EXPECT_GT(leaf_triangles, 200u * 100);  // a few hundred leaves
  for (const auto& [edge, times] : walked) {
    ASSERT_EQ(times, 1);
    ASSERT_EQ(walked.count({edge.second, edge.first}), 1u);
  }
}

TEST(Scenes, SameSeedSameSceneOtherSeedOther) {
  for (const SceneEntry& entry : scenes()) {
    const auto first = triangles_of(entry.make(3));
    EXPECT_EQ(first, triangles_of(entry.make(3))) << entry.name;
    EXPECT_NE(first, triangles_of(entry.make(4))) << entry.name;
  }
}

TEST(Scenes, UnknownNameListsTheChoices) {
  try {
    make_scene("teapot");
    FAIL() << "an unknown name was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::invalid_argument);
    EXPECT_NE(std::string(error.what()).find("plant, pillars, spheres"), std::string::npos);
  }
}

// A plain reading of binary glTF, as its specification states it.
struct Glb {
  nlohmann::json json;
  std::string binary;

  explicit Glb(const std::string& bytes) {
    const auto u32 = [&](std::size_t at) {
      std::uint32_t value = 0;
      std::memcpy(&value, bytes.data() + at, 4);
      return value;
    };
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(u32(4), 2u);
    EXPECT_EQ(u32(8), bytes.size());
    const std::size_t text = u32(12);
    EXPECT_EQ(text % 4, 0u);
    EXPECT_EQ(bytes.substr(16, 4), "JSON");
    json = nlohmann::json::parse(bytes.substr(20, text));
    EXPECT_EQ(u32(20 + text) % 4, 0u);
    EXPECT_EQ(bytes.substr(24 + text, 4), std::string("BIN\0", 4));
    binary = bytes.substr(28 + text);
    EXPECT_EQ(binary.size(), u32(20 + text));
  }

  template <typename T>
  std::vector<T> read(std::size_t accessor) const {
    const auto& a = json["accessors"][accessor];
    const auto& view = json["bufferViews"][a["bufferView"].get<std::size_t>()];
    std::vector<T> values(a["count"].get<std::size_t>());
    EXPECT_EQ(view["byteLength"].get<std::size_t>(), values.size() * sizeof(T));
    std::memcpy(values.data(), binary.data() + view["byteOffset"].get<std::size_t>(),
                values.size() * sizeof(T));
    return values;
  }

  std::vector<FileTriangle> triangles() const {
    std::vector<FileTriangle> out;
    for (const auto& primitive : json["meshes"][0]["primitives"]) {
      const auto position_accessor = primitive["attributes"]["POSITION"].get<std::size_t>();
      const auto position = read<Point>(position_accessor);
      const auto normal = read<Point>(primitive["attributes"]["NORMAL"]);
      const auto index = read<std::uint32_t>(primitive["indices"]);
      for (std::size_t k = 0; k < 3; ++k) {
        float low = position[0][k], high = position[0][k];
        for (const Point& p : position) low = std::min(low, p[k]), high = std::max(high, p[k]);
        EXPECT_EQ(json["accessors"][position_accessor]["min"][k].get<float>(), low);
        EXPECT_EQ(json["accessors"][position_accessor]["max"][k].get<float>(), high);
      }
      for (std::size_t i = 0; i < index.size(); i += 3) {
        FileTriangle t;
        for (std::size_t k = 0; k < 3; ++k) {
          t.position[k] = position[index[i + k]];
          t.normal[k] = normal[index[i + k]];
        }
        t.material = primitive["material"];
        out.push_back(t);
      }
    }
    std::sort(out.begin(), out.end());
    return out;
  }
};

TEST(MeshWriter, GlbHoldsTheWholeScene) {
  const TemporaryFolder folder;
  for (const SceneEntry& entry : scenes()) {
    const Scene scene = entry.make(1);
    save_scene(folder / "scene.glb", scene);
    const Glb glb(read_file(folder / "scene.glb"));
    EXPECT_EQ(glb.triangles(), triangles_of(scene)) << entry.name;
    ASSERT_EQ(glb.json["materials"].size(), scene.material.size());
    for (std::size_t i = 0; i < scene.material.size(); ++i) {
      const auto color = glb.json["materials"][i]["pbrMetallicRoughness"]["baseColorFactor"];
      const Rgb& albedo = scene.material[i].albedo;
      // A Phong lobe is glTF's metal to others; what it is exactly stands beside it.
      const nlohmann::json::json_pointer phong("/extras/haarlight/phong");
      if (glb.json["materials"][i].contains(phong)) {
        const auto own = glb.json["materials"][i].at(phong);
        EXPECT_EQ((Rgb{own["diffuse"][0], own["diffuse"][1], own["diffuse"][2]}), albedo);
        EXPECT_EQ(own["exponent"].get<float>(), scene.material[i].exponent);
        continue;
      }
      EXPECT_EQ((Rgb{color[0], color[1], color[2]}), albedo) << entry.name;
    }
  }
}

TEST(MeshWriter, GlbSaysWhatMaterialsAre) {
  const TemporaryFolder folder;
  const auto written = [&](const Scene& scene) {
    save_scene(folder / "scene.glb", scene);
    return Glb(read_file(folder / "scene.glb"));
  };
  const auto named = [](const Glb& glb, const std::string& name) {
    for (const auto& m : glb.json["materials"]) {
      if (m["name"] == name) return m;
    }
    ADD_FAILURE() << name << " is not in the file";
    return nlohmann::json();
  };
  const Glb metals = written(make_scene("metals"));
  const auto copper = named(metals, "copper 2")["pbrMetallicRoughness"];
  EXPECT_EQ(copper["metallicFactor"], 1.0);
  EXPECT_EQ(copper["roughnessFactor"].get<float>(), 0.2f);
  EXPECT_FALSE(metals.json.contains("extensionsUsed"));

  const Glb glass = written(make_scene("glass"));
  EXPECT_EQ(
      glass.json["extensionsUsed"],
      (nlohmann::json{"KHR_materials_transmission", "KHR_materials_ior", "KHR_materials_volume"}));
  const auto crown = named(glass, "crown glass")["extensions"];
  EXPECT_EQ(crown["KHR_materials_transmission"]["transmissionFactor"], 1.0);
  EXPECT_EQ(crown["KHR_materials_ior"]["ior"].get<float>(), 1.52f);
  EXPECT_GT(crown["KHR_materials_volume"]["thicknessFactor"].get<double>(), 0);
  EXPECT_FALSE(crown["KHR_materials_volume"].contains("attenuationDistance"));
  // What is left after x metres is color^(x / distance) = exp(-extinction x).
  const auto green = named(glass, "green glass")["extensions"]["KHR_materials_volume"];
  const double distance = green["attenuationDistance"];
  const std::array extinction{3.5, 0.5, 2.2};
  for (std::size_t c = 0; c < 3; ++c) {
    const double color = green["attenuationColor"][c];
    EXPECT_GE(color, 0);
    EXPECT_LE(color, 1);
    EXPECT_NEAR(-std::log(color) / distance, extinction[c], 1e-6);
  }
  const auto mirror = named(glass, "mirror")["pbrMetallicRoughness"];
  EXPECT_EQ(mirror["metallicFactor"], 1.0);
  EXPECT_EQ(mirror["roughnessFactor"], 0.0);

  Scene pane = make_spheres(1);
  pane.material[1].model = SurfaceModel::glass;
  pane.material[1].thin = true;
  const auto thin = named(written(pane), pane.material[1].name)["extensions"];
  EXPECT_TRUE(thin.contains("KHR_materials_transmission"));
  EXPECT_FALSE(thin.contains("KHR_materials_volume"));
}

TEST(MeshWriter, GlbHoldsTextures) {
  const TemporaryFolder folder;
  Scene scene = make_scene("room");
  save_scene(folder / "scene.glb", scene);
  const Glb glb(read_file(folder / "scene.glb"));
  std::size_t screen = 0;
  while (scene.material[screen].name != "screen") ++screen;
  const auto material = glb.json["materials"][screen];
  EXPECT_EQ(material["alphaMode"], "MASK");
  EXPECT_EQ(material["alphaCutoff"], 0.5);
  const std::size_t texture = material["pbrMetallicRoughness"]["baseColorTexture"]["index"];
  const std::size_t image = glb.json["textures"][texture]["source"];
  EXPECT_EQ(glb.json["images"][image]["mimeType"], "image/png");
  const auto view =
      glb.json["bufferViews"][glb.json["images"][image]["bufferView"].get<std::size_t>()];
  // As any reader of PNG sees it (alpha is left out by this one; see the test of the file).
  std::ofstream(folder / "texture.png", std::ios::binary) << glb.binary.substr(
      view["byteOffset"].get<std::size_t>(), view["byteLength"].get<std::size_t>());
  const Image read = load_image(folder / "texture.png");
  ASSERT_EQ(read.width, scene.texture[0].width);
  ASSERT_EQ(read.height, scene.texture[0].height);
  int compared = 0;
  for (std::size_t i = 0; i < read.pixels.size(); ++i) {
    if (scene.alpha[0][i] < 1) continue;  // readers may multiply colour by alpha
    // Half a step of 8 bits, at most 2.4 / 1.055 / 255 / 2 = 0.0045 in linear values.
    EXPECT_NEAR(read.pixels[i].r, scene.texture[0].pixels[i].r, 0.0046);
    EXPECT_NEAR(read.pixels[i].b, scene.texture[0].pixels[i].b, 0.0046);
    ++compared;
  }
  EXPECT_GT(compared, 100);
  // The screen's corners keep their places in the picture, v turned round.
  for (const auto& primitive : glb.json["meshes"][0]["primitives"]) {
    const bool textured = primitive["material"] == screen;
    EXPECT_EQ(primitive["attributes"].contains("TEXCOORD_0"), textured);
    if (!textured) continue;
    const auto uv =
        glb.read<std::array<float, 2>>(primitive["attributes"]["TEXCOORD_0"].get<std::size_t>());
    ASSERT_EQ(uv.size(), 8u);
    EXPECT_EQ(uv[0], (std::array<float, 2>{0, 1}));
    EXPECT_EQ(uv[2], (std::array<float, 2>{4, -11}));
  }
}

// The bytes after the colours of each pixel, from the file itself: its one block is stored plainly.
TEST(Png, HoldsAlpha) {
  Image image(3, 2);
  const std::vector<float> alpha{0, 0.5f, 1, 1, 0.25f, 0};
  for (std::size_t i = 0; i < 6; ++i) image.pixels[i] = {1, 0, 0.5f};
  const std::string png = encode_png(image, alpha, false);
  const std::size_t data = png.find("IDAT") + 4 + 2 + 5;  // zlib's head, the block's head
  for (std::size_t i = 0; i < 6; ++i) {
    const std::size_t at = data + i / 3 * 13 + 1 + i % 3 * 4;  // rows begin with their filter
    const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(png[at + k]); };
    EXPECT_EQ(byte(0), 255);
    EXPECT_EQ(byte(1), 0);
    EXPECT_EQ(byte(2), 128);
    EXPECT_EQ(byte(3), std::lround(255 * alpha[i]));
  }
}

TEST(MeshWriter, GlbHoldsTheCamera) {
  const TemporaryFolder folder;
  Scene scene = make_spheres(1);
  const Vec3 eye{1, 2, 3}, target{-0.5, 0.25, 0.75};
  scene.camera = look_at(eye, target, 0.8, 640, 480);
  save_scene(folder / "scene.glb", scene);
  const Glb glb(read_file(folder / "scene.glb"));
  const auto lens = glb.json["cameras"][0]["perspective"];
  EXPECT_DOUBLE_EQ(lens["yfov"].get<double>(), 0.8);
  EXPECT_DOUBLE_EQ(lens["aspectRatio"].get<double>(), 640.0 / 480.0);
  const auto node = glb.json["nodes"][1];
  EXPECT_EQ(node["camera"], 0);
  // The matrix (column-major) takes the camera's origin to the eye and its -Z towards the target.
  const auto m = node["matrix"].get<std::vector<double>>();
  EXPECT_EQ((Vec3{m[12], m[13], m[14]}), eye);
  EXPECT_LT(length(Vec3{-m[8], -m[9], -m[10]} - normalize(target - eye)), 1e-12);
  EXPECT_GT(m[5], 0);           // upright
  EXPECT_NEAR(m[1], 0, 1e-12);  // level: its +X is horizontal
}

TEST(MeshWriter, ObjHoldsTheWholeScene) {
  const TemporaryFolder folder;
  const Scene scene = make_scene("pillars");
  save_scene(folder / "scene.obj", scene);

  std::map<std::string, std::uint32_t> material;
  std::istringstream mtl(read_file(folder / "scene.mtl"));
  std::vector<Rgb> albedo;
  for (std::string word; mtl >> word;) {
    if (word == "newmtl") {
      mtl >> word;
      const auto number = static_cast<std::uint32_t>(material.size());
      material[word] = number;
    } else if (word == "Kd") {
      Rgb kd;
      mtl >> kd.r >> kd.g >> kd.b;
      albedo.push_back(kd);
    }
  }
  ASSERT_EQ(albedo.size(), scene.material.size());
  for (std::size_t i = 0; i < albedo.size(); ++i) EXPECT_EQ(albedo[i], scene.material[i].albedo);

  std::vector<Point> v, vn;
  std::vector<FileTriangle> found;
  std::uint32_t current = 0;
  std::istringstream obj(read_file(folder / "scene.obj"));
  for (std::string line; std::getline(obj, line);) {
    std::istringstream in(line);
    std::string word;
    in >> word;
    if (word == "v" || word == "vn") {
      Point p;
      in >> p[0] >> p[1] >> p[2];
      (word == "v" ? v : vn).push_back(p);
    } else if (word == "usemtl") {
      in >> word;
      current = material.at(word);
    } else if (word == "f") {
      FileTriangle t;
      t.material = current;
      for (std::size_t k = 0; k < 3; ++k) {
        in >> word;
        const auto slash = word.find("//");
        t.position[k] = v.at(std::stoul(word.substr(0, slash)) - 1);
        t.normal[k] = vn.at(std::stoul(word.substr(slash + 2)) - 1);
      }
      found.push_back(t);
    }
  }
  std::sort(found.begin(), found.end());
  EXPECT_EQ(found, triangles_of(scene));
}

TEST(MeshWriter, RefusesWhatItCannotWriteAndLeavesWhatWasThere) {
  const TemporaryFolder folder;
  const auto write = [&](const std::string& name, const Scene& scene) {
    try {
      save_scene(folder / name, scene);
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
      return error.kind();
    }
    ADD_FAILURE() << name << " was written";
    return ErrorKind::cancelled;
  };
  EXPECT_EQ(write("scene.fbx", make_spheres(1)), ErrorKind::invalid_argument);
  std::ofstream(folder / "kept.glb") << "before";
  EXPECT_EQ(write("kept.glb", Scene{}), ErrorKind::invalid_argument);
  EXPECT_EQ(read_file(folder / "kept.glb"), "before");
  EXPECT_EQ(write("no/such/folder.glb", make_spheres(1)), ErrorKind::io);
}

}  // namespace
}  // namespace haarlight::data_gen
