// Puts bodies, lights and their motions together and writes them as animated glTF.

#include "data_gen/animated_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "data_gen/gltf_material.h"
#include "data_gen/png.h"

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

std::size_t AnimatedWriter::add_index(const std::vector<std::uint32_t>& index) {
  const std::size_t view = add_view(index.data(), index.size() * sizeof(std::uint32_t));
  return push(gltf_["accessors"], {{"componentType", kUnsignedInt},
                                   {"count", index.size()},
                                   {"type", "SCALAR"},
                                   {"bufferView", view}});
}

std::size_t AnimatedWriter::add_texture(const Image& picture, const std::vector<float>& alpha,
                                        bool srgb) {
  constexpr int kLinear = 9729, kRepeat = 10497;
  if (!gltf_.contains("samplers")) {
    gltf_["samplers"] = json::array(
        {{{"magFilter", kLinear}, {"minFilter", kLinear}, {"wrapS", kRepeat}, {"wrapT", kRepeat}}});
  }
  std::string png = encode_png(picture, alpha, srgb);
  const std::size_t size = png.size();
  png.resize((size + 3) / 4 * 4, 0);  // numbers behind it stay aligned
  const std::size_t view = add_view(png.data(), png.size());
  gltf_["bufferViews"][view]["byteLength"] = size;
  const std::size_t image =
      push(gltf_["images"], {{"mimeType", "image/png"}, {"bufferView", view}});
  return push(gltf_["textures"], {{"source", image}, {"sampler", 0}});
}

std::size_t AnimatedWriter::add_mesh(const Scene& body, std::size_t material) {
  std::vector<std::uint32_t> index;
  for (const Triangle& t : body.triangle) {
    index.insert(index.end(), t.vertex.begin(), t.vertex.end());
  }
  mesh_triangles_.push_back(body.triangle.size());
  json attributes;
  attributes["POSITION"] = add_floats(flat(body.position), 3, true);
  attributes["NORMAL"] = add_floats(flat(body.normal), 3, false);
  const std::size_t indices = add_index(index);
  return push(gltf_["meshes"], {{"primitives", json::array({{{"attributes", attributes},
                                                             {"indices", indices},
                                                             {"material", material}}})}});
}

std::size_t AnimatedWriter::add_body(const Scene& body, std::span<const Scene> morphs) {
  // Textures take their number in the file.
  GltfTextures wanted;
  std::vector<std::size_t> number;
  const auto renumber = [&](json& holder, const char* key) {
    if (!holder.contains(key)) return;
    const auto local = holder[key]["index"].get<std::size_t>();
    for (std::size_t i = number.size(); i < wanted.wanted().size(); ++i) {
      const auto& [texture, srgb] = wanted.wanted()[i];
      const auto t = static_cast<std::size_t>(texture);
      number.push_back(add_texture(
          body.texture[t], t < body.alpha.size() ? body.alpha[t] : std::vector<float>(), srgb));
    }
    holder[key]["index"] = number[local];
  };
  json primitives = json::array();
  for (std::uint32_t m = 0; m < body.material.size(); ++m) {
    // The vertices that this material uses, in a row.
    constexpr std::uint32_t kUnused = 0xffffffffu;
    std::vector<std::uint32_t> index, vertex, place(body.position.size(), kUnused);
    for (const Triangle& t : body.triangle) {
      if (t.material != m) continue;
      for (const std::uint32_t v : t.vertex) {
        if (place[v] == kUnused) {
          place[v] = static_cast<std::uint32_t>(vertex.size());
          vertex.push_back(v);
        }
        index.push_back(place[v]);
      }
    }
    if (index.empty()) continue;
    json material = gltf_material(body.material[m], true, wanted, extensions_);
    renumber(material["pbrMetallicRoughness"], "baseColorTexture");
    renumber(material["pbrMetallicRoughness"], "metallicRoughnessTexture");
    renumber(material, "normalTexture");
    const auto add_vectors = [&](const std::vector<Vec3>& all, const std::vector<Vec3>* from,
                                 bool bounds) {
      std::vector<Vec3> some;
      for (const std::uint32_t v : vertex) some.push_back(from ? all[v] - (*from)[v] : all[v]);
      return add_floats(flat(some), 3, bounds);
    };
    json primitive;
    primitive["attributes"]["POSITION"] = add_vectors(body.position, nullptr, true);
    primitive["attributes"]["NORMAL"] = add_vectors(body.normal, nullptr, false);
    if (body.material[m].texture >= 0) {
      std::vector<float> uv;
      for (const std::uint32_t v : vertex) {
        uv.push_back(body.uv[v][0]), uv.push_back(1 - body.uv[v][1]);  // v runs down
      }
      primitive["attributes"]["TEXCOORD_0"] = add_floats(uv, 2, false);
    }
    for (const Scene& morph : morphs) {
      json target;
      target["POSITION"] = add_vectors(morph.position, &body.position, true);
      target["NORMAL"] = add_vectors(morph.normal, &body.normal, false);
      primitive["targets"].push_back(target);
    }
    primitive["indices"] = add_index(index);
    primitive["material"] = push(gltf_["materials"], std::move(material));
    primitives.push_back(std::move(primitive));
  }
  mesh_triangles_.push_back(body.triangle.size());
  json mesh{{"primitives", primitives}};
  if (!morphs.empty()) mesh["weights"] = std::vector<double>(morphs.size(), 0.0);
  return push(gltf_["meshes"], std::move(mesh));
}

std::size_t AnimatedWriter::add_node(json node) {
  if (node.contains("mesh")) triangles_ += mesh_triangles_.at(node["mesh"].get<std::size_t>());
  return push(gltf_["nodes"], std::move(node));
}

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
  const std::size_t width = path == "weights" ? 1 : path == "rotation" ? 4 : 3;
  const std::size_t input = add_floats(seconds, 1, true);
  const std::size_t output = add_floats(values, width, false);
  const std::size_t sampler =
      push(samplers_, {{"input", input}, {"output", output}, {"interpolation", interpolation}});
  channels_.push_back({{"sampler", sampler}, {"target", {{"node", node}, {"path", path}}}});
}

void AnimatedWriter::animate(std::size_t node, const std::string& path, double seconds, int pieces,
                             const std::function<std::vector<double>(double second)>& value) {
  std::vector<float> times, values;
  for (int k = 0; k <= pieces; ++k) {
    const double t = seconds * k / pieces;
    times.push_back(static_cast<float>(t));
    for (const double x : value(t)) values.push_back(static_cast<float>(x));
  }
  animate(node, path, times, values);
}

void AnimatedWriter::save(const std::filesystem::path& file) const {
  if (file.extension() != ".glb") {
    throw Error(ErrorKind::invalid_argument, fmt::format("{}: suffix is \"{}\", expected .glb",
                                                         file.string(), file.extension().string()));
  }
  json gltf = gltf_;
  gltf["asset"] = {{"version", "2.0"}, {"generator", "haarlight-data"}};
  std::vector<bool> child(gltf["nodes"].size(), false);
  for (const json& node : gltf["nodes"]) {
    for (const json& c : node.value("children", json::array()))
      child.at(c.get<std::size_t>()) = true;
  }
  json roots = json::array();
  for (std::size_t n = 0; n < child.size(); ++n) {
    if (!child[n]) roots.push_back(n);
  }
  gltf["scenes"] = json::array({{{"nodes", roots}}});
  gltf["scene"] = 0;
  gltf["buffers"] = json::array({{{"byteLength", bytes_.size()}}});
  json used = json::array({"KHR_materials_emissive_strength"});
  if (gltf.contains("extensions")) used.push_back("KHR_lights_punctual");
  for (const std::string& extension : extensions_) used.push_back(extension);
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
