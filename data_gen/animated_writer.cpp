// Puts bodies, lights and their motions together and writes them as animated glTF.

#include "data_gen/animated_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"

namespace haarlight::data_gen {
namespace {

using nlohmann::json;
constexpr int kFloat = 5126, kUnsignedInt = 5125;

std::size_t push(json& list, json value) {
  list.push_back(std::move(value));
  return list.size() - 1;
}

json color(const Rgb& c) { return json::array({c.r, c.g, c.b}); }

std::vector<float> flat(const std::vector<Vec3>& vectors) {
  std::vector<float> out;
  for (const Vec3& v : vectors) {
    for (const double x : {v.x, v.y, v.z}) out.push_back(static_cast<float>(x));
  }
  return out;
}

}  // namespace

std::size_t AnimatedWriter::add_view(const void* data, std::size_t size) {
  const auto* from = static_cast<const char*>(data);
  const std::size_t begin = bytes_.size();
  bytes_.insert(bytes_.end(), from, from + size);
  return push(gltf_["bufferViews"], {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", size}});
}

std::size_t AnimatedWriter::add_floats(const std::vector<float>& values, std::size_t width,
                                       bool bounds) {
  static constexpr const char* kShapes[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
  json accessor{{"componentType", kFloat},
                {"count", values.size() / width},
                {"type", kShapes[width - 1]},
                {"bufferView", add_view(values.data(), values.size() * sizeof(float))}};
  if (bounds) {
    std::vector<float> low(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(width));
    std::vector<float> high = low;
    for (std::size_t i = 0; i < values.size(); ++i) {
      low[i % width] = std::min(low[i % width], values[i]);
      high[i % width] = std::max(high[i % width], values[i]);
    }
    accessor["min"] = low, accessor["max"] = high;
  }
  return push(gltf_["accessors"], std::move(accessor));
}

std::size_t AnimatedWriter::add_material(const std::string& name, const Rgb& base, float metallic,
                                         float roughness, const Rgb& emission) {
  json m{{"name", name},
         {"pbrMetallicRoughness",
          {{"baseColorFactor", {base.r, base.g, base.b, 1}},
           {"metallicFactor", metallic},
           {"roughnessFactor", roughness}}}};
  const float strength = std::max({emission.r, emission.g, emission.b});
  if (strength > 0) {
    m["emissiveFactor"] = color(emission * (1 / strength));
    m["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = strength;
  }
  if (metallic == 0 && roughness == 1) {  // matt, without a coat
    m["extras"]["haarlight"]["phong"] = {
        {"diffuse", color(base)}, {"specular", {0, 0, 0}}, {"exponent", 32}};
  }
  return push(gltf_["materials"], std::move(m));
}

std::size_t AnimatedWriter::add_mesh(const Scene& body, std::size_t material) {
  std::vector<std::uint32_t> index;
  for (const Triangle& t : body.triangle) {
    index.insert(index.end(), t.vertex.begin(), t.vertex.end());
  }
  triangles_ += body.triangle.size();
  json attributes;
  attributes["POSITION"] = add_floats(flat(body.position), 3, true);
  attributes["NORMAL"] = add_floats(flat(body.normal), 3, false);
  const std::size_t view = add_view(index.data(), index.size() * sizeof(std::uint32_t));
  const std::size_t indices = push(gltf_["accessors"], {{"componentType", kUnsignedInt},
                                                        {"count", index.size()},
                                                        {"type", "SCALAR"},
                                                        {"bufferView", view}});
  return push(gltf_["meshes"], {{"primitives", json::array({{{"attributes", attributes},
                                                             {"indices", indices},
                                                             {"material", material}}})}});
}

std::size_t AnimatedWriter::add_node(json node) { return push(gltf_["nodes"], std::move(node)); }

std::size_t AnimatedWriter::add_camera_node(const Camera& camera) {
  const std::size_t number =
      push(gltf_["cameras"],
           {{"type", "perspective"},
            {"perspective", {{"yfov", camera.vertical_fov}, {"znear", 0.01}, {"zfar", 1000.0}}}});
  std::vector<double> m;
  for (const Vec3& c : camera.orientation.transposed().row) {
    m.insert(m.end(), {c.x, c.y, c.z, 0.0});
  }
  m.insert(m.end(), {camera.position.x, camera.position.y, camera.position.z, 1.0});
  return add_node({{"name", "camera"}, {"camera", number}, {"matrix", m}});
}

std::size_t AnimatedWriter::add_point_light(const Rgb& tint, double intensity) {
  return push(gltf_["extensions"]["KHR_lights_punctual"]["lights"],
              {{"type", "point"}, {"color", color(tint)}, {"intensity", intensity}});
}

void AnimatedWriter::animate(std::size_t node, const std::string& path,
                             const std::vector<float>& seconds, const std::vector<float>& values,
                             const std::string& interpolation) {
  const std::size_t width = path == "rotation" ? 4 : 3;
  const std::size_t input = add_floats(seconds, 1, true);
  const std::size_t output = add_floats(values, width, false);
  const std::size_t sampler =
      push(samplers_, {{"input", input}, {"output", output}, {"interpolation", interpolation}});
  channels_.push_back({{"sampler", sampler}, {"target", {{"node", node}, {"path", path}}}});
}

void AnimatedWriter::save(const std::filesystem::path& file) const {
  if (file.extension() != ".glb") {
    throw Error(ErrorKind::invalid_argument, fmt::format("{}: suffix is \"{}\", expected .glb",
                                                         file.string(), file.extension().string()));
  }
  json gltf = gltf_;
  gltf["asset"] = {{"version", "2.0"}, {"generator", "haarlight-data"}};
  json roots = json::array();
  for (std::size_t n = 0; n < gltf["nodes"].size(); ++n) roots.push_back(n);
  gltf["scenes"] = json::array({{{"nodes", roots}}});
  gltf["scene"] = 0;
  gltf["buffers"] = json::array({{{"byteLength", bytes_.size()}}});
  json used = json::array({"KHR_materials_emissive_strength"});
  if (gltf.contains("extensions")) used.push_back("KHR_lights_punctual");
  gltf["extensionsUsed"] = used;
  if (!channels_.empty()) {
    gltf["animations"] = json::array({{{"channels", channels_}, {"samplers", samplers_}}});
  }
  // A header, then the two chunks; all numbers are of four bytes, so the binary one needs no end.
  std::string text = gltf.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::uint64_t total = 12 + 8 + text.size() + 8 + bytes_.size();
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{}: {} bytes, a .glb holds at most 4 GiB", file.string(), total));
  }
  const auto u32 = [](std::uint64_t value) { return static_cast<std::uint32_t>(value); };
  const std::array<std::uint32_t, 5> head{0x46546c67u, 2u, u32(total), u32(text.size()),
                                          0x4e4f534au};
  const std::array<std::uint32_t, 2> binary_head{u32(bytes_.size()), 0x004e4942u};
  AtomicFile out(file);
  out.write(head.data(), sizeof head);
  out.write(text.data(), text.size());
  out.write(binary_head.data(), sizeof binary_head);
  out.write(bytes_.data(), bytes_.size());
  out.commit();
}

}  // namespace haarlight::data_gen
