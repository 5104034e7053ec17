// The numbers of glTF materials, from the JSON. Pictures are the scene reader's.

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/rgb.h"
#include "precompute/scene.h"

namespace haarlight {

/// One material as glTF 2.0, section 3.9, has it, with KHR_materials_ior, _transmission and
/// _volume, and KHR_texture_transform. Everything is within its bounds: what is missing, no number
/// or not finite has its default.
struct GltfMaterial {
  Rgb base{1, 1, 1};
  float alpha = 1;  ///< of the base colour
  float metallic = 1, roughness = 1;
  float normal_scale = 1;
  TextureMap base_map, metallic_roughness_map, normal_map;  ///< see precompute/scene.h: v runs up
  enum class Alpha { opaque, mask, blend };
  Alpha alpha_mode = Alpha::opaque;
  float alpha_cutoff = 0.5f;
  float ior = 1.5f;
  float transmission = 0;
  bool has_inside = false;  ///< a volume of some thickness
  Rgb extinction{};         ///< 1/m, of the volume
  /// The project's own, in "extras": {"haarlight": {"phong": {"diffuse": [r, g, b], "specular":
  /// [r, g, b], "exponent": e}}} or {"haarlight": {"measured": "FILE.binary"}}, a table in MERL's
  /// form, named from the file's folder. Other programs see the rest of the material.
  bool phong = false;
  Rgb diffuse{}, specular{};
  float exponent = 32;
  std::string measured;
};

/// The file's materials in order. Throws nlohmann::json exceptions where the file's structure is
/// not glTF's.
std::vector<GltfMaterial> gltf_materials(const nlohmann::json& file);

}  // namespace haarlight
