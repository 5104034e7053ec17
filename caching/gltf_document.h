// The JSON and the buffers of a glTF file: what animation needs and the scene reader leaves out.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace haarlight {

/// A glTF 2.0 file, .gltf or .glb, with all its buffers in memory.
class GltfDocument {
 public:
  /// Throws Error{format} if the file is no glTF 2.0 or names a buffer that is not there or too
  /// short, Error{io} if it cannot be read.
  explicit GltfDocument(const std::filesystem::path& file);

  const nlohmann::json& json() const { return json_; }
  const std::string& name() const { return name_; }  ///< for messages

  /// The numbers of an accessor, element by element; normalised integers become [0, 1] or [-1, 1]
  /// (glTF 2.0, section 3.6.2). `width` is how many an element has. Sparse accessors are refused.
  /// Throws Error{format} where the accessor, its view or its buffer is not as the file says, or a
  /// number is not finite.
  std::vector<double> numbers(std::size_t accessor, std::size_t width) const;

  /// The members of a top-level list; an empty list where there is none.
  const nlohmann::json& list(const char* key) const;

 private:
  nlohmann::json json_;
  std::string name_;
  std::vector<std::vector<std::uint8_t>> buffer_;
};

}  // namespace haarlight
