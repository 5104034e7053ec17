// What glTF files say and the scene reader gets wrong or leaves out: the camera and the numbers of
// materials.

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "precompute/gltf_materials.h"

namespace haarlight {

struct GltfExtras {
  std::optional<Camera> camera;  ///< the first perspective camera that a node of the scene carries
  std::int64_t triangles = 0;  ///< that the meshes in the scene promise, each mesh once; the reader
                               ///< leaves those out that name vertices that are not there
  /// The same file without animations and skins, over some of which the reader falls (keys of an
  /// animation that has none, joints of a skin that are not there); empty where it has neither.
  std::string still;
  std::vector<GltfMaterial> material;  ///< of the file; the reader adds a default one behind them
};

/// Reads the JSON of a .gltf or .glb file directly: assimp 5.2 moves cameras twice and stretches
/// the field of view in a way that changed between its versions. glTF 2.0 specification, sections
/// 3.5.3 (node transforms), 3.9 (materials), 3.10 (cameras) and 4.4 (the GLB container). Throws
/// Error{format} if the file is not glTF, if its nodes are no tree (or are nested deeper than
/// 512, or reached in more than a million ways), Error{io} if it cannot be read.
GltfExtras read_gltf_extras(const std::filesystem::path& file);

}  // namespace haarlight
