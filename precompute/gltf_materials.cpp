// The numbers of glTF materials, from the JSON.

#include "precompute/gltf_materials.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

namespace haarlight {
namespace {

using nlohmann::json;

// A number, or `fallback` for what is none; writers turn a NaN into null.
double number(const json& value, double fallback) {
  if (!value.is_number()) return fallback;
  const double n = value.get<double>();
  return std::isfinite(n) ? n : fallback;
}
double number(const json& object, const char* key, double fallback) {
  return object.contains(key) ? number(object.at(key), fallback) : fallback;
}
float unit(double n) { return static_cast<float>(std::clamp(n, 0.0, 1.0)); }
float unit(const json& object, const char* key, double fallback) {
  return unit(number(object, key, fallback));
}

Rgb unit_rgb(const json& object, const char* key) {
  if (!object.contains(key)) return {1, 1, 1};
  const json& c = object.at(key);
  return {unit(number(c.at(0), 1)), unit(number(c.at(1), 1)), unit(number(c.at(2), 1))};
}

// How texture `key` of `object` lies. Both of glTF's axes start at the top left, so that with v' =
// 1 - v the rows
//   u_t = sx cos u + sy sin v' + tx,   v'_t = -sx sin u + sy cos v' + ty
// of KHR_texture_transform become those below. Of coordinates beyond the second, the first are
// used.
TextureMap read_map(const json& object, const char* key) {
  TextureMap map;
  if (!object.contains(key)) return map;
  const json& texture = object.at(key);
  double set = number(texture, "texCoord", 0);
  if (texture.contains("extensions") &&
      texture.at("extensions").contains("KHR_texture_transform")) {
    const json& t = texture.at("extensions").at("KHR_texture_transform");
    set = number(t, "texCoord", set);
    const auto pair = [&](const char* name, std::size_t i, double fallback) {
      return t.contains(name) ? number(t.at(name).at(i), fallback) : fallback;
    };
    const double angle = number(t, "rotation", 0), c = std::cos(angle), s = std::sin(angle);
    const double sx = pair("scale", 0, 1), sy = pair("scale", 1, 1);
    const double rows[6] = {sx * c, -sy * s, sy * s + pair("offset", 0, 0),
                            sx * s, sy * c,  1 - sy * c - pair("offset", 1, 0)};
    std::transform(rows, rows + 6, map.matrix.begin(),
                   [](double x) { return static_cast<float>(x); });
  }
  map.second = set == 1;
  return map;
}

void read_surface(const json& pbr, GltfMaterial& out) {
  out.base = unit_rgb(pbr, "baseColorFactor");
  if (pbr.contains("baseColorFactor") && pbr.at("baseColorFactor").size() > 3) {
    out.alpha = unit(number(pbr.at("baseColorFactor").at(3), 1));
  }
  out.base_map = read_map(pbr, "baseColorTexture");
  out.metallic_roughness_map = read_map(pbr, "metallicRoughnessTexture");
  out.metallic = unit(pbr, "metallicFactor", 1);
  out.roughness = unit(pbr, "roughnessFactor", 1);
}

void read_volume(const json& volume, GltfMaterial& out) {
  out.has_inside = number(volume, "thicknessFactor", 0) > 0;
  const double distance = number(volume, "attenuationDistance", 0);
  if (!(distance > 0)) return;  // none: light goes on for ever
  // White has become `color` after `distance`. Black would take forever, too: 1e-6 is black enough.
  const Rgb color = unit_rgb(volume, "attenuationColor");
  const auto extinction = [distance](float c) {
    const double e = -std::log(std::max(static_cast<double>(c), 1e-6)) / distance;
    return static_cast<float>(std::min(e, 1e30));
  };
  out.extinction = {extinction(color.r), extinction(color.g), extinction(color.b)};
}

void read_own(const json& own, GltfMaterial& out) {
  if (!own.is_object()) return;
  if (own.contains("phong") && own.at("phong").is_object()) {
    const json& phong = own.at("phong");
    const auto color = [&](const char* key) {
      return phong.contains(key) ? unit_rgb(phong, key) : Rgb{};
    };
    out.phong = true;
    out.diffuse = color("diffuse");
    out.specular = color("specular");
    out.exponent = static_cast<float>(std::clamp(number(phong, "exponent", 32), 0.0, 1e4));
  }
  if (own.contains("measured") && own.at("measured").is_string()) {
    out.measured = own.at("measured").get<std::string>();
  }
}

GltfMaterial read_material(const json& material) {
  GltfMaterial out;
  if (material.contains("extras") && material.at("extras").is_object() &&
      material.at("extras").contains("haarlight")) {
    read_own(material.at("extras").at("haarlight"), out);
  }
  if (material.contains("pbrMetallicRoughness")) {
    read_surface(material.at("pbrMetallicRoughness"), out);
  }
  out.normal_map = read_map(material, "normalTexture");
  if (material.contains("normalTexture")) {
    out.normal_scale = static_cast<float>(number(material.at("normalTexture"), "scale", 1));
  }
  const std::string mode = material.value("alphaMode", std::string("OPAQUE"));
  if (mode == "MASK") out.alpha_mode = GltfMaterial::Alpha::mask;
  if (mode == "BLEND") out.alpha_mode = GltfMaterial::Alpha::blend;
  out.alpha_cutoff = static_cast<float>(std::max(number(material, "alphaCutoff", 0.5), 0.0));
  if (!material.contains("extensions")) return out;
  const json& extensions = material.at("extensions");
  if (extensions.contains("KHR_materials_ior")) {
    // 0 is the specification's way of saying "all reflects": beyond any real glass.
    const double ior = number(extensions.at("KHR_materials_ior"), "ior", 1.5);
    out.ior = static_cast<float>(ior == 0 ? 100.0 : std::clamp(ior, 1.0, 100.0));
  }
  if (extensions.contains("KHR_materials_transmission")) {
    out.transmission = unit(extensions.at("KHR_materials_transmission"), "transmissionFactor", 0);
  }
  if (extensions.contains("KHR_materials_volume")) {
    read_volume(extensions.at("KHR_materials_volume"), out);
  }
  return out;
}

}  // namespace

std::vector<GltfMaterial> gltf_materials(const json& file) {
  std::vector<GltfMaterial> materials;
  if (!file.contains("materials")) return materials;
  for (const json& material : file.at("materials")) materials.push_back(read_material(material));
  return materials;
}

}  // namespace haarlight
