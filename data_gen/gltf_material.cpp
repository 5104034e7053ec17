// What glTF 2.0 says of a material.

#include "data_gen/gltf_material.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

namespace haarlight::data_gen {
namespace {

using nlohmann::json;

json numbers(const Rgb& c, double alpha) { return json::array({c.r, c.g, c.b, alpha}); }

// KHR_materials_volume states extinction as the colour that white has after some way.
json volume(const Rgb& extinction) {
  json out{{"thicknessFactor", 1.0}};
  const float largest = std::max({extinction.r, extinction.g, extinction.b});
  if (largest > 0) {
    const double way = 1 / static_cast<double>(largest);
    const auto after = [way](float e) { return std::exp(-static_cast<double>(e) * way); };
    out["attenuationDistance"] = way;
    out["attenuationColor"] =
        json::array({after(extinction.r), after(extinction.g), after(extinction.b)});
  }
  return out;
}

}  // namespace

std::size_t GltfTextures::index(int texture, bool srgb) {
  const std::pair<int, bool> key{texture, srgb};
  const auto at = std::find(wanted_.begin(), wanted_.end(), key);
  const auto number = static_cast<std::size_t>(at - wanted_.begin());
  if (at == wanted_.end()) wanted_.push_back(key);
  return number;
}

bool wants_phong(const Scene& scene) {
  return std::any_of(scene.material.begin(), scene.material.end(), [](const Material& m) {
    return m.model == SurfaceModel::phong && luminance(m.specular) >= 0.1f;
  });
}

json gltf_material(const Material& material, bool phong, GltfTextures& textures,
                   std::vector<std::string>& extensions) {
  Rgb base = material.albedo;
  double metallic = static_cast<double>(material.metallic);
  double roughness = static_cast<double>(material.roughness);
  double transmission = 0;
  switch (material.model) {
    case SurfaceModel::phong: {
      const bool lobe = luminance(material.specular) > 0;
      const bool metal = lobe && luminance(material.specular) > luminance(material.albedo);
      if (metal) base = material.specular;
      metallic = metal ? 1 : 0;
      roughness = lobe ? std::pow(2.0 / (static_cast<double>(material.exponent) + 2.0), 0.25) : 1.0;
      break;
    }
    case SurfaceModel::measured:  // the file that it is in is not the scene's
      roughness = 1;
      break;
    case SurfaceModel::metallic_roughness:
      transmission = static_cast<double>(material.transmission);
      break;
    case SurfaceModel::mirror:
      metallic = 1, roughness = 0;
      break;
    case SurfaceModel::glass:
      metallic = 0, roughness = 0, transmission = 1;
      break;
  }

  json pbr{{"baseColorFactor", numbers(base, 1)},
           {"metallicFactor", metallic},
           {"roughnessFactor", roughness}};
  if (material.texture >= 0) {
    pbr["baseColorTexture"] = {{"index", textures.index(material.texture, true)}};
  }
  if (material.metallic_roughness_texture >= 0) {
    pbr["metallicRoughnessTexture"] = {
        {"index", textures.index(material.metallic_roughness_texture, false)}};
  }
  json out{{"name", material.name}, {"pbrMetallicRoughness", pbr}};
  if (phong && material.model == SurfaceModel::phong) {
    const auto color = [](const Rgb& c) { return json::array({c.r, c.g, c.b}); };
    out["extras"]["haarlight"]["phong"] = {{"diffuse", color(material.albedo)},
                                           {"specular", color(material.specular)},
                                           {"exponent", material.exponent}};
  }
  if (material.normal_texture >= 0) {
    out["normalTexture"] = {{"index", textures.index(material.normal_texture, false)},
                            {"scale", material.normal_scale}};
  }
  if (material.alpha_cutoff > 0) {
    out["alphaMode"] = "MASK";
    out["alphaCutoff"] = material.alpha_cutoff;
  }
  const bool has_inside = material.model == SurfaceModel::glass && !material.thin;
  if (!has_inside) out["doubleSided"] = true;

  const auto extend = [&](const std::string& name, const json& value) {
    out["extensions"][name] = value;
    if (std::find(extensions.begin(), extensions.end(), name) == extensions.end()) {
      extensions.push_back(name);
    }
  };
  if (transmission > 0) {
    extend("KHR_materials_transmission", {{"transmissionFactor", transmission}});
  }
  const bool refracts =
      material.model == SurfaceModel::glass || material.model == SurfaceModel::metallic_roughness;
  if (refracts && material.ior != 1.5f) extend("KHR_materials_ior", {{"ior", material.ior}});
  if (has_inside) extend("KHR_materials_volume", volume(material.extinction));
  return out;
}

}  // namespace haarlight::data_gen
