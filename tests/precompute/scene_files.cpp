// Which files a scene is made of, and what their hash sees.

#include "precompute/scene_files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/error.h"
#include "tests/core/temporary_folder.h"

namespace haarlight {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

// Paths from the scene's folder.
std::vector<std::string> names(const fs::path& scene) {
  std::vector<std::string> names;
  for (const fs::path& file : scene_files(scene)) {
    names.push_back(file.lexically_relative(scene.parent_path()).generic_string());
  }
  return names;
}

using Names = std::vector<std::string>;

TEST(SceneFiles, ObjNamesLibrariesAndTheseTheirPictures) {
  const TemporaryFolder folder;
  write(folder / "a.obj", "mtllib a.mtl\nv 0 0 0\nmtllib sub/b.mtl\nmtllib a.mtl\n");
  write(folder / "a.mtl", "newmtl x\nmap_Kd wood\\oak.png\nmap_Bump -bm 0.5 bump.png\n");
  write(folder / "sub/b.mtl", "newmtl y\n  map_Kd wood/oak.png\n");
  // Pictures that are not there belong to the scene all the same, and each comes once.
  EXPECT_EQ(names(folder / "a.obj"),
            (Names{"a.obj", "a.mtl", "sub/b.mtl", "wood/oak.png", "bump.png"}));
}

TEST(SceneFiles, GltfNamesBuffersAndPictures) {
  const TemporaryFolder folder;
  write(folder / "a.gltf",
        R"({"asset":{"version":"2.0"},
            "buffers":[{"uri":"a%20b.bin","byteLength":4},
                       {"uri":"data:application/octet-stream;base64,AAAA","byteLength":3}],
            "images":[{"uri":"sky.png"},{"bufferView":0,"mimeType":"image/png"}]})");
  EXPECT_EQ(names(folder / "a.gltf"), (Names{"a.gltf", "a b.bin", "sky.png"}));
}

TEST(SceneFiles, PlyNamesItsPicture) {
  const TemporaryFolder folder;
  write(folder / "a.ply",
        "ply\nformat ascii 1.0\ncomment TextureFile skin.png\nend_header\n"
        "comment TextureFile not.png\n");
  EXPECT_EQ(names(folder / "a.ply"), (Names{"a.ply", "skin.png"}));
}

TEST(SceneFiles, WhatIsNotThereIsSaid) {
  const TemporaryFolder folder;
  try {
    scene_files(folder / "no.obj");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::missing);
    EXPECT_NE(std::string(error.what()).find("no.obj"), std::string::npos);
  }
}

// Any byte of any file counts, and whether one is there; where they lie does not.
TEST(SceneFiles, HashSeesEveryFile) {
  const TemporaryFolder folder;
  const auto make = [&](const std::string& in) {
    write(folder / in / "a.obj", "mtllib a.mtl\nv 0 0 0\n");
    write(folder / in / "a.mtl", "newmtl x\nmap_Kd skin.png\n");
    write(folder / in / "skin.png", "a picture");
    return scene_files_hash(folder / in / "a.obj");
  };
  const std::string hash = make("one");
  EXPECT_EQ(hash.size(), 32u);
  EXPECT_EQ(make("another/place"), hash);
  for (const char* file : {"a.obj", "a.mtl", "skin.png"}) {
    EXPECT_EQ(make("one"), hash);
    std::ofstream(folder / "one" / file, std::ios::app) << ' ';
    EXPECT_NE(scene_files_hash(folder / "one/a.obj"), hash) << file;
  }
  make("one");
  fs::remove(folder / "one/skin.png");
  const std::string without = scene_files_hash(folder / "one/a.obj");
  EXPECT_NE(without, hash);
  write(folder / "one/skin.png", "");
  EXPECT_NE(scene_files_hash(folder / "one/a.obj"), without);
}

TEST(SceneFiles, StateOfTheSceneBesideATransport) {
  const TemporaryFolder folder;
  write(folder / "scenes/a.ply", "ply\nend_header\n");
  const fs::path scene = folder / "scenes/a.ply", file = folder / "out/a.hlt";
  fs::create_directories(file.parent_path());
  const std::string path = scene_path_from(scene, file), hash = scene_files_hash(scene);
  EXPECT_EQ(path, "../scenes/a.ply");
  EXPECT_EQ(scene_state(file, path, hash), SceneState::same);
  // Moved beside the transport, it is still found.
  fs::rename(scene, folder / "out/a.ply");
  EXPECT_EQ(scene_state(file, path, hash), SceneState::same);
  write(folder / "out/a.ply", "ply\ncomment\nend_header\n");
  EXPECT_EQ(scene_state(file, path, hash), SceneState::changed);
  // One of both places is enough.
  write(scene, "ply\nend_header\n");
  EXPECT_EQ(scene_state(file, path, hash), SceneState::same);
  fs::remove(scene), fs::remove(folder / "out/a.ply");
  EXPECT_EQ(scene_state(file, path, hash), SceneState::not_found);
}

}  // namespace
}  // namespace haarlight
