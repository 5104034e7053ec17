// Scenes from files: glTF, GLB, OBJ and PLY. The only place that touches assimp.

#pragma once

#include <filesystem>

#include "precompute/scene.h"

namespace haarlight {

/// Reads a scene, all meshes placed by their nodes' transforms, cleaned as by clean_scene() with
/// the counts in scene.report. Faces of more than three corners are cut into triangles.
///
/// Materials, as Lambert plus one Phong lobe (precompute/scene.h), everything clamped to [0, 1]:
/// - OBJ: albedo Kd, texture map_Kd, specular Ks, exponent Ns; all taken as linear.
/// - glTF metallic-roughness: base colour b (linear factor times texture), metallic m, roughness r,
///   reflectance at normal incidence F0 = 0.04 (1 - m) + m b. With a = r^2, GGX is close to
///   Blinn-Phong of exponent 2 / a^2 - 2, and a Blinn-Phong lobe is about four times as wide in
///   terms of the mirror direction: Phong e = (2 / a^2 - 2) / 4, at most 10,000. Then albedo =
///   (1 - m) b, specular = F0. Lobes with e < 4 (r above 0.58) are too wide to tell from Lambert
///   at the price of a lobe: their F0 goes into the albedo. On textured metals the texture colours
///   both parts' albedo only; metallic-roughness textures, alpha and transmission are left out.
/// - Vertex colours tint the albedo; 8-bit PLY colours are sRGB, glTF ones are linear.
/// - No material in the file: grey, albedo 0.5.
/// A texture that cannot be read is counted in the report and left out.
///
/// The first perspective camera of the file becomes scene.camera (512x512 pixels; its vertical
/// field of view is the file's). Throws Error{missing} if there is no such file or no triangle in
/// it, Error{format} with the reason if it cannot be read.
Scene import_scene(const std::filesystem::path& file);

}  // namespace haarlight
