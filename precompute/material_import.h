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

/// Makes material `m` of the scene a measured one: the table in `file`, which has its colour; what
/// a base texture has of that is left out and counted. The normal texture stays, and so do holes:
/// what cuts them becomes a white texture with the old one's alpha. Throws as read_merl() does.
void set_measured(Scene& scene, std::size_t m, const std::filesystem::path& file);

/// An OBJ or PLY material.
Material import_obj_material(const aiMaterial& in, TextureImport& textures, const Scene& scene,
                             SceneReport& report);

}  // namespace haarlight
