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

/// Whether Phong materials are also written as such, into "extras" (precompute/gltf_materials.h):
/// if any of the scene has a lobe of a tenth or more, which glTF cannot say. Else they come back as
/// rough dielectrics.
bool wants_phong(const Scene& scene);

/// The JSON object of a material. `phong`: see wants_phong(). The names of the extensions that it
/// uses are added to `extensions`, each once.
nlohmann::json gltf_material(const Material& material, bool phong, GltfTextures& textures,
                             std::vector<std::string>& extensions);

}  // namespace haarlight::data_gen
