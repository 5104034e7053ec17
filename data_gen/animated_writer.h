// Puts bodies, lights and their motions together and writes them as animated glTF.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "precompute/scene.h"

namespace haarlight::data_gen {

class AnimatedWriter {
 public:
  /// Metallic-roughness; `emission` is radiance, W m^-2 sr^-1. Returns the material's number.
  std::size_t add_material(const std::string& name, const Rgb& base, float metallic = 0,
                           float roughness = 1, const Rgb& emission = {});
  /// The triangles of `body` (its own materials are ignored) with one material. Returns its mesh.
  std::size_t add_mesh(const Scene& body, std::size_t material);
  /// All of `body`, with its own materials and textures, as one mesh. Each of `morphs` is the same
  /// body, vertex by vertex, in another shape: a target of positions and normals. Returns its mesh.
  std::size_t add_body(const Scene& body, std::span<const Scene> morphs = {});
  /// A node, as glTF has it: {"mesh": m, "translation": [...], ...}. Returns its number.
  std::size_t add_node(nlohmann::json node);
  std::size_t add_camera_node(const Camera& camera);
  /// A point light, W/sr. Returns the number for add_node()'s KHR_lights_punctual.
  std::size_t add_point_light(const Rgb& color, double intensity);

  /// Moves a node along keys; `path` is translation or scale (3 numbers a key), rotation (4) or
  /// weights (one a target).
  void animate(std::size_t node, const std::string& path, const std::vector<float>& seconds,
               const std::vector<float>& values, const std::string& interpolation = "LINEAR");
  /// The same by keys at equal distances: `pieces` + 1 from 0 to `seconds`.
  void animate(std::size_t node, const std::string& path, double seconds, int pieces,
               const std::function<std::vector<double>(double second)>& value);

  /// Of all nodes: a mesh on several nodes counts as often.
  std::size_t triangles() const { return triangles_; }
  /// Atomic. Throws Error{invalid_argument} unless the suffix is .glb, Error{io}.
  void save(const std::filesystem::path& file) const;

 private:
  std::size_t add_floats(const std::vector<float>& values, std::size_t width, bool vertices);
  std::size_t add_index(const std::vector<std::uint32_t>& index);
  std::size_t add_texture(const Image& picture, const std::vector<float>& alpha, bool srgb);
  std::size_t add_view(const void* data, std::size_t size);
  nlohmann::json gltf_ = nlohmann::json::object();
  nlohmann::json channels_ = nlohmann::json::array(), samplers_ = nlohmann::json::array();
  std::vector<char> bytes_;
  std::vector<std::string> extensions_;      // that materials use
  std::vector<std::size_t> mesh_triangles_;  // by mesh
  std::size_t triangles_ = 0;
};

}  // namespace haarlight::data_gen
