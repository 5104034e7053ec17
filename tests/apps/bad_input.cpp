// Bad files and places: one line that names them, exit code 1, nothing half-written, nothing lost.

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "core/image_io.h"
#include "tests/apps/inputs.h"
#include "tests/apps/program_runner.h"

namespace haarlight {
namespace {

namespace fs = std::filesystem;
using fixtures::ProgramResult;
using fixtures::read_bytes;
using fixtures::run_program;
using fixtures::write_bytes;

/// A folder with a good scene, a good environment and a good transport.
class BadInput : public testing::Test {
 protected:
  void SetUp() override {
    fixtures::write_table_scene(path("table.obj"));
    save_image(path("room.exr"), fixtures::room_environment());
    const ProgramResult made =
        run({"precompute", "table.obj", "-o", "table.hlt", "--size", "24x16", "--face", "8"});
    ASSERT_EQ(made.code, 0) << made.err;
  }

  fs::path path(const std::string& name) const { return folder_.path() / name; }

  ProgramResult run(const std::vector<std::string>& arguments) const {
    return run_program(arguments, folder_.path());
  }

  /// The names in the folder, but for the files that hold what the program said.
  std::vector<std::string> names() const {
    std::vector<std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(folder_.path())) {
      const std::string name = fs::relative(entry.path(), folder_.path()).string();
      if (name != ".stdout" && name != ".stderr") found.push_back(name);
    }
    std::sort(found.begin(), found.end());
    return found;
  }

  /// Exit code 1 and one line, the last, that holds each of `said`; no new file, none gone.
  void expect_stated_error(const std::vector<std::string>& arguments,
                           const std::vector<std::string>& said) const {
    std::string shown;
    for (const std::string& word : arguments) shown += word + " ";
    SCOPED_TRACE(shown);
    const std::vector<std::string> before = names();
    const ProgramResult result = run(arguments);
    EXPECT_EQ(result.code, 1);
    const std::size_t begin = result.err.find("haarlight: ");
    ASSERT_NE(begin, std::string::npos) << result.err;
    EXPECT_TRUE(begin == 0 || result.err[begin - 1] == '\n') << result.err;
    const std::string line = result.err.substr(begin);
    EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1) << result.err;
    EXPECT_EQ(line.back(), '\n') << result.err;
    for (const std::string& part : said) {
      EXPECT_NE(line.find(part), std::string::npos) << "'" << part << "' in " << line;
    }
    EXPECT_EQ(names(), before);
  }

  std::vector<std::string> relight(const std::string& transport, const std::string& env) const {
    return {"relight", transport, "--env", env, "--frames", "2", "-o", "out", "--metrics", "m.csv"};
  }

 private:
  fixtures::TemporaryFolder folder_;
};

TEST_F(BadInput, CompressWantsATransportOfVertices) {
  expect_stated_error({"compress", "table.hlt", "-o", "c.hlt"},
                      {"table.hlt", "one view", "--vertices"});
  expect_stated_error({"compress", "room.exr", "-o", "c.hlt"}, {"room.exr", "not a Haarlight"});
  expect_stated_error({"compress", "none.hlt", "-o", "c.hlt"}, {"none.hlt"});
  ProgramResult result = run({"precompute", "table.obj", "-o", "mesh.hlt", "--vertices", "--face",
                              "8", "--max-vertices", "300"});
  ASSERT_EQ(result.code, 0) << result.err;
  for (const auto& [option, value] :
       std::vector<std::pair<std::string, std::string>>{{"--clusters", "0"},
                                                        {"--clusters", "100000"},
                                                        {"--clusters", "many"},
                                                        {"--clusters", "2.5"},
                                                        {"--basis", "0"},
                                                        {"--basis", "3.7"},
                                                        {"--basis", "257"},
                                                        {"--error", "0"},
                                                        {"--weight-bits", "12"}}) {
    result = run({"compress", "mesh.hlt", "-o", "c.hlt", option, value});
    EXPECT_EQ(result.code, 2) << option << " " << value;
    EXPECT_NE(result.err.find(option), std::string::npos) << result.err;
  }
  result = run({"compress", "mesh.hlt", "-o", "c.hlt", "--clusters", "4", "--basis", "5"});
  ASSERT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("4 clusters"), std::string::npos) << result.out;
  expect_stated_error({"compress", "c.hlt", "-o", "d.hlt"}, {"c.hlt", "compressed already"});
  result = run({"info", "c.hlt"});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("clusters"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("compressed from"), std::string::npos) << result.out;
  result =
      run({"relight", "c.hlt", "--env", "room.exr", "--frames", "4", "--stop", "2", "--size",
           "32x24", "--basis-terms", "1", "--against-reference", "--orbit", "30", "-o", "out"});
  EXPECT_EQ(result.code, 0) << result.err;
  for (const char* terms : {"0", "1.5"}) {
    result = run({"relight", "c.hlt", "--env", "room.exr", "--basis-terms", terms, "-o", "out"});
    EXPECT_EQ(result.code, 2) << result.err;
  }
  for (const char* plain : {"mesh.hlt", "table.hlt"}) {
    expect_stated_error(
        {"relight", plain, "--env", "room.exr", "--basis-terms", "quarter", "-o", "out"},
        {plain, "not compressed", "--basis-terms"});
  }
}

TEST_F(BadInput, GoodInputIsTaken) {
  // Else every other test here would pass for a program that refuses everything.
  const ProgramResult result = run(relight("table.hlt", "room.exr"));
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_TRUE(fs::exists(path("out/frame_0001.exr")));
  EXPECT_TRUE(fs::exists(path("m.csv")));
}

TEST_F(BadInput, Environments) {
  expect_stated_error(relight("table.hlt", "none.exr"), {"none.exr"});
  expect_stated_error(relight("table.hlt", "."), {"."});

  const std::string good = read_bytes(path("room.exr"));
  write_bytes(path("cut.exr"), good.substr(0, good.size() / 2));
  expect_stated_error(relight("table.hlt", "cut.exr"), {"cut.exr"});

  write_bytes(path("text.exr"), "this is no picture\n");
  expect_stated_error(relight("table.hlt", "text.exr"), {"text.exr"});
  write_bytes(path("empty.hdr"), "");
  expect_stated_error(relight("table.hlt", "empty.hdr"), {"empty.hdr"});

  Image not_finite = fixtures::room_environment();
  for (Rgb& pixel : not_finite.pixels) pixel.r = std::numeric_limits<float>::quiet_NaN();
  save_image(path("nan.exr"), not_finite);
  expect_stated_error(relight("table.hlt", "nan.exr"), {"nan.exr", "not finite"});

  Image odd(50, 31);
  save_image(path("odd.exr"), odd);
  expect_stated_error(relight("table.hlt", "odd.exr"), {"odd.exr", "50", "31"});

  std::vector<std::string> blend = relight("table.hlt", "room.exr");
  blend.insert(blend.end(), {"--motion", "blend", "--env-to", "text.exr"});
  expect_stated_error(blend, {"text.exr"});
}

TEST_F(BadInput, Scenes) {
  const auto precompute = [](const std::string& scene) {
    return std::vector<std::string>{"precompute", scene,   "-o",     "new.hlt",
                                    "--size",     "24x16", "--face", "8"};
  };
  expect_stated_error(precompute("none.obj"), {"none.obj"});
  write_bytes(path("points.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  expect_stated_error(precompute("points.obj"), {"points.obj", "triangle"});
  write_bytes(path("line.obj"), "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  expect_stated_error(precompute("line.obj"), {"line.obj", "triangle"});
  write_bytes(path("noise.glb"), std::string(100, '\x07'));
  expect_stated_error(precompute("noise.glb"), {"noise.glb"});
  expect_stated_error({"precompute", "table.obj", "--view", "scene", "-o", "new.hlt"},
                      {"table.obj", "camera"});
}

// A floor in glTF with its material, nodes and whatever else a test wants to break.
std::string floor_gltf(const std::string& material, const std::string& more = "",
                       const std::string& nodes = R"({"mesh":0})", const std::string& roots = "0") {
  // Four corners at y = 0, then two triangles of bytes.
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[)" + roots +
         R"(]}],"nodes":[)" + nodes +
         R"(],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],)"
         R"("materials":[)" +
         material +
         R"(],"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
         R"({"bufferView":1,"componentType":5121,"count":6,"type":"SCALAR"}],"bufferViews":[)"
         R"({"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":6}],"buffers":[)"
         R"({"byteLength":54,"uri":"floor.bin"}])" +
         more + "}";
}

std::string floor_bytes() {
  const float places[12] = {-1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1};
  return std::string(reinterpret_cast<const char*>(places), sizeof places) +
         std::string{0, 1, 2, 0, 2, 3};
}

// Every verb that reads scenes, for pictures and for meshes.
std::vector<std::vector<std::string>> scene_verbs(const std::string& scene) {
  const std::vector<std::string> small{scene,   "--size", "8x8",     "--face", "4",
                                       "--spp", "1",      "--paths", "256"};
  std::vector<std::vector<std::string>> verbs{{"plan"},
                                              {"plan", "--vertices"},
                                              {"precompute", "-o", "new.hlt"},
                                              {"precompute", "-o", "new.hlt", "--vertices"}};
  for (auto& verb : verbs) {
    if (verb.back() == "--vertices") verb.insert(verb.end(), {"--subdivide", "off"});
    verb.insert(verb.end(), small.begin(), small.end());
  }
  return verbs;
}

TEST_F(BadInput, ScenesThatAreRefusedByEveryVerb) {
  write_bytes(path("floor.bin"), floor_bytes());
  const std::string corners = "v 0 0 0\nv 1 0 0\nv 0 0 1\n";
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
      "float z\nelement face 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n"
      "0 0 1\n";
  struct Case {
    std::string name, text, said;
  };
  const std::vector<Case> cases{
      {"one.obj", "v 0 0 0\n", "one.obj"},
      {"none.obj", corners, "no triangles"},
      {"range.obj", corners + "f 1 2 99\n", "out of range"},
      {"nan.obj", "v nan 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n", "none of 1 triangles"},
      {"range.ply", ply + "3 0 1 9\n", "face 0 names vertex 9"},
      {"list.ply", ply + "2000000000 0 1 2\n", "face 0 has a list of 2000000000"},
      {"circle.gltf", floor_gltf("{}", "", R"({"mesh":0,"children":[0]})"), "node 0"},
      {"material.gltf", floor_gltf(R"({"pbrMetallicRoughness":[1]})"), "material.gltf"},
      {"nan.gltf", floor_gltf(R"({"alphaCutoff":NaN})"), "nan.gltf"}};
  for (const Case& c : cases) {
    write_bytes(path(c.name), c.text);
    for (const auto& verb : scene_verbs(c.name)) expect_stated_error(verb, {c.name, c.said});
  }
}

// What can be repaired is, with a line that says so, and the run goes on.
TEST_F(BadInput, ScenesThatAreTakenWithAWord) {
  write_bytes(path("floor.bin"), floor_bytes());
  write_bytes(path("fake.png"), "not a picture");
  const std::string images = R"(,"textures":[{"source":0}],"images":[{"uri":"fake.png"}])";
  const std::string missing = R"(,"textures":[{"source":0}],"images":[{"uri":"none.png"}])";
  const std::string camera =
      R"(,"cameras":[{"type":"perspective","perspective":{"yfov":0.8,"znear":0.1}}])";
  const auto seen_from = [&](const std::string& place) {
    return floor_gltf("{}", camera, R"({"mesh":0},{"camera":0,"translation":)" + place + "}",
                      "0,1");
  };
  const std::string table = read_bytes(path("table.obj"));
  struct Case {
    std::string name, text, said;
    bool of_vertices = true;  // whether it matters to them
  };
  const std::string textured = R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})";
  const std::vector<Case> cases{
      {"nan.obj", table + "v nan 0 0\nf 1 2 9\n", "1 triangles with a corner that is not finite"},
      {"twice.obj", table + "f 1 4 3\nf 1 1 2\n", "1 repeated triangles"},
      {"normals.obj", table + "vn 0 0 0\nf 5//1 8//1 1//1\n", "vertex normals made"},
      {"flipped.obj", "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nvn 0 -1 0\nf 1//1 3//1 2//1\n",
       "1 triangles wound against their normals"},
      {"fake.gltf", floor_gltf(textured, images), "1 textures not found"},
      {"missing.gltf", floor_gltf(R"({"normalTexture":{"index":0}})", missing),
       "1 textures not found"},
      {"black.gltf", floor_gltf(R"({"pbrMetallicRoughness":{"baseColorFactor":[0,0,0,1]}})"),
       "all materials are black"},
      {"away.gltf", seen_from("[0,0.5,-5]"), "nothing of the scene is in the picture", false},
      {"far.gltf", seen_from("[0,0.5,1e20]"), "nothing of the scene is in the picture", false},
      {"lens.gltf",
       floor_gltf(R"({"extensions":{"KHR_materials_transmission":{"transmissionFactor":1}}})"),
       "1 materials of rough glass"}};
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const Case& c = cases[i];
    SCOPED_TRACE(c.name);
    write_bytes(path(c.name), c.text);
    // One of plan and precompute looks at the picture, the other at the vertices; by turns.
    const auto verbs = scene_verbs(c.name);
    for (const auto& verb : {verbs[i % 2], verbs[3 - i % 2]}) {
      const bool of_vertices = std::find(verb.begin(), verb.end(), "--vertices") != verb.end();
      const ProgramResult result = run(verb);
      EXPECT_EQ(result.code, 0) << result.err;
      if (of_vertices && !c.of_vertices) continue;
      const std::size_t place = result.err.find(c.said);
      ASSERT_NE(place, std::string::npos) << result.err;
      EXPECT_EQ(result.err.find(c.said, place + 1), std::string::npos) << "said twice";
    }
  }
}

// Nothing to repair and nothing to say.
TEST_F(BadInput, OddMaterialsAreNoFault) {
  write_bytes(path("floor.bin"), floor_bytes());
  for (const char* material :
       {R"({"pbrMetallicRoughness":{"baseColorFactor":[null,2,-4,1],"roughnessFactor":null}})",
        R"({"alphaMode":"MASK"})", R"({"emissiveFactor":[1,1,1]})"}) {
    SCOPED_TRACE(material);
    write_bytes(path("odd.gltf"), floor_gltf(material));
    for (const auto& verb : scene_verbs("odd.gltf")) {
      const ProgramResult result = run(verb);
      EXPECT_EQ(result.code, 0) << result.err;
      EXPECT_EQ(result.err.find("odd.gltf: all"), std::string::npos) << result.err;
      EXPECT_EQ(result.err.find("nothing of"), std::string::npos) << result.err;
    }
  }
}

TEST_F(BadInput, Transports) {
  expect_stated_error(relight("none.hlt", "room.exr"), {"none.hlt"});
  expect_stated_error(relight("room.exr", "room.exr"), {"room.exr"});
  write_bytes(path("empty.hlt"), "");
  expect_stated_error({"info", "empty.hlt"}, {"empty.hlt"});

  // A cut or a flipped bit: a few places spread over the file.
  const std::string good = read_bytes(path("table.hlt"));
  for (int part = 0; part < 4; ++part) {
    const std::size_t place = good.size() * static_cast<std::size_t>(part) / 4 + 5;
    write_bytes(path("cut.hlt"), good.substr(0, place));
    expect_stated_error({"info", "cut.hlt"}, {"cut.hlt"});
    std::string flipped = good;
    flipped[place] = static_cast<char>(flipped[place] ^ 0x10);
    write_bytes(path("bad.hlt"), flipped);
    expect_stated_error({"info", "bad.hlt"}, {"bad.hlt"});
  }
  expect_stated_error(relight("bad.hlt", "room.exr"), {"bad.hlt"});
  write_bytes(path("long.hlt"), good + "more");
  expect_stated_error({"info", "long.hlt"}, {"long.hlt"});
}

TEST_F(BadInput, OutputsThatCannotBeMade) {
  // A file where a folder must be stops everybody, root too.
  write_bytes(path("file"), "here before");
  expect_stated_error({"relight", "table.hlt", "--env", "room.exr", "-o", "file"}, {"file"});
  expect_stated_error({"relight", "table.hlt", "--env", "room.exr", "-o", "file/below"}, {"file"});
  expect_stated_error({"relight", "table.hlt", "--env", "room.exr", "--metrics", "file/m.csv"},
                      {"file/m.csv"});
  expect_stated_error({"precompute", "table.obj", "-o", "file/a.hlt"}, {"file/a.hlt"});
  expect_stated_error({"precompute", "table.obj", "-o", "nowhere/a.hlt"}, {"nowhere/a.hlt"});
  // The place is tried before the scene is even read, let alone traced.
  expect_stated_error({"precompute", "none.obj", "-o", "file/a.hlt"}, {"file/a.hlt"});
  EXPECT_EQ(read_bytes(path("file")), "here before");
}

TEST_F(BadInput, OldOutputsAreKeptWhenARunFails) {
  write_bytes(path("m.csv"), "old metrics");
  fs::create_directory(path("out"));
  write_bytes(path("out/frame_0000.exr"), "old picture");
  write_bytes(path("broken.obj"), "v 0 0 0\n");
  const std::string transport = read_bytes(path("table.hlt"));

  expect_stated_error(relight("table.hlt", "none.exr"), {"none.exr"});
  expect_stated_error({"precompute", "broken.obj", "-o", "table.hlt"}, {"broken.obj"});

  // Frame 1 cannot be written: its name is a folder. Frame 0 was done, and is there whole.
  fs::create_directory(path("out/frame_0001.exr"));
  std::vector<std::string> pictures = relight("table.hlt", "room.exr");
  pictures.insert(pictures.end(), {"--formats", "exr"});
  expect_stated_error(pictures, {"out/frame_0001.exr"});
  EXPECT_EQ(load_image(path("out/frame_0000.exr")).width, 24);

  EXPECT_EQ(read_bytes(path("m.csv")), "old metrics");
  EXPECT_EQ(read_bytes(path("table.hlt")), transport);
}

TEST_F(BadInput, RepairsAreSaidOnceAndTheWorkGoesOn) {
  Image ringing = fixtures::room_environment();
  ringing.at(3, 4) = {-0.5f, 0.2f, 0.1f};
  ringing.at(9, 9) = {0.1f, -2.0f, 0.1f};
  save_image(path("ringing.exr"), ringing);
  const ProgramResult result = run(relight("table.hlt", "ringing.exr"));
  EXPECT_EQ(result.code, 0) << result.err;
  const std::string line = "ringing.exr: 2 pixels with negative radiance (down to -2) set to 0\n";
  const std::size_t place = result.err.find(line);
  ASSERT_NE(place, std::string::npos) << result.err;
  EXPECT_EQ(result.err.find("negative", place + line.size()), std::string::npos);
}

// A table of another size, of no such material, and options that mean nothing together.
TEST_F(BadInput, MeasuredBrdfs) {
  write_bytes(path("shiny.obj"),
              "mtllib shiny.mtl\nv 0 0 0\nv 0 0 1\nv 1 0 0\nusemtl red\nf 1 2 3\n");
  write_bytes(path("shiny.mtl"), "newmtl red\nKd 0.2 0.1 0.1\nKs 0.5 0.5 0.5\nNs 10\n");
  write_bytes(path("cut.binary"), std::string("\x04\0\0\0\x03\0\0\0\x02\0\0\0", 12) + "short");
  write_bytes(path("empty.binary"), "");
  const auto with = [](const std::string& pair) {
    return std::vector<std::string>{"precompute", "shiny.obj", "-o",     "shiny.hlt", "--vertices",
                                    "--face",     "8",         "--merl", pair};
  };
  expect_stated_error(with("red=cut.binary"), {"cut.binary", "4 x 3 x 2", "588"});
  expect_stated_error(with("red=empty.binary"), {"empty.binary", "0 bytes"});
  expect_stated_error(with("red=none.binary"), {"none.binary"});
  expect_stated_error(with("red=shiny.obj"), {"shiny.obj", "MERL"});
  expect_stated_error(with("blue=cut.binary"), {"blue", "\"red\""});
  expect_stated_error(with("red"), {"--merl", "MATERIAL=FILE"});
  for (const char* terms : {"0", "65", "-1", "many", "4.5"}) {
    const ProgramResult result = run({"precompute", "shiny.obj", "-o", "shiny.hlt", "--vertices",
                                      "--face", "8", "--terms", terms});
    EXPECT_EQ(result.code, 2) << terms;
    EXPECT_NE(result.err.find("--terms"), std::string::npos) << result.err;
  }
  EXPECT_EQ(run({"precompute", "shiny.obj", "-o", "shiny.hlt", "--terms", "4"}).code, 2);
  EXPECT_FALSE(fs::exists(path("shiny.hlt")));
}

TEST_F(BadInput, Comparisons) {
  save_image(path("small.exr"), Image(3, 2));
  expect_stated_error({"compare", "room.exr", "none.exr"}, {"none.exr"});
  expect_stated_error({"compare", "room.exr", "small.exr"}, {"128", "3"});
}

}  // namespace
}  // namespace haarlight
