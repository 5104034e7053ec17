// Scenes that are broken or absurd, all the way to a transport: refused with a reason, or traced
// with what was mended counted; never a value that is not finite.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "precompute/default_stage.h"
#include "precompute/plan_scene.h"
#include "precompute/precompute_mesh.h"
#include "precompute/scene_clean.h"
#include "precompute/scene_import.h"
#include "prt/transport.h"
#include "tests/caching/small_gltf.h"
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

// What the reader of PLY in use would lose, or write past its arrays for.
TEST_F(BadScenes, PlyAsItsReaderDoesNotExpectIt) {
  const std::string corners = "0 0 0\n1 0 0\n0 0 1\n", head = "ply\nformat ascii 1.0\n";
  const std::string places = "property float x\nproperty float y\nproperty float z\n";
  const std::string vertex = "element vertex 3\n" + places;
  const std::string list = "property list uchar int vertex_indices\n", end = "end_header\n";
  const std::string face = "element face 1\n" + list;

  // Read: comments between properties, elements of other kinds, faces first, blank lines, ends of
  // line of other systems, exponents and signs.
  const std::string three = corners + "3 0 2 1\n";
  for (const std::string& text :
       {head + "comment a\nelement vertex 3\nproperty float x\ncomment b\nproperty float y\n" +
            "property float z\nelement face 1\ncomment c\n" + list + end + three,
        head + vertex + "element edge 2\nproperty int a\nproperty int b\n" + face + end + corners +
            "0 1\n1 2\n3 0 2 1\n",
        head + face + vertex + end + "3 0 2 1\n" + corners,
        head + vertex + face + end + "\n0 0 0\r\n\n1e0 0 -0.0\n+0 0 1 \n\n3 0 2e0 +1",
        "ply\r\nformat ascii 1.0\r\nobj_info x\r\n" + vertex + face + end + three}) {
    EXPECT_EQ(import("a.ply", text).triangle.size(), 1u) << text;
  }
  // The first number's first byte is that of an end of line.
  const float odd = std::bit_cast<float>(0x3f80000au), one = 1, zero = 0;
  std::string bytes;
  for (const float x : {odd, zero, zero, zero, zero, one, zero, one, zero}) {
    bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
  }
  bytes += '\3' + std::string("\0\0\0\0\1\0\0\0\2\0\0\0", 12);
  const Scene lf =
      import("b.ply", "ply\nformat binary_little_endian 1.0\n" + vertex + face + end + bytes);
  ASSERT_EQ(lf.triangle.size(), 1u);
  EXPECT_EQ(lf.position[lf.triangle[0].vertex[0]].x, static_cast<double>(odd));

  const std::string twice = "element face 2\n" + list;
  const std::string coordinates = "property list uchar float texcoord\n";
  const std::pair<std::string, const char*> refused[] = {
      {head + vertex + face + twice + end + corners + "3 0 2 1\n3 0 2 1\n3 0 2 1\n",
       "element face comes twice"},
      {head + vertex + "element vertex 9\n" + places + face + end + corners + corners + corners,
       "element vertex comes twice"},
      {head + vertex + face + coordinates + end + corners + "2 0 1 6 0 0 1 0 0 1\n",
       "face 0 has 6 texture coordinates for 2 corners"},
      {head + vertex + "element face 1\n" + coordinates + end + corners + "6 0 0 1 0 0 1\n",
       "face 0 has 6 texture coordinates for 0 corners"},
      {head + vertex + "element tristrips 1\n" + list + end + three, "strips"},
      {head + "element vertex 4000000000\nend_header\n", "has no properties"},
      {head + face + end + "3 0 2 1\n", "no element vertex"},
      {head + vertex + "element face 1\nproperty list float int vertex_indices\n" + end + three,
       "lengths of a list are of type \"float\""},
      {head + vertex + "element face 1\nproperty list uchar bit vertex_indices\n" + end + three,
       "unknown type \"bit\""},
      {head + vertex + "element face -1\n" + list + end + three, "count of \"-1\""},
      {head + vertex + face + end + "0 0\n1 0 0\n0 0 1\n3 0 2 1\n", "vertex 0 has too few numbers"},
      {head + vertex + face + end + "0 0 0\n1 0 zero\n0 0 1\n3 0 2 1\n",
       "vertex 1 has \"zero\" in place of a number"},
      {head + vertex + face + end + corners + "3 0 2 3e9\n", "face 0 has 3000000000, expected"},
      {"ply\n" + vertex + face + end + three, "names no format"},
      {"ply\nformat text 1.0\n" + vertex + face + end + three, "format is \"text\""},
      {"plys\nformat ascii 1.0\n" + vertex + face + end + three, "does not begin with"}};
  for (const auto& [text, why] : refused) {
    const std::string said = refusal("c.ply", text);
    EXPECT_NE(said.find(why), std::string::npos) << said << "\n" << text;
    EXPECT_EQ(said.find("c.ply: "), folder_.path().string().size() + 1) << said;
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

// assimp divides by the number of an animation's keys, and takes joints as they come. A scene that
// stands still has no use for either.
TEST_F(BadScenes, MotionIsNotReadForAScene) {
  SmallGltf moving;
  moving.gltf["accessors"][2]["count"] = 0;
  moving.gltf["skins"] = {{{"joints", {77}}, {"inverseBindMatrices", 99}}};
  moving.gltf["nodes"][1]["skin"] = 0;
  EXPECT_EQ(import("a.glb", moving.glb()).triangle.size(), 1u);
  moving.gltf["buffers"][0]["uri"] = "a.bin";
  write_bytes(folder_.path() / "a.bin", moving.bytes);
  EXPECT_EQ(import("a.gltf", moving.gltf.dump()).triangle.size(), 1u);
}

}  // namespace
}  // namespace haarlight
