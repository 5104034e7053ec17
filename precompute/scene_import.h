// Scenes from files: glTF, GLB, OBJ and PLY. The only place that touches assimp.

#pragma once

#include <filesystem>

#include "precompute/scene.h"

namespace haarlight {

/// Reads a scene, all meshes placed by their nodes' transforms, cleaned as by clean_scene() with
/// the counts in scene.report. Faces of more than three corners are cut into triangles.
///
/// Materials; every factor is clamped to its bounds, NaN becomes the default:
/// - glTF: metallic_roughness with base colour, metallic-roughness and normal textures (texture
///   coordinates 0, without KHR_texture_transform), KHR_materials_ior and _transmission. With a
///   _volume of some thickness and transmission from one half it is glass; roughness of what passes
///   is left out and counted. Alpha masks are holes; blended alpha from a texture makes holes below
///   one half, an even one a thin wall that lets 1 - alpha through; both are counted.
/// - OBJ: phong with albedo Kd, texture map_Kd, specular Ks, exponent Ns, all taken as linear, and
///   scaled down together, with a count, where they reflect more than all; metallic_roughness
///   where there is Pm or Pr. illum 3 and 5: mirror of Ks, or of Kd where Ks is black. illum 4, 6,
///   7 and 9: glass with Ni (1.5 if missing or 1). Its albedo, the tint at each surface, is the
///   square root of Tf, so that a closed body, passed by way of two surfaces, lets Tf through;
///   white where Tf is missing or black. Other surfaces are holes where d, times map_d, is below
///   one half, with a count. `norm` is a normal texture.
/// - Vertex colours tint the albedo; 8-bit PLY colours are sRGB, glTF ones are linear.
/// - No material in the file: grey, albedo 0.5.
/// A texture that cannot be read is counted in the report and left out.
///
/// The first perspective camera of the file becomes scene.camera (512x512 pixels; its vertical
/// field of view is the file's). Throws Error{missing} if there is no such file or no triangle in
/// it, Error{format} with the reason if it cannot be read.
Scene import_scene(const std::filesystem::path& file);

}  // namespace haarlight
