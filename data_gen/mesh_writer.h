// Writes a scene as a file that any modelling program opens: glTF or OBJ.

#pragma once

#include <filesystem>

#include "precompute/scene.h"

namespace haarlight::data_gen {

/// Writes by suffix: .glb (binary glTF 2.0, with the camera) or .obj (with its .mtl beside it under
/// the same stem; OBJ has no cameras). Positions and normals become 32-bit floats, and only
/// vertices that a triangle uses are written, material by material.
///
/// Metallic-roughness materials, mirrors (metallic, roughness 0) and glass
/// (KHR_materials_transmission, _ior and, unless thin, _volume with the extinction) are whole in
/// glTF, with textures as 8-bit PNG in the file and alpha_cutoff as a mask. OBJ has Pm and Pr,
/// illum 3 with Ks, illum 7 with Ni and Tf; no textures, no holes, no extinction.
///
/// A Phong lobe is stated as each format can: Ks and Ns in OBJ; in glTF roughness
/// (2 / (e + 2))^(1/4), with metallic 1 where the specular colour outweighs the albedo. A material
/// without a lobe has metallic 0 and roughness 1.
///
/// Atomic: files appear complete or not at all. Throws Error{invalid_argument} for another suffix
/// or a scene without triangles, Error{io} if the system refuses.
void save_scene(const std::filesystem::path& file, const Scene& scene);

}  // namespace haarlight::data_gen
