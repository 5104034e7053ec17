// Small good inputs of every kind, to begin from.

#pragma once

#include <cmath>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "core/image_io.h"
#include "prt/motion_file.h"
#include "prt/transport_writer.h"
#include "tests/caching/small_gltf.h"
#include "tests/core/temporary_folder.h"
#include "tests/prt/fixtures.h"

namespace haarlight::fuzz {

inline std::string transport_seed(const fixtures::SmallTransport& small, bool as_journal = false) {
  const TemporaryFolder folder;
  const TransportWriterOptions options{small.thresholds, "seed", false};
  TransportWriter writer(folder / "seed.hlt", small.info, options);
  for (int t = 0; t < writer.tile_count(); ++t) {
    const TileRows& rows = small.tiles[static_cast<std::size_t>(t)];
    if (!rows.values.empty()) writer.write_tile(t, rows);
  }
  if (as_journal) return read_bytes(folder / "seed.hlt.partial");
  writer.finish(R"({"made_by": "seed"})");
  return read_bytes(folder / "seed.hlt");
}

/// A picture, a mesh, and a mesh of two terms with view factors: every section a file may have but
/// clusters.
inline std::vector<std::string> transport_seeds(bool as_journal = false) {
  std::vector<std::string> seeds;
  seeds.push_back(transport_seed(fixtures::small_transport(2, 8, 8, 1), as_journal));
  fixtures::SmallTransport mesh =
      fixtures::small_mesh_transport(1, fixtures::bumpy_sphere(12, 2), 2, 2);
  mesh.info.view = std::make_shared<const ViewFactors>(
      fixtures::random_view_factors(mesh.info.mesh->position.size(), 2, 3, 3));
  seeds.push_back(transport_seed(mesh, as_journal));
  return seeds;
}

inline std::vector<std::string> environment_seeds() {
  const TemporaryFolder folder;
  Image picture(16, 8);
  for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
    picture.pixels[i] = Rgb{1, 0.5f, 0.25f} * (0.1f + static_cast<float>(i % 5));
  }
  std::vector<std::string> seeds;
  char first = 0;
  for (const char* name : {"a.exr", "a.hdr", "a.png"}) {
    save_image(folder / name, picture);
    seeds.push_back(first++ + read_bytes(folder / name));
  }
  return seeds;
}

inline std::vector<std::string> recording_seeds() {
  MotionRecording recording;
  recording.environments = {"a.exr", "b.exr"};
  RecordedFrame frame;
  frame.camera = Camera{};
  recording.frames.push_back(frame);
  frame.light.to = 1;
  frame.light.blend = 0.5;
  frame.light.rotation = rotation_y(0.3);
  frame.light.discs.push_back({});
  frame.start = FrameStart::dark;
  recording.frames.push_back(frame);
  return {motion_text(recording)};
}

/// One triangle in each format; buffers of glTF inside.
inline std::vector<std::string> scene_seeds() {
  const std::string gltf =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],"nodes":[{"mesh":0,)"
      R"("scale":[2,2,2]},{"camera":0,"translation":[0,0,3]}],"cameras":[{"type":"perspective",)"
      R"("perspective":{"yfov":0.7,"znear":0.1}}],"materials":[{"pbrMetallicRoughness":)"
      R"({"baseColorFactor":[0.5,0.6,0.7,1],"roughnessFactor":0.4},"alphaMode":"MASK"}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],)"
      R"("buffers":[{"byteLength":42,"uri":"data:application/octet-stream;base64,)"
      R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA"}],"bufferViews":[{"buffer":0,)"
      R"("byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",)"
      R"("min":[0,0,0],"max":[1,1,0]},{"bufferView":1,"componentType":5123,"count":3,)"
      R"("type":"SCALAR"}]})";
  std::string glb = gltf;
  while (glb.size() % 4 != 0) glb += ' ';
  const auto u32 = [](std::size_t value) {
    std::string bytes;
    for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> (8 * i) & 255);
    return bytes;
  };
  glb = "glTF" + u32(2) + u32(glb.size() + 20) + u32(glb.size()) + "JSON" + glb;
  const std::string obj =
      "mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0 0\nvn 0 0 1\nusemtl a\n"
      "f 1/1/1 2/1/1 4/1/1 3/1/1\n";
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  std::string binary =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) {
    binary.append(reinterpret_cast<const char*>(&x), sizeof x);
  }
  binary += '\3';
  for (const std::size_t v : {0u, 1u, 2u}) binary += u32(v);
  return {std::string(1, '\0') + glb, std::string(1, '\1') + gltf, std::string(1, '\2') + obj,
          std::string(1, '\3') + ply, std::string(1, '\3') + binary};
}

/// Clips of every kind on one triangle.
inline std::vector<std::string> animation_seeds() { return {SmallGltf().glb()}; }

inline std::vector<std::string> api_seeds() {
  std::mt19937 random(5);
  std::vector<std::string> seeds(8);
  for (std::string& seed : seeds) {
    for (int i = 0; i < 1500; ++i) seed += static_cast<char>(random() & 255);
  }
  return seeds;
}

inline std::map<std::string, std::vector<std::string>> all_seeds() {
  return {{"transport", transport_seeds()},
          {"journal", transport_seeds(true)},
          {"recording", recording_seeds()},
          {"environment", environment_seeds()},
          {"scene", scene_seeds()},
          {"animation", animation_seeds()},
          {"api", api_seeds()}};
}

}  // namespace haarlight::fuzz
