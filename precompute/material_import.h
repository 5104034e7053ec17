// Materials of scene files into those of the scene; see precompute/scene_import.h for the rules.

#pragma once

#include <filesystem>

#include "precompute/gltf_materials.h"
#include "precompute/scene.h"
#include "precompute/texture_import.h"

struct aiMaterial;

namespace haarlight {

/// A glTF material: numbers from the file's JSON, textures as the scene reader names them.
Material import_gltf_material(const GltfMaterial& numbers, const aiMaterial& in,
                              TextureImport& textures, const Scene& scene, SceneReport& report);

/// Makes a measured material of it: the table in `file`, white. Throws as read_merl() does.
void set_measured(Material& material, const std::filesystem::path& file);

/// An OBJ or PLY material.
Material import_obj_material(const aiMaterial& in, TextureImport& textures, const Scene& scene,
                             SceneReport& report);

}  // namespace haarlight
