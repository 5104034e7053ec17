// Materials of scene files into those of the scene; see precompute/scene_import.h for the rules.

#pragma once

#include "precompute/gltf_materials.h"
#include "precompute/scene.h"
#include "precompute/texture_import.h"

struct aiMaterial;

namespace haarlight {

/// A glTF material: numbers from the file's JSON, textures as the scene reader names them.
Material import_gltf_material(const GltfMaterial& numbers, const aiMaterial& in,
                              TextureImport& textures, SceneReport& report);

/// An OBJ or PLY material.
Material import_obj_material(const aiMaterial& in, TextureImport& textures, const Scene& scene,
                             SceneReport& report);

}  // namespace haarlight
