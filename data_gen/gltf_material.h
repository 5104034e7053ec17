// What glTF 2.0 says of a material, and which textures it wants beside it.

#pragma once

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "precompute/scene.h"

namespace haarlight::data_gen {

/// The textures of a file: which picture of the scene, and whether its bytes are sRGB (colours) or
/// linear (everything else).
class GltfTextures {
 public:
  /// The number of a texture in the file.
  std::size_t index(int texture, bool srgb);
  const std::vector<std::pair<int, bool>>& wanted() const { return wanted_; }

 private:
  std::vector<std::pair<int, bool>> wanted_;
};

/// The JSON object of a material. The names of the extensions that it uses are added to
/// `extensions`, each once.
nlohmann::json gltf_material(const Material& material, GltfTextures& textures,
                             std::vector<std::string>& extensions);

}  // namespace haarlight::data_gen
