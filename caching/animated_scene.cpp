// A scene that moves: animated glTF.

#include "caching/animated_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>

#include "caching/gltf_document.h"
#include "caching/keyframes.h"
#include "core/error.h"
#include "precompute/scene_import.h"

namespace haarlight {
namespace {

using nlohmann::json;
constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

// Columns of a node's matrix and where its origin goes.
struct Affine {
  Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1}, origin;
  Vec3 direction(const Vec3& v) const { return x * v.x + y * v.y + z * v.z; }
  Vec3 point(const Vec3& v) const { return direction(v) + origin; }
  double determinant() const { return dot(x, cross(y, z)); }
  // By the cofactors: the inverse transposed, up to a positive factor.
  Vec3 normal(const Vec3& v) const {
    const Vec3 n = cross(y, z) * v.x + cross(z, x) * v.y + cross(x, y) * v.z;
    const double size = length(n);
    if (!(size > 0) || !std::isfinite(size)) return {};
    return n * ((determinant() < 0 ? -1 : 1) / size);
  }
  Affine operator*(const Affine& first) const {
    return {direction(first.x), direction(first.y), direction(first.z), point(first.origin)};
  }
};

struct Node {
  std::size_t parent = kNone;
  std::optional<Affine> matrix;
  std::array<double, 3> translation{0, 0, 0}, scale{1, 1, 1};
  std::array<double, 4> rotation{0, 0, 0, 1};
  std::vector<double> weights;
  std::size_t mesh = kNone, camera = kNone, light = kNone;

  Affine local() const {
    if (matrix) return *matrix;
    const auto [i, j, k, w] = rotation;
    Affine a;
    a.x = Vec3{1 - 2 * (j * j + k * k), 2 * (i * j + k * w), 2 * (i * k - j * w)} * scale[0];
    a.y = Vec3{2 * (i * j - k * w), 1 - 2 * (i * i + k * k), 2 * (j * k + i * w)} * scale[1];
    a.z = Vec3{2 * (i * k + j * w), 2 * (j * k - i * w), 1 - 2 * (i * i + j * j)} * scale[2];
    a.origin = {translation[0], translation[1], translation[2]};
    return a;
  }
};

struct Primitive {
  std::vector<Vec3> position, normal;
  std::vector<std::array<float, 2>> uv, uv2;
  std::vector<Rgb> tint;
  std::vector<std::array<std::uint32_t, 3>> triangle;
  std::uint32_t material = 0;
  std::vector<std::vector<Vec3>> position_morph, normal_morph;  // one a target; may be empty
};

struct Mesh {
  std::vector<Primitive> primitive;
  std::vector<double> weights;
};

// Everything that can change, as it is at one time.
struct State {
  std::vector<Node> node;
  std::vector<Material> material;
  std::vector<RgbD> emissive;
  std::vector<double> strength;
  std::vector<RgbD> light_color;
  std::vector<double> light_intensity;
  std::vector<double> yfov;
  double environment_turn = 0;  // radians about +Y
};

struct Channel {
  Keyframes keys;
  std::function<void(State&, const std::vector<double>&)> set;
};

std::vector<Vec3> vectors(const std::vector<double>& n) {
  std::vector<Vec3> out(n.size() / 3);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = {n[3 * i], n[3 * i + 1], n[3 * i + 2]};
  return out;
}

template <std::size_t N>
void read_array(const json& from, const char* key, std::array<double, N>& to) {
  if (!from.contains(key)) return;
  for (std::size_t k = 0; k < N; ++k) to[k] = from.at(key).at(k).get<double>();
}

RgbD read_rgb(const json& from, const char* key, const RgbD& otherwise) {
  if (!from.contains(key)) return otherwise;
  const json& c = from.at(key);
  return {c.at(0).get<double>(), c.at(1).get<double>(), c.at(2).get<double>()};
}

float unit(double value) { return static_cast<float>(std::clamp(value, 0.0, 1.0)); }

// A member of a member, or an empty object.
const json& inside(const json& from, std::initializer_list<const char*> path) {
  static const json kEmpty = json::object();
  const json* at = &from;
  for (const char* key : path) {
    if (!at->is_object() || !at->contains(key)) return kEmpty;
    at = &at->at(key);
  }
  return *at;
}

}  // namespace

struct AnimatedScene::Parts {
  Scene look;  // materials and textures; geometry is taken out
  State start;
  std::vector<Mesh> mesh;
  std::vector<Channel> channel;
  std::vector<SceneLight> light;     // kind and angles, by number
  std::vector<bool> both_sides;      // a material
  std::vector<std::size_t> order;    // nodes of the scene, parents first
  std::vector<std::uint32_t> owner;  // node of a triangle
  std::size_t camera_node = kNone;
  RgbD background;
  std::shared_ptr<const EnvironmentLight> environment;
  double turn_a_second = 0;  // of it, beside what keys say
  std::size_t scene_number = 0;
  std::vector<Vec3> carried;      // by node: what a person did
  std::optional<Camera> seen_by;  // in place of the file's
  double rate = 25, end = 0;

  void read(const GltfDocument& file);

 private:
  void read_nodes(const GltfDocument& file);
  void read_looks(const GltfDocument& file);
  void read_channels(const GltfDocument& file);
  Primitive read_primitive(const GltfDocument& file, const json& in) const;
  std::function<void(State&, const std::vector<double>&)> target(const GltfDocument& file,
                                                                 const json& target,
                                                                 std::size_t& width,
                                                                 bool& rotation) const;
};

void AnimatedScene::Parts::read_nodes(const GltfDocument& file) {
  const json& nodes = file.list("nodes");
  for (const json& in : nodes) {
    Node node;
    if (in.contains("matrix")) {
      std::array<double, 16> m{};
      read_array(in, "matrix", m);
      node.matrix = Affine{
          {m[0], m[1], m[2]}, {m[4], m[5], m[6]}, {m[8], m[9], m[10]}, {m[12], m[13], m[14]}};
    }
    read_array(in, "translation", node.translation);
    read_array(in, "rotation", node.rotation);
    read_array(in, "scale", node.scale);
    node.mesh = in.value("mesh", kNone);
    node.camera = in.value("camera", kNone);
    node.light = inside(in, {"extensions", "KHR_lights_punctual"}).value("light", kNone);
    if (node.mesh != kNone) {
      node.weights = mesh.at(node.mesh).weights;
      if (in.contains("weights")) node.weights = in.at("weights").get<std::vector<double>>();
      node.weights.resize(mesh.at(node.mesh).weights.size());
    }
    start.node.push_back(std::move(node));
  }
  // import_scene() has refused circles and numbers out of range; a node met twice is refused here.
  const json& scenes = file.list("scenes");
  const auto number = file.json().value("scene", std::size_t{0});
  scene_number = number;
  if (number < scenes.size()) {
    for (const json& root : scenes.at(number).value("nodes", json::array())) {
      order.push_back(root.get<std::size_t>());
    }
    background = read_rgb(inside(scenes.at(number), {"extras", "haarlight"}), "background", {});
    const json& picture = inside(scenes.at(number), {"extras", "haarlight", "environment"});
    start.environment_turn = picture.value("rotation", 0.0);
    if (picture.contains("uri")) {
      const std::filesystem::path beside = std::filesystem::path(file.name()).parent_path();
      environment = std::make_shared<const EnvironmentLight>(
          load_environment(beside / picture.at("uri").get<std::string>()));
    }
  }
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (order.size() > nodes.size()) {
      throw Error(ErrorKind::format,
                  fmt::format("{}: a node has two parents, expected a tree", file.name()));
    }
    for (const json& child : nodes.at(order[i]).value("children", json::array())) {
      start.node.at(child.get<std::size_t>()).parent = order[i];
      order.push_back(child.get<std::size_t>());
    }
  }
  for (const std::size_t n : order) {
    const Node& node = start.node.at(n);
    if (node.camera != kNone && camera_node == kNone && start.yfov.at(node.camera) > 0) {
      camera_node = n;
    }
    if (node.light != kNone) light.at(node.light);
    if (node.mesh == kNone) continue;
    for (const Primitive& p : mesh[node.mesh].primitive) {
      owner.insert(owner.end(), p.triangle.size(), static_cast<std::uint32_t>(n));
    }
  }
}

void AnimatedScene::Parts::read_looks(const GltfDocument& file) {
  for (const json& m : file.list("materials")) {
    start.emissive.push_back(read_rgb(m, "emissiveFactor", {}));
    start.strength.push_back(inside(m, {"extensions", "KHR_materials_emissive_strength"})
                                 .value("emissiveStrength", 1.0));
    both_sides.push_back(m.value("doubleSided", false));
  }
  start.material = look.material;
  // The default material stands behind those of the file.
  const std::size_t materials = file.list("materials").size();
  if (start.material.size() == materials) start.material.emplace_back();
  start.emissive.resize(start.material.size());
  start.strength.resize(start.material.size(), 1.0);
  both_sides.resize(start.material.size(), false);
  for (const json& c : file.list("cameras")) {
    start.yfov.push_back(inside(c, {"perspective"}).value("yfov", 0.0));
  }
  const json& punctual = inside(file.json(), {"extensions", "KHR_lights_punctual"});
  if (!punctual.contains("lights")) return;
  for (const json& l : punctual.at("lights")) {
    SceneLight out;
    const auto type = l.at("type").get<std::string>();
    if (type == "spot") out.kind = SceneLight::Kind::spot;
    if (type == "directional") out.kind = SceneLight::Kind::directional;
    out.inner = inside(l, {"spot"}).value("innerConeAngle", out.inner);
    out.outer = inside(l, {"spot"}).value("outerConeAngle", out.outer);
    light.push_back(out);
    start.light_color.push_back(read_rgb(l, "color", {1, 1, 1}));
    start.light_intensity.push_back(l.value("intensity", 1.0));
  }
}

Primitive AnimatedScene::Parts::read_primitive(const GltfDocument& file, const json& in) const {
  constexpr int kTriangles = 4;
  if (in.value("mode", kTriangles) != kTriangles) {
    throw Error(ErrorKind::format, fmt::format("{}: a mesh is of points, lines, strips or fans, "
                                               "expected triangles in a scene that moves",
                                               file.name()));
  }
  Primitive p;
  const json& attributes = in.at("attributes");
  const auto read = [&](const json& from, const char* key, std::size_t width) {
    if (!from.contains(key)) return std::vector<double>();
    std::vector<double> n = file.numbers(from.at(key).get<std::size_t>(), width);
    if (!p.position.empty() && n.size() / width != p.position.size()) {
      throw Error(ErrorKind::format, fmt::format("{}: {} has {} entries, expected {}", file.name(),
                                                 key, n.size() / width, p.position.size()));
    }
    return n;
  };
  p.position = vectors(read(attributes, "POSITION", 3));
  p.normal = vectors(read(attributes, "NORMAL", 3));
  const auto read_uv = [&](const char* key) {
    const std::vector<double> n = read(attributes, key, 2);
    std::vector<std::array<float, 2>> uv(n.size() / 2);
    for (std::size_t i = 0; i < uv.size(); ++i) {  // v runs up in a Scene
      uv[i] = {static_cast<float>(n[2 * i]), static_cast<float>(1 - n[2 * i + 1])};
    }
    return uv;
  };
  p.uv = read_uv("TEXCOORD_0"), p.uv2 = read_uv("TEXCOORD_1");
  const auto material = in.value("material", start.material.size() - 1);
  if (material >= start.material.size()) {
    throw Error(ErrorKind::format,
                fmt::format("{}: material {} is not there", file.name(), material));
  }
  p.material = static_cast<std::uint32_t>(material);
  std::vector<double> index;
  if (in.contains("indices")) {
    index = file.numbers(in.at("indices").get<std::size_t>(), 1);
  } else {
    for (std::size_t v = 0; v < p.position.size(); ++v) index.push_back(static_cast<double>(v));
  }
  for (std::size_t i = 0; i + 2 < index.size(); i += 3) {
    std::array<std::uint32_t, 3> t{};
    for (std::size_t c = 0; c < 3; ++c) {
      if (!(index[i + c] < static_cast<double>(p.position.size()))) {
        throw Error(ErrorKind::format, fmt::format("{}: a triangle names vertex {}, expected below "
                                                   "{}",
                                                   file.name(), index[i + c], p.position.size()));
      }
      t[c] = static_cast<std::uint32_t>(index[i + c]);
    }
    p.triangle.push_back(t);
  }
  for (const json& morph : in.value("targets", json::array())) {
    p.position_morph.push_back(vectors(read(morph, "POSITION", 3)));
    p.normal_morph.push_back(vectors(read(morph, "NORMAL", 3)));
  }
  return p;
}

std::function<void(State&, const std::vector<double>&)> AnimatedScene::Parts::target(
    const GltfDocument& file, const json& where, std::size_t& width, bool& rotation) const {
  const auto path = where.at("path").get<std::string>();
  if (path != "pointer") {
    if (!where.contains("node")) return {};
    const auto n = where.at("node").get<std::size_t>();
    if (n >= start.node.size()) {
      throw Error(ErrorKind::format,
                  fmt::format("{}: an animation moves node {}, expected below {}", file.name(), n,
                              start.node.size()));
    }
    width = 3;
    if (path == "translation") {
      return [n](State& s, const auto& v) {
        std::copy_n(v.begin(), 3, s.node[n].translation.begin());
      };
    }
    if (path == "scale") {
      return [n](State& s, const auto& v) { std::copy_n(v.begin(), 3, s.node[n].scale.begin()); };
    }
    if (path == "rotation") {
      width = 4, rotation = true;
      return
          [n](State& s, const auto& v) { std::copy_n(v.begin(), 4, s.node[n].rotation.begin()); };
    }
    width = start.node[n].weights.size();
    if (path != "weights" || width == 0) return {};
    return [n](State& s, const auto& v) { s.node[n].weights = v; };
  }
  // "/materials/3/emissiveFactor" and the like.
  const auto pointer =
      inside(where, {"extensions", "KHR_animation_pointer"}).value("pointer", std::string());
  const auto number = [&](const std::string& head, std::size_t count) {
    if (!pointer.starts_with(head)) return kNone;
    std::size_t i = 0, at = head.size();
    while (at < pointer.size() && pointer[at] >= '0' && pointer[at] <= '9' && i < count) {
      i = 10 * i + static_cast<std::size_t>(pointer[at++] - '0');
    }
    return at > head.size() && i < count ? i : kNone;
  };
  const auto ends = [&](const char* tail) { return pointer.ends_with(tail); };
  const auto rgb = [](const std::vector<double>& v) { return RgbD{v[0], v[1], v[2]}; };
  if (const auto m = number("/materials/", file.list("materials").size()); m != kNone) {
    width = 3;
    if (ends("/emissiveFactor"))
      return [m, rgb](State& s, const auto& v) { s.emissive[m] = rgb(v); };
    width = 4;
    if (ends("/baseColorFactor")) {
      return [m](State& s, const auto& v) {
        s.material[m].albedo = {unit(v[0]), unit(v[1]), unit(v[2])};
      };
    }
    width = 1;
    if (ends("/emissiveStrength")) return [m](State& s, const auto& v) { s.strength[m] = v[0]; };
    if (ends("/metallicFactor"))
      return [m](State& s, const auto& v) { s.material[m].metallic = unit(v[0]); };
    if (ends("/roughnessFactor"))
      return [m](State& s, const auto& v) { s.material[m].roughness = unit(v[0]); };
  }
  if (const auto l = number("/extensions/KHR_lights_punctual/lights/", light.size()); l != kNone) {
    width = 3;
    if (ends("/color")) return [l, rgb](State& s, const auto& v) { s.light_color[l] = rgb(v); };
    width = 1;
    if (ends("/intensity")) return [l](State& s, const auto& v) { s.light_intensity[l] = v[0]; };
  }
  if (const auto c = number("/cameras/", start.yfov.size()); c != kNone && ends("/yfov")) {
    width = 1;
    return [c](State& s, const auto& v) { s.yfov[c] = v[0]; };
  }
  if (pointer == fmt::format("/scenes/{}/extras/haarlight/environment/rotation", scene_number)) {
    width = 1;
    return [](State& s, const auto& v) { s.environment_turn = v[0]; };
  }
  throw Error(ErrorKind::format,
              fmt::format("{}: an animation points to \"{}\", expected one of the numbers of "
                          "materials, lights and cameras that can change",
                          file.name(), pointer));
}

void AnimatedScene::Parts::read_channels(const GltfDocument& file) {
  for (const json& clip : file.list("animations")) {
    for (const json& in : clip.at("channels")) {
      Channel c;
      c.set = target(file, in.at("target"), c.keys.width, c.keys.rotation);
      if (!c.set) continue;
      const json& sampler = clip.at("samplers").at(in.at("sampler").get<std::size_t>());
      const auto kind = sampler.value("interpolation", std::string("LINEAR"));
      c.keys.interpolation = kind == "STEP"          ? Interpolation::step
                             : kind == "CUBICSPLINE" ? Interpolation::cubic
                                                     : Interpolation::linear;
      const auto output = sampler.at("output").get<std::size_t>();
      c.keys.time = file.numbers(sampler.at("input").get<std::size_t>(), 1);
      // Weights are scalars, all targets of a key in a row.
      const bool weights = in.at("target").at("path") == "weights";
      c.keys.value = file.numbers(output, weights ? 1 : c.keys.width);
      const std::size_t wanted = c.keys.time.size() * c.keys.width *
                                 (c.keys.interpolation == Interpolation::cubic ? 3 : 1);
      const bool ascending = std::adjacent_find(c.keys.time.begin(), c.keys.time.end(),
                                                std::greater_equal<>()) == c.keys.time.end();
      if (c.keys.time.empty() || c.keys.value.size() != wanted || !ascending) {
        throw Error(ErrorKind::format,
                    fmt::format("{}: an animation has {} keys of {} numbers, expected {} numbers "
                                "and ascending times",
                                file.name(), c.keys.time.size(), c.keys.value.size(), wanted));
      }
      end = std::max(end, c.keys.time.back());
      channel.push_back(std::move(c));
    }
  }
}

void AnimatedScene::Parts::read(const GltfDocument& file) {
  try {
    read_looks(file);
    for (const json& in : file.list("meshes")) {
      Mesh m;
      for (const json& p : in.at("primitives")) m.primitive.push_back(read_primitive(file, p));
      m.weights = in.value("weights", std::vector<double>());
      m.weights.resize(m.primitive.empty() ? 0 : m.primitive.front().position_morph.size());
      for (const Primitive& p : m.primitive) {
        if (p.position_morph.size() == m.weights.size()) continue;
        throw Error(ErrorKind::format,
                    fmt::format("{}: the parts of a mesh have {} and {} morph "
                                "targets, expected equal numbers",
                                file.name(), m.weights.size(), p.position_morph.size()));
      }
      mesh.push_back(std::move(m));
    }
    read_nodes(file);
    read_channels(file);
  } catch (const json::exception&) {
    throw Error(ErrorKind::format, fmt::format("{}: its animation or its meshes are not as glTF "
                                               "2.0 has them",
                                               file.name()));
  } catch (const std::out_of_range&) {
    throw Error(ErrorKind::format, fmt::format("{}: names a mesh, camera or light that is not "
                                               "there",
                                               file.name()));
  }
}

AnimatedScene::AnimatedScene(const std::filesystem::path& file, double frames_per_second)
    : parts_(std::make_unique<Parts>()) {
  if (!(frames_per_second > 0) || !std::isfinite(frames_per_second)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{} frames a second, expected more than 0", frames_per_second));
  }
  const std::string suffix = file.extension().string();
  if (suffix != ".gltf" && suffix != ".glb") {
    throw Error(ErrorKind::format,
                fmt::format("{}: suffix is \"{}\", expected .gltf or .glb", file.string(), suffix));
  }
  parts_->rate = frames_per_second;
  parts_->look = import_scene(file);
  Scene& look = parts_->look;
  look.position.clear(), look.normal.clear(), look.uv.clear(), look.uv2.clear();
  look.tint.clear(), look.triangle.clear();
  parts_->read(GltfDocument(file));
  parts_->carried.resize(parts_->start.node.size());
}

AnimatedScene::~AnimatedScene() = default;
AnimatedScene::AnimatedScene(AnimatedScene&&) noexcept = default;

void AnimatedScene::set_environment(std::shared_ptr<const EnvironmentLight> light, double start,
                                    double a_second) {
  parts_->environment = std::move(light);
  parts_->start.environment_turn = start;
  parts_->turn_a_second = a_second;
}

void AnimatedScene::carry(std::uint32_t node, const Vec3& metres) {
  if (node >= parts_->carried.size()) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{}: node {} is not there, expected below {}", parts_->look.name, node,
                            parts_->carried.size()));
  }
  parts_->carried[node] = metres;
}

Vec3 AnimatedScene::carried(std::uint32_t node) const { return parts_->carried.at(node); }

void AnimatedScene::set_camera(const std::optional<Camera>& camera) { parts_->seen_by = camera; }

std::vector<std::uint32_t> AnimatedScene::light_nodes() const {
  std::vector<std::uint32_t> nodes;
  for (const std::size_t n : parts_->order) {
    if (parts_->start.node[n].light != kNone) nodes.push_back(static_cast<std::uint32_t>(n));
  }
  return nodes;
}

int AnimatedScene::frames() const {
  const double last = std::floor(parts_->end * parts_->rate + 1e-6);
  return 1 + static_cast<int>(std::min(last, 1e8));
}
std::size_t AnimatedScene::triangle_count() const { return parts_->owner.size(); }
std::uint32_t AnimatedScene::instance_of(std::uint32_t triangle) const {
  return parts_->owner[triangle];
}

namespace {

// One part of a mesh where its node stands, morphed by the node's weights.
void add_primitive(const Primitive& p, const Affine& place, const std::vector<double>& weights,
                   Scene& scene) {
  const auto first = static_cast<std::uint32_t>(scene.position.size());
  const std::size_t count = p.position.size();
  for (std::size_t v = 0; v < count; ++v) {
    Vec3 position = p.position[v];
    Vec3 normal = p.normal.empty() ? Vec3{} : p.normal[v];
    for (std::size_t m = 0; m < weights.size(); ++m) {
      if (weights[m] == 0) continue;
      if (!p.position_morph[m].empty()) position = position + p.position_morph[m][v] * weights[m];
      if (!p.normal_morph[m].empty()) normal = normal + p.normal_morph[m][v] * weights[m];
    }
    scene.position.push_back(place.point(position));
    scene.normal.push_back(place.normal(normal));
    scene.uv.push_back(p.uv.empty() ? std::array<float, 2>{} : p.uv[v]);
    scene.uv2.push_back(p.uv2.empty() ? std::array<float, 2>{} : p.uv2[v]);
  }
  const bool mirrored = place.determinant() < 0;
  for (const auto& t : p.triangle) {
    Triangle out;
    out.material = p.material;
    for (std::size_t c = 0; c < 3; ++c) out.vertex[mirrored ? 2 - c : c] = first + t[c];
    scene.triangle.push_back(out);
    if (!p.normal.empty()) continue;
    // No normals in the file: the mean of the triangles about a vertex, by their areas.
    const Vec3 a = scene.position[out.vertex[0]];
    const Vec3 face = cross(scene.position[out.vertex[1]] - a, scene.position[out.vertex[2]] - a);
    for (const std::uint32_t v : out.vertex) scene.normal[v] = scene.normal[v] + face;
  }
  if (!p.normal.empty()) return;
  for (std::size_t v = first; v < scene.normal.size(); ++v) {
    const double size = length(scene.normal[v]);
    scene.normal[v] = size > 0 ? scene.normal[v] * (1 / size) : Vec3{0, 1, 0};
  }
}

std::optional<Camera> camera_at(const Affine& place, double vertical_fov) {
  const Vec3 side = cross(place.y, place.z);
  const double size = length(side), back = length(place.z);
  if (!(size > 0) || !(back > 0) || !(vertical_fov > 0) || !(vertical_fov < kPi)) {
    return std::nullopt;
  }
  const Vec3 z = place.z * (1 / back), x = side * (1 / size);
  Camera camera;
  camera.position = place.origin;
  camera.orientation = Rotation{{x, cross(z, x), z}}.transposed();
  camera.vertical_fov = vertical_fov;
  return camera;
}

}  // namespace

AnimatedFrame AnimatedScene::at(int frame) const {
  const Parts& p = *parts_;
  State now = p.start;
  std::vector<double> value;
  for (const Channel& c : p.channel) {
    value.resize(c.keys.width);
    c.keys.at(frame / p.rate, value);
    c.set(now, value);
    // A matrix cannot be animated (glTF 2.0, 3.11): what moves has its parts instead.
  }
  AnimatedFrame out;
  out.frame = frame;
  out.background = p.background;
  out.environment = p.environment;
  out.environment_turn = rotation_y(now.environment_turn + p.turn_a_second * (frame / p.rate));
  out.scene = p.look;
  out.scene.material = now.material;
  out.scene.camera.reset();
  for (std::size_t m = 0; m < now.material.size(); ++m) {
    out.emission.push_back({now.emissive[m] * std::max(now.strength[m], 0.0), p.both_sides[m]});
  }
  std::vector<Affine> world(now.node.size());
  for (const std::size_t n : p.order) {
    const Node& node = now.node[n];
    world[n] = node.parent == kNone ? node.local() : world[node.parent] * node.local();
    world[n].origin = world[n].origin + p.carried[n];
    if (node.mesh != kNone) {
      for (const Primitive& part : p.mesh[node.mesh].primitive) {
        add_primitive(part, world[n], node.weights, out.scene);
      }
    }
    if (n == p.camera_node) out.scene.camera = camera_at(world[n], now.yfov[node.camera]);
    if (node.light != kNone) {
      SceneLight light = p.light[node.light];
      light.position = world[n].origin;
      const double size = length(world[n].z);
      if (size > 0) light.direction = world[n].z * (-1 / size);
      light.intensity =
          now.light_color[node.light] * std::max(now.light_intensity[node.light], 0.0);
      out.light.push_back(light);
    }
  }
  if (p.seen_by) out.scene.camera = p.seen_by;
  if (p.camera_node != kNone && !out.scene.camera) {
    throw Error(ErrorKind::missing, fmt::format("{}: frame {} has no camera that can see, expected "
                                                "a node of some size",
                                                p.look.name, frame));
  }
  return out;
}

}  // namespace haarlight
