// What glTF files say and the scene reader gets wrong or leaves out.

#include "precompute/gltf_extras.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/json_depth.h"

namespace haarlight {
namespace {

using nlohmann::json;

// Columns of a node's matrix and where its origin goes.
struct Affine {
  Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, origin;
  Vec3 direction(const Vec3& v) const { return x * v.x + y * v.y + z * v.z; }
  Vec3 point(const Vec3& v) const { return direction(v) + origin; }
  Affine operator*(const Affine& first) const {
    return {direction(first.x), direction(first.y), direction(first.z), point(first.origin)};
  }
};

Affine local_transform(const json& node) {
  Affine a;
  if (node.contains("matrix")) {  // column-major
    const auto m = node.at("matrix").get<std::vector<double>>();
    const auto column = [&](std::size_t c) { return Vec3{m.at(c), m.at(c + 1), m.at(c + 2)}; };
    return {column(0), column(4), column(8), column(12)};
  }
  if (node.contains("rotation")) {
    const auto q = node.at("rotation").get<std::vector<double>>();
    const double x = q.at(0), y = q.at(1), z = q.at(2), w = q.at(3);
    a.x = {1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)};
    a.y = {2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)};
    a.z = {2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)};
  }
  if (node.contains("scale")) {
    const auto s = node.at("scale").get<std::vector<double>>();
    a.x = a.x * s.at(0), a.y = a.y * s.at(1), a.z = a.z * s.at(2);
  }
  if (node.contains("translation")) {
    const auto t = node.at("translation").get<std::vector<double>>();
    a.origin = {t.at(0), t.at(1), t.at(2)};
  }
  return a;
}

// Upright, orthonormal and right-handed whatever scales the nodes above carry.
std::optional<Camera> make_camera(const Affine& place, double vertical_fov) {
  const double back_length = length(place.z), up_length = length(place.y);
  if (!(vertical_fov > 0) || !(vertical_fov < kPi) || !(back_length > 0) || !(up_length > 0) ||
      !std::isfinite(length(place.origin)) || !std::isfinite(back_length)) {
    return std::nullopt;
  }
  const Vec3 back = place.z * (1 / back_length);
  const Vec3 side = cross(place.y, back);
  if (!(length(side) > 1e-9 * up_length)) return std::nullopt;
  const Vec3 right = normalize(side);
  Camera camera;
  camera.position = place.origin;
  camera.orientation = Rotation{{right, cross(back, right), back}}.transposed();
  camera.vertical_fov = vertical_fov;
  return camera;
}

std::optional<Camera> find_camera(const json& file) {
  if (!file.contains("cameras") || !file.contains("nodes") || !file.contains("scenes")) {
    return std::nullopt;
  }
  const json& nodes = file.at("nodes");
  const json& scene = file.at("scenes").at(file.value("scene", std::size_t{0}));
  struct Visit {
    std::size_t node;
    Affine above;
    int depth;
  };
  std::vector<Visit> todo;
  if (scene.contains("nodes")) {
    for (const auto& root : scene.at("nodes")) todo.push_back({root.get<std::size_t>(), {}, 0});
  }
  // In the order of the file; a graph deeper than this can only be a circle.
  constexpr int kDeepest = 256;
  for (std::size_t i = 0; i < todo.size() && todo.size() <= 1000000; ++i) {
    const Visit here = todo[i];
    const json& node = nodes.at(here.node);
    const Affine place = here.above * local_transform(node);
    if (node.contains("camera")) {
      const json& camera = file.at("cameras").at(node.at("camera").get<std::size_t>());
      if (camera.contains("perspective")) {
        const auto made = make_camera(place, camera.at("perspective").at("yfov").get<double>());
        if (made) return made;
      }
    }
    if (node.contains("children") && here.depth < kDeepest) {
      for (const auto& child : node.at("children")) {
        todo.push_back({child.get<std::size_t>(), place, here.depth + 1});
      }
    }
  }
  return std::nullopt;
}

// The nodes of the scene as a tree, checked: the scene reader goes down it by recursion, once for
// each way that leads to a node. Returns the meshes that are in it, by number; none for glTF 1.0.
std::set<std::size_t> meshes_in_scene(const json& file, const std::string& name) {
  std::set<std::size_t> meshes;
  if (!file.contains("nodes") || !file.at("nodes").is_array() || !file.contains("scenes") ||
      !file.at("scenes").is_array()) {
    return meshes;
  }
  constexpr int kDeepest = 512;
  constexpr std::size_t kMostVisits = 1000000;
  const json& nodes = file.at("nodes");
  const auto number = file.value("scene", std::size_t{0});
  if (number >= file.at("scenes").size()) return meshes;
  struct Visit {
    std::size_t node;
    int depth;
  };
  std::vector<Visit> todo;
  const auto add = [&](const json& parent, const char* key, int depth) {
    if (!parent.contains(key)) return;
    for (const auto& child : parent.at(key)) todo.push_back({child.get<std::size_t>(), depth});
  };
  add(file.at("scenes").at(number), "nodes", 1);
  for (std::size_t visits = 0; !todo.empty(); ++visits) {
    const Visit here = todo.back();
    todo.pop_back();
    const auto refuse = [&](const std::string& why) {
      throw Error(ErrorKind::format, fmt::format("{}: node {} {}", name, here.node, why));
    };
    if (here.node >= nodes.size()) {
      refuse(fmt::format("is named but not there, expected a number below {}", nodes.size()));
    }
    if (here.depth > kDeepest) {
      refuse(fmt::format("is {} levels down, expected at most {} and no circle", here.depth,
                         kDeepest));
    }
    if (visits > kMostVisits) {
      refuse(fmt::format("is met after {} others, expected a tree of fewer nodes", kMostVisits));
    }
    const json& node = nodes.at(here.node);
    if (node.contains("mesh")) meshes.insert(node.at("mesh").get<std::size_t>());
    add(node, "children", here.depth + 1);
  }
  return meshes;
}

std::int64_t count_of(const json& accessors, const json& object, const char* key) {
  if (!object.contains(key)) return -1;
  const auto number = object.at(key).get<std::size_t>();
  return number < accessors.size() ? accessors.at(number).value("count", std::int64_t{0}) : 0;
}

// Triangles that the primitives of `meshes` promise, each once.
std::int64_t promised_triangles(const json& file, const std::set<std::size_t>& meshes) {
  if (!file.contains("meshes") || !file.contains("accessors")) return 0;
  const json& accessors = file.at("accessors");
  std::int64_t all = 0;
  for (const std::size_t m : meshes) {
    if (m >= file.at("meshes").size()) continue;
    for (const json& primitive : file.at("meshes").at(m).at("primitives")) {
      std::int64_t corners = count_of(accessors, primitive, "indices");
      if (corners < 0 && primitive.contains("attributes")) {
        corners = count_of(accessors, primitive.at("attributes"), "POSITION");
      }
      constexpr int kTriangles = 4, kStrip = 5, kFan = 6;
      const int mode = primitive.value("mode", kTriangles);
      if (mode == kTriangles) all += std::max<std::int64_t>(corners, 0) / 3;
      if (mode == kStrip || mode == kFan) all += std::max<std::int64_t>(corners - 2, 0);
    }
  }
  return all;
}

// A file's parts: the JSON is the whole .gltf, or the first chunk of a .glb; then come a .glb's
// other chunks.
struct Contents {
  std::string json, chunks;
  bool glb = false;
};
constexpr std::size_t kHeader = 12, kChunkHeader = 8;  // bytes; glTF 2.0, section 4.4

Contents read_contents(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    throw Error(ErrorKind::io, fmt::format("{}: cannot be opened for reading", file.string()));
  }
  std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  if (!bytes.starts_with("glTF")) return {std::move(bytes), {}, false};
  std::uint32_t size = 0, version = 0;
  if (bytes.size() < kHeader + kChunkHeader) return {};
  std::memcpy(&version, bytes.data() + 4, sizeof version);
  if (version != 2) {
    throw Error(ErrorKind::format,
                fmt::format("{}: a GLB of version {}, expected version 2", file.string(), version));
  }
  std::memcpy(&size, bytes.data() + kHeader, sizeof size);
  if (bytes.compare(kHeader + 4, 4, "JSON") != 0 || size > bytes.size() - kHeader - kChunkHeader) {
    return {};
  }
  const std::size_t end = kHeader + kChunkHeader + (std::size_t{size} + 3) / 4 * 4;
  Contents out{bytes.substr(kHeader + kChunkHeader, size), {}, true};
  if (end < bytes.size()) out.chunks = bytes.substr(end);
  return out;
}

std::string without_motion(json file, const Contents& contents) {
  file.erase("animations");
  file.erase("skins");
  if (file.contains("nodes")) {
    for (json& node : file.at("nodes")) {
      if (node.is_object()) node.erase("skin");
    }
  }
  std::string text = file.dump(-1, ' ', false, json::error_handler_t::replace);
  if (!contents.glb) return text;
  while (text.size() % 4 != 0) text += ' ';
  const auto word = [](std::size_t value) {
    const auto bits = static_cast<std::uint32_t>(value);
    return std::string(reinterpret_cast<const char*>(&bits), sizeof bits);
  };
  return "glTF" + word(2) + word(kHeader + kChunkHeader + text.size() + contents.chunks.size()) +
         word(text.size()) + "JSON" + text + contents.chunks;
}

}  // namespace

GltfExtras read_gltf_extras(const std::filesystem::path& file) {
  try {
    const Contents contents = read_contents(file);
    if (json_nests_too_deep(contents.json)) {
      throw Error(ErrorKind::format,
                  fmt::format("{}: its JSON nests deeper than {}, expected glTF 2.0", file.string(),
                              kMostJsonDepth));
    }
    const json parsed = json::parse(contents.json);
    GltfExtras extras;
    extras.material = gltf_materials(parsed);
    const std::set<std::size_t> meshes = meshes_in_scene(parsed, file.string());
    extras.triangles = promised_triangles(parsed, meshes);
    extras.camera = find_camera(parsed);
    if (parsed.contains("animations") || parsed.contains("skins")) {
      extras.still = without_motion(parsed, contents);
    }
    return extras;
  } catch (const json::exception&) {
    throw Error(ErrorKind::format,
                fmt::format("{}: not readable as glTF, expected the JSON of glTF 2.0 or a GLB that "
                            "is not cut short",
                            file.string()));
  } catch (const std::out_of_range&) {
    throw Error(
        ErrorKind::format,
        fmt::format("{}: a camera's node has too few numbers in its transform", file.string()));
  }
}

}  // namespace haarlight
