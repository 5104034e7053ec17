// Writes a scene as glTF or OBJ.

#include "data_gen/mesh_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "data_gen/gltf_material.h"
#include "data_gen/png.h"

namespace haarlight::data_gen {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF buffers are little-endian");

// The triangles of one material with vertices of their own.
struct Part {
  std::uint32_t material = 0;
  std::vector<std::uint32_t> vertex;  // into the scene
  std::vector<std::uint32_t> index;   // into vertex
};

std::vector<Part> split_by_material(const Scene& scene) {
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<Part> parts;
  for (std::uint32_t m = 0; m < scene.material.size(); ++m) {
    Part part;
    part.material = m;
    std::vector<std::uint32_t> local(scene.position.size(), kNone);
    for (const Triangle& triangle : scene.triangle) {
      if (triangle.material != m) continue;
      for (const std::uint32_t v : triangle.vertex) {
        if (local[v] == kNone) {
          local[v] = static_cast<std::uint32_t>(part.vertex.size());
          part.vertex.push_back(v);
        }
        part.index.push_back(local[v]);
      }
    }
    if (!part.index.empty()) parts.push_back(std::move(part));
  }
  return parts;
}

std::array<float, 3> floats(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

// glTF wants a node matrix column by column.
std::vector<double> gltf_matrix(const Camera& camera) {
  const Rotation columns = camera.orientation.transposed();
  std::vector<double> m;
  for (const Vec3& column : columns.row) m.insert(m.end(), {column.x, column.y, column.z, 0.0});
  m.insert(m.end(), {camera.position.x, camera.position.y, camera.position.z, 1.0});
  return m;
}

class GltfBuffer {
 public:
  // Appends raw values as a view of their own; returns its number. `target` is GL's: 34962 for
  // vertices, 34963 for indices.
  template <typename T>
  std::size_t add(const std::vector<T>& values, int target, nlohmann::json& views) {
    const std::size_t bytes = values.size() * sizeof(T);
    views.push_back(
        {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes}, {"target", target}});
    const std::size_t begin = bytes_.size();
    bytes_.resize(begin + bytes);
    std::memcpy(bytes_.data() + begin, values.data(), bytes);
    return views.size() - 1;
  }
  // A file inside the file; what comes after stays on a multiple of four bytes.
  std::size_t add_file(const std::string& content, nlohmann::json& views) {
    views.push_back({{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", content.size()}});
    bytes_.insert(bytes_.end(), content.begin(), content.end());
    bytes_.resize((bytes_.size() + 3) / 4 * 4, 0);
    return views.size() - 1;
  }
  std::vector<char>& bytes() { return bytes_; }

 private:
  std::vector<char> bytes_;
};

constexpr int kFloat = 5126, kUnsignedInt = 5125, kVertices = 34962, kIndices = 34963;

bool has_texture(const Material& m) {
  return m.texture >= 0 || m.metallic_roughness_texture >= 0 || m.normal_texture >= 0;
}

void write_glb(const std::filesystem::path& file, const Scene& scene) {
  using nlohmann::json;
  json gltf;
  gltf["asset"] = {{"version", "2.0"}, {"generator", "haarlight-data"}};
  json materials = json::array(), primitives = json::array(), views = json::array(),
       accessors = json::array();
  GltfTextures textures;
  std::vector<std::string> extensions;
  const bool phong = wants_phong(scene);
  for (const Material& material : scene.material) {
    materials.push_back(gltf_material(material, phong, textures, extensions));
  }

  GltfBuffer buffer;
  const auto add_vectors = [&](const Part& part, const std::vector<Vec3>& all, bool bounds) {
    std::vector<std::array<float, 3>> values;
    values.reserve(part.vertex.size());
    for (const std::uint32_t v : part.vertex) values.push_back(floats(all[v]));
    json accessor{{"componentType", kFloat}, {"count", values.size()}, {"type", "VEC3"}};
    if (bounds) {
      std::array<float, 3> low = values[0], high = values[0];
      for (const auto& value : values) {
        for (std::size_t k = 0; k < 3; ++k) {
          low[k] = std::min(low[k], value[k]);
          high[k] = std::max(high[k], value[k]);
        }
      }
      accessor["min"] = low;
      accessor["max"] = high;
    }
    accessor["bufferView"] = buffer.add(values, kVertices, views);
    accessors.push_back(accessor);
    return accessors.size() - 1;
  };
  for (const Part& part : split_by_material(scene)) {
    const std::size_t position = add_vectors(part, scene.position, true);
    const std::size_t normal = add_vectors(part, scene.normal, false);
    json attributes{{"POSITION", position}, {"NORMAL", normal}};
    if (has_texture(scene.material[part.material])) {
      std::vector<std::array<float, 2>> values;
      for (const std::uint32_t v : part.vertex) {
        values.push_back({scene.uv[v][0], 1 - scene.uv[v][1]});  // v runs down
      }
      accessors.push_back({{"componentType", kFloat},
                           {"count", values.size()},
                           {"type", "VEC2"},
                           {"bufferView", buffer.add(values, kVertices, views)}});
      attributes["TEXCOORD_0"] = accessors.size() - 1;
    }
    accessors.push_back({{"componentType", kUnsignedInt},
                         {"count", part.index.size()},
                         {"type", "SCALAR"},
                         {"bufferView", buffer.add(part.index, kIndices, views)}});
    primitives.push_back({{"attributes", attributes},
                          {"indices", accessors.size() - 1},
                          {"material", part.material}});
  }

  json nodes = json::array({{{"name", "scene"}, {"mesh", 0}}});
  if (scene.camera) {
    const Camera& camera = *scene.camera;
    gltf["cameras"] =
        json::array({{{"name", "camera"},
                      {"type", "perspective"},
                      {"perspective",
                       {{"aspectRatio", static_cast<double>(camera.width) / camera.height},
                        {"yfov", camera.vertical_fov},
                        {"znear", 0.01},
                        {"zfar", 1000.0}}}}});
    nodes.push_back({{"name", "camera"}, {"camera", 0}, {"matrix", gltf_matrix(camera)}});
  }
  json roots = json::array();
  for (std::size_t i = 0; i < nodes.size(); ++i) roots.push_back(i);
  gltf["scene"] = 0;
  gltf["scenes"] = json::array({{{"nodes", roots}}});
  gltf["nodes"] = nodes;
  gltf["meshes"] = json::array({{{"primitives", primitives}}});
  gltf["materials"] = materials;
  if (!textures.wanted().empty()) {
    json images = json::array(), list = json::array();
    for (const auto& [texture, srgb] : textures.wanted()) {
      const auto t = static_cast<std::size_t>(texture);
      const std::string png = encode_png(
          scene.texture[t], t < scene.alpha.size() ? scene.alpha[t] : std::vector<float>(), srgb);
      list.push_back({{"source", images.size()}, {"sampler", 0}});
      images.push_back({{"mimeType", "image/png"}, {"bufferView", buffer.add_file(png, views)}});
    }
    gltf["images"] = images;
    gltf["textures"] = list;
    constexpr int kLinear = 9729, kRepeat = 10497;
    gltf["samplers"] = json::array(
        {{{"magFilter", kLinear}, {"minFilter", kLinear}, {"wrapS", kRepeat}, {"wrapT", kRepeat}}});
  }
  if (!extensions.empty()) gltf["extensionsUsed"] = extensions;
  gltf["accessors"] = accessors;
  gltf["bufferViews"] = views;
  gltf["buffers"] = json::array({{{"byteLength", buffer.bytes().size()}}});

  // A header, then the two chunks, each padded to four bytes: JSON with spaces, binary with zeros.
  std::string text = gltf.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::vector<char>& binary = buffer.bytes();
  binary.resize((binary.size() + 3) / 4 * 4, 0);
  const std::uint64_t total = 12 + 8 + text.size() + 8 + binary.size();
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(
        ErrorKind::invalid_argument,
        fmt::format("{}: scene takes {} bytes, a .glb holds at most 4 GiB", file.string(), total));
  }
  const auto u32 = [](std::uint64_t value) { return static_cast<std::uint32_t>(value); };
  const std::array<std::uint32_t, 5> head{0x46546c67u, 2u, u32(total), u32(text.size()),
                                          0x4e4f534au};
  const std::array<std::uint32_t, 2> binary_head{u32(binary.size()), 0x004e4942u};
  AtomicFile out(file);
  out.write(head.data(), sizeof head);
  out.write(text.data(), text.size());
  out.write(binary_head.data(), sizeof binary_head);
  out.write(binary.data(), binary.size());
  out.commit();
}

// Names in MTL end at white space.
std::string obj_name(const Material& material, std::size_t index) {
  std::string name = material.name.empty() ? fmt::format("material_{}", index) : material.name;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

// illum: 1 matt, 2 with a lobe, 3 mirror, 7 glass; Pm and Pr as common extensions have them.
std::string obj_material(const Material& m, const std::string& name) {
  const auto color = [](const char* key, const Rgb& c) {
    return fmt::format("{} {} {} {}\n", key, c.r, c.g, c.b);
  };
  std::string mtl = fmt::format("newmtl {}\n", name);
  switch (m.model) {
    case SurfaceModel::phong: {
      const bool lobe = luminance(m.specular) > 0;
      mtl += color("Kd", m.albedo) + color("Ks", m.specular);
      if (lobe) mtl += fmt::format("Ns {}\n", m.exponent);
      return mtl + (lobe ? "illum 2\n\n" : "illum 1\n\n");
    }
    case SurfaceModel::measured:
      return mtl + color("Kd", m.albedo) + "illum 1\n\n";
    case SurfaceModel::metallic_roughness:
      return mtl + color("Kd", m.albedo) +
             fmt::format("Pm {}\nPr {}\nNi {}\nillum 2\n\n", m.metallic, m.roughness, m.ior);
    case SurfaceModel::mirror:
      return mtl + color("Kd", {}) + color("Ks", m.albedo) + "illum 3\n\n";
    case SurfaceModel::glass:
      return mtl + color("Kd", {}) + color("Tf", m.albedo) +
             fmt::format("Ni {}\nillum 7\n\n", m.ior);
  }
  return mtl;
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  AtomicFile out(file);
  out.write(text.data(), text.size());
  out.commit();
}

void write_obj(const std::filesystem::path& file, const Scene& scene) {
  std::filesystem::path library = file;
  library.replace_extension(".mtl");

  std::string mtl = "# haarlight-data\n";
  for (std::size_t i = 0; i < scene.material.size(); ++i) {
    mtl += obj_material(scene.material[i], obj_name(scene.material[i], i));
  }

  std::string obj = fmt::format("# haarlight-data\nmtllib {}\n", library.filename().string());
  std::size_t written = 0;
  for (const Part& part : split_by_material(scene)) {
    for (const std::uint32_t v : part.vertex) {
      const auto p = floats(scene.position[v]);
      obj += fmt::format("v {} {} {}\n", p[0], p[1], p[2]);
    }
    for (const std::uint32_t v : part.vertex) {
      const auto n = floats(scene.normal[v]);
      obj += fmt::format("vn {} {} {}\n", n[0], n[1], n[2]);
    }
    obj += fmt::format("usemtl {}\n", obj_name(scene.material[part.material], part.material));
    for (std::size_t i = 0; i < part.index.size(); i += 3) {
      obj += "f";
      for (std::size_t k = 0; k < 3; ++k) {
        obj += fmt::format(" {0}//{0}", written + part.index[i + k] + 1);
      }
      obj += "\n";
    }
    written += part.vertex.size();
  }
  // The library first: a mesh that is there always finds its materials.
  write_text(library, mtl);
  write_text(file, obj);
}

}  // namespace

void save_scene(const std::filesystem::path& file, const Scene& scene) {
  if (scene.triangle.empty()) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{}: scene has no triangles, wanted at least one", file.string()));
  }
  const std::string suffix = file.extension().string();
  if (suffix == ".glb") {
    write_glb(file, scene);
  } else if (suffix == ".obj") {
    write_obj(file, scene);
  } else {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("{}: suffix is \"{}\", wanted .glb or .obj", file.string(), suffix));
  }
}

}  // namespace haarlight::data_gen
