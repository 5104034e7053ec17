// Scenes that are broken or absurd, all the way to a transport: refused with a reason, or traced
// with what was mended counted; never a value that is not finite.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "core/error.h"
#include "precompute/default_stage.h"
#include "precompute/plan_scene.h"
#include "precompute/precompute_mesh.h"
#include "precompute/scene_clean.h"
#include "precompute/scene_import.h"
#include "prt/transport.h"
#include "tests/core/temporary_folder.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

// A floor under a smaller board.
Scene table() {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
  shapes::add_quad(scene, {-0.5, 0.6, -0.5}, {0, 0, 1}, {1, 0, 0});
  return scene;
}

MeshOptions small_options() {
  MeshOptions options;
  options.trace.face_size = options.trace.indirect_face = 4;
  options.trace.spp = 1;
  options.trace.pixel_samples = 1;
  options.trace.paths = 256;
  options.subdivide = false;
  options.error = 0;
  return options;
}

class BadScenes : public testing::Test {
 protected:
  // How strongly each wavelet is seen; every number is finite.
  std::vector<float> norms(const std::string& name) const {
    const Transport transport = Transport::open(folder_.path() / name);
    const auto found = transport.column_norms();
    for (const float v : found) EXPECT_TRUE(std::isfinite(v));
    return {found.begin(), found.end()};
  }
  std::vector<float> image(const Scene& scene) const {
    report_ = precompute_image(scene, framing_camera(scene, 8, 8), small_options(),
                               folder_.path() / "image.hlt");
    return norms("image.hlt");
  }
  std::vector<float> mesh(const Scene& scene) const {
    report_ = precompute_mesh(scene, framing_camera(scene, 8, 8), small_options(),
                              folder_.path() / "mesh.hlt")
                  .run;
    return norms("mesh.hlt");
  }
  Scene import(const std::string& name, const std::string& text) const {
    write_bytes(folder_.path() / name, text);
    return import_scene(folder_.path() / name);
  }
  // What the importer says against it.
  std::string refusal(const std::string& name, const std::string& text) const {
    try {
      import(name, text);
    } catch (const Error& error) {
      return error.what();
    }
    return {};
  }

  TemporaryFolder folder_;
  mutable PrecomputeReport report_;
};

float sum(const std::vector<float>& values) {
  float all = 0;
  for (const float v : values) all += v;
  return all;
}

// What is broken is dropped, with a count, and the rest is as if it had never been there.
TEST_F(BadScenes, BrokenTrianglesLeaveTheRestAsItWas) {
  Scene good = table();
  clean_scene(good);
  Scene bad = table();
  const std::uint32_t nan = shapes::add_vertex(bad, {kNaN, 0, 0}, {0, 1, 0});
  const std::uint32_t infinite = shapes::add_vertex(bad, {0, kInfinite, 0}, {0, 1, 0});
  const std::uint32_t far = shapes::add_vertex(bad, {0, 0, -1e38}, {0, 1, 0});
  for (const std::uint32_t v : {nan, infinite, far}) bad.triangle.push_back({{0, 1, v}, 0});
  bad.triangle.push_back({{0, 1, 1}, 0});
  bad.triangle.push_back(bad.triangle[0]);
  clean_scene(bad);
  EXPECT_EQ(bad.report.dropped_not_finite, 3);
  EXPECT_EQ(bad.report.dropped_degenerate, 1);
  EXPECT_EQ(bad.report.dropped_duplicate, 1);
  EXPECT_GT(sum(image(good)), 0);
  EXPECT_EQ(image(good), image(bad));
  EXPECT_EQ(mesh(good), mesh(bad));
}

TEST_F(BadScenes, AnyScaleAPowerOfTwoAwayGivesTheSameTransport) {
  Scene good = table();
  clean_scene(good);
  const std::vector<float> picture = image(good), vertices = mesh(good);
  for (const int exponent : {-100, -20, 20, 100}) {
    SCOPED_TRACE(exponent);
    Scene scaled = shapes::moved(table(), std::ldexp(1.0, exponent), {});
    clean_scene(scaled);
    EXPECT_EQ(scaled.triangle.size(), 4u);
    EXPECT_EQ(image(scaled), picture);
    EXPECT_EQ(mesh(scaled), vertices);
  }
}

TEST_F(BadScenes, OneHugeAndOneTinyPart) {
  for (const double tiny : {1e-3, 1e-15, 1e-30}) {
    SCOPED_TRACE(tiny);
    Scene scene = shapes::moved(table(), 1e6, {});
    shapes::add_quad(scene, {0, 0, 0}, {0, 0, tiny}, {tiny, 0, 0});
    clean_scene(scene);
    EXPECT_EQ(scene.report.tiny, 2);
    EXPECT_GT(sum(image(scene)), 0);
    EXPECT_GT(sum(mesh(scene)), 0);
  }
  Scene even = table();
  clean_scene(even);
  EXPECT_EQ(even.report.tiny, 0);
}

// The picture does not care; vertices are lit on the side of their normals, and it is said.
TEST_F(BadScenes, NormalsAgainstTheWinding) {
  Scene good = table();
  clean_scene(good);
  EXPECT_EQ(good.report.against_normals, 0);
  Scene flipped = table();
  for (Vec3& n : flipped.normal) n = -n;
  clean_scene(flipped);
  EXPECT_EQ(flipped.report.against_normals, 4);
  EXPECT_EQ(image(good), image(flipped));
  for (Vec3& n : flipped.normal) n = {0, 0, 0};
  clean_scene(flipped);
  EXPECT_EQ(flipped.report.normals_made, 8);
  EXPECT_EQ(image(good), image(flipped));
}

TEST_F(BadScenes, BlackMaterialsAreSaid) {
  Scene scene = table();
  clean_scene(scene);
  PlanOptions planning;
  planning.trace = small_options().trace;
  const auto plans = [&] {
    std::vector<std::string> notes = plan_image(scene, framing_camera(scene, 8, 8), planning).notes;
    EXPECT_EQ(plan_mesh(scene, planning).notes, notes);
    return notes;
  };
  image(scene);
  EXPECT_TRUE(report_.notes.empty());
  EXPECT_TRUE(plans().empty());

  const std::vector<std::string> black{"all materials are black"};
  scene.material[0].albedo = {0, 0, 0};
  EXPECT_EQ(sum(image(scene)), 0);
  EXPECT_EQ(report_.notes, black);
  EXPECT_EQ(sum(mesh(scene)), 0);
  EXPECT_EQ(report_.notes, black);
  EXPECT_EQ(plans(), black);

  scene.material[0].albedo = {1, 1, 1};
  scene.tint.assign(scene.position.size(), Rgb{});
  EXPECT_EQ(sum(image(scene)), 0);
  EXPECT_EQ(report_.notes, black);
}

TEST_F(BadScenes, AnEmptyPictureIsSaid) {
  Scene scene = table();
  clean_scene(scene);
  PlanOptions planning;
  planning.trace = small_options().trace;
  const std::vector<std::string> empty{"nothing of the scene is in the picture"};
  const auto notes = [&](const Camera& camera) {
    const auto file = folder_.path() / "away.hlt";
    const PrecomputeReport report = precompute_image(scene, camera, small_options(), file);
    EXPECT_EQ(plan_image(scene, camera, planning).notes, report.notes);
    return report.notes;
  };
  Camera camera = look_at({0, 2, 5}, {0, 0, 0}, 0.7, 8, 8);
  EXPECT_TRUE(notes(camera).empty());
  EXPECT_EQ(notes(look_at({0, 2, 5}, {0, 4, 10}, 0.7, 8, 8)), empty);
  // So far off that the scene is between the pixels, or beyond all that rays can reach.
  for (const double distance : {1e3, 1e10, 1e20, 1e200}) {
    SCOPED_TRACE(distance);
    camera.position = {0.3 * distance, 0.4 * distance, distance};
    EXPECT_EQ(notes(camera), empty);
  }
  // A long lens still finds it.
  EXPECT_TRUE(notes(look_at({0, 2e5, 5e5}, {0, 0, 0}, 2e-6, 8, 8)).empty());
}

std::string ply(const std::string& format, const std::string& length, const std::string& data,
                const std::string& faces = "1") {
  return "ply\nformat " + format +
         " 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
         "element face " +
         faces + "\nproperty list " + length + " int vertex_indices\nend_header\n" + data;
}

// Lists longer than the file would make the reader ask for all memory there is.
TEST_F(BadScenes, PlyListsLongerThanTheFile) {
  const std::string corners = "0 0 0\n1 0 0\n0 0 1\n";
  EXPECT_EQ(import("a.ply", ply("ascii", "uchar", corners + "3 0 2 1\n")).triangle.size(), 1u);
  for (const char* list : {"2000000000 0 2 1", "-1 0 2 1", "nan 0 2 1"}) {
    const std::string said = refusal("b.ply", ply("ascii", "int", corners + list + "\n"));
    EXPECT_NE(said.find("b.ply: face 0 has a list of"), std::string::npos) << said;
  }
  const std::string many =
      refusal("c.ply", ply("ascii", "int", corners + "3 0 2 1\n", "4000000000"));
  EXPECT_NE(many.find("c.ply: 1 faces after the header, expected 4000000000"), std::string::npos)
      << many;

  const auto number = [](std::int32_t n, bool big) {
    std::string bytes;
    for (int i = 0; i < 4; ++i) {
      bytes += static_cast<char>(static_cast<std::uint32_t>(n) >> (big ? 24 - 8 * i : 8 * i));
    }
    return bytes;
  };
  for (const bool big : {false, true}) {
    const std::string format = big ? "binary_big_endian" : "binary_little_endian";
    const std::string one = number(0x3f800000, big), zero = number(0, big);
    const std::string places = zero + zero + zero + one + zero + zero + zero + zero + one;
    const std::string face = number(0, big) + number(2, big) + number(1, big);
    EXPECT_EQ(import("d.ply", ply(format, "int", places + number(3, big) + face)).triangle.size(),
              1u);
    for (const std::int32_t length : {2000000000, -1}) {
      const std::string said =
          refusal("e.ply", ply(format, "int", places + number(length, big) + face));
      EXPECT_NE(said.find("e.ply: face 0 has a list of"), std::string::npos) << said;
    }
  }
}

// assimp has fifty readers, some of which find their own in the text below: glTF without a version
// is nobody's, and no scene of another format is made of it.
TEST_F(BadScenes, OnlyReadersOfTheSuffixAreAsked) {
  for (const char* name : {"a.gltf", "a.glb"}) {
    const std::string said =
        refusal(name, R"({"extras": ["mtllib usemtl v vt vn f", "<x3d>", "<collada", "solid "]})");
    EXPECT_NE(said.find("No suitable reader"), std::string::npos) << said;
  }
}

// A glTF file of nodes, and of a mesh of two triangles in data.bin.
std::string gltf(const std::string& nodes) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)" + nodes +
         R"(],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"accessors":[)"
         R"({"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},)"
         R"({"bufferView":1,"componentType":5121,"count":6,"type":"SCALAR"}],"bufferViews":[)"
         R"({"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],"buffers":[)"
         R"({"byteLength":42,"uri":"data.bin"}]})";
}

TEST_F(BadScenes, NodesThatAreNoTree) {
  const float one = 1;
  std::string data(42, '\0');
  std::memcpy(data.data() + 12, &one, 4);
  std::memcpy(data.data() + 32, &one, 4);
  data.replace(36, 6, std::string{0, 2, 1, 0, 1, 2});
  write_bytes(folder_.path() / "data.bin", data);
  const std::string mesh = R"({"mesh":0})";
  EXPECT_EQ(import("a.gltf", gltf(mesh)).report.dropped_out_of_range, 0);

  for (const std::string& circle : {std::string(R"({"mesh":0,"children":[0]})"),
                                    std::string(R"({"mesh":0,"children":[1]},{"children":[0]})")}) {
    const std::string said = refusal("b.gltf", gltf(circle));
    EXPECT_NE(said.find("b.gltf: node 0 is 513 levels down"), std::string::npos) << said;
  }
  std::string chain, doubling;
  for (int i = 1; i <= 20000; ++i) chain += fmt::format("{{\"children\":[{}]}},", i);
  for (int i = 1; i <= 30; ++i) doubling += fmt::format("{{\"children\":[{},{}]}},", i, i);
  EXPECT_NE(refusal("c.gltf", gltf(chain + mesh)).find("node 512 is 513 levels down"),
            std::string::npos);
  EXPECT_NE(refusal("d.gltf", gltf(doubling + mesh)).find("expected a tree"), std::string::npos);
  EXPECT_NE(refusal("e.gltf", gltf(R"({"mesh":0,"children":[7]})")).find("node 7"),
            std::string::npos);

  data[41] = 99;  // the second triangle's last corner
  write_bytes(folder_.path() / "data.bin", data);
  const Scene one_left = import("f.gltf", gltf(mesh));
  EXPECT_EQ(one_left.triangle.size(), 1u);
  EXPECT_EQ(one_left.report.dropped_out_of_range, 1);
}

}  // namespace
}  // namespace haarlight
