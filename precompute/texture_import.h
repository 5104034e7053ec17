// Pictures of a scene file, in it or beside it, into the scene; each read once.

#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <tuple>

#include "core/image_io.h"
#include "precompute/scene.h"

struct aiScene;

namespace haarlight {

/// Adds textures to a scene. What cannot be read is counted in scene.report.textures_missing, once
/// a picture.
class TextureImport {
 public:
  /// `file` is as the scene reader gave it; `folder` is where pictures beside it lie. Keeps
  /// references.
  TextureImport(const aiScene& file, const std::filesystem::path& folder, Scene& scene)
      : file_(file), folder_(folder), scene_(scene) {}

  /// The number of a picture in scene.texture, values in [0, 1]; -1 if it cannot be read or `path`
  /// is empty.
  int index(const std::string& path, ImageEncoding encoding);

  /// The same with an alpha, in scene.alpha unless it is 1 everywhere: the picture's own, or, where
  /// `mask` is not empty, that picture's (its alpha or else its red). An empty path is white.
  int index_with_alpha(const std::string& path, const std::string& mask);

  /// Whether texture `index` (or -1) has an alpha.
  bool has_alpha(int index) const;

 private:
  Image load(const std::string& path, ImageEncoding encoding) const;
  std::vector<float> alpha(const std::string& path) const;
  int add(Image image);

  const aiScene& file_;
  std::filesystem::path folder_;
  Scene& scene_;
  std::map<std::pair<std::string, ImageEncoding>, int> plain_;
  std::map<std::pair<std::string, std::string>, int> with_alpha_;
};

}  // namespace haarlight
