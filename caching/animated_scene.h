// A scene that moves: animated glTF, read once, taken frame by frame.

#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "caching/environment_light.h"
#include "caching/scene_light.h"
#include "precompute/scene.h"

namespace haarlight {

/// How a material shines by itself.
struct Emission {
  RgbD radiance;            ///< W m^-2 sr^-1, the same in all directions
  bool both_sides = false;  ///< else only where the triangle's corners run counter-clockwise
};

/// A scene as it stands in one frame. A plain value.
struct AnimatedFrame {
  int frame = 0;
  Scene scene;                     ///< world space; triangles in the same order in every frame
  std::vector<Emission> emission;  ///< one a material
  std::vector<SceneLight> light;
  RgbD background;  ///< radiance of what is behind everything, the same all round
  std::shared_ptr<const EnvironmentLight> environment;  ///< a picture added to it, or null
  Rotation
      environment_turn;  ///< light of the picture's direction d comes from environment_turn * d

  /// What comes from a direction (unit, world) where nothing is in the way.
  RgbD background_from(const Vec3& direction) const;
  /// The same without the picture's small suns, and those as directional lamps.
  RgbD background_without_suns(const Vec3& direction) const;
  std::vector<SceneLight> suns() const;
  struct BackgroundSample {
    Vec3 from;   ///< unit
    RgbD light;  ///< radiance without suns over the chance of the direction per solid angle
  };
  /// A direction by two numbers in [0, 1), often from where light is.
  BackgroundSample sample_background(double u, double v) const;
};

/// Reads .gltf and .glb. What moves:
/// - nodes: translation, rotation and scale of every clip in the file; all clips run at once from
///   time 0, and a channel holds its last value. Where clips move the same thing the later one
///   wins.
/// - meshes: morph targets (POSITION and NORMAL) by animated weights.
/// - cameras and lights (KHR_lights_punctual) with their nodes; the first perspective camera of the
///   scene is the camera.
/// - by KHR_animation_pointer: /materials/N/pbrMetallicRoughness/baseColorFactor, metallicFactor
/// and
///   roughnessFactor, /materials/N/emissiveFactor,
///   /materials/N/extensions/KHR_materials_emissive_strength/emissiveStrength,
///   /extensions/KHR_lights_punctual/lights/N/intensity and color, /cameras/N/perspective/yfov.
/// Intensities are radiometric: W/sr, directional lights W/m^2. The scene's
/// "extras": {"haarlight": {"background": [r, g, b]}} is the radiance behind everything, else none.
/// "environment": {"uri": "sky.exr", "rotation": radians} beside it is a picture behind everything,
/// turned about +Y by an angle that /scenes/N/extras/haarlight/environment/rotation can change.
/// Materials and textures are read as by import_scene(). Skins, vertex colours and emissive
/// textures are not read.
class AnimatedScene {
 public:
  /// Throws as import_scene(), and Error{format} where the animation is not as glTF 2.0 has it.
  explicit AnimatedScene(const std::filesystem::path& file, double frames_per_second = 25);
  ~AnimatedScene();
  AnimatedScene(AnimatedScene&&) noexcept;

  /// Frames are whole numbers, so that no clock runs out of digits. Any number >= 0 is allowed.
  /// Throws Error{missing} without a camera unless the file has none at all.
  AnimatedFrame at(int frame) const;

  /// A picture behind everything in place of the file's, or none: null. It turns about +Y by so
  /// many radians a second, from `start` on.
  void set_environment(std::shared_ptr<const EnvironmentLight> light, double start = 0,
                       double a_second = 0);

  /// What a person changes while it plays, on top of what the file says, in all frames asked for
  /// from then on: a node and what hangs on it is carried by so many metres in the world; what it
  /// is seen by (the file's camera again: none). Throws Error{invalid_argument} for a node that is
  /// not there.
  void carry(std::uint32_t node, const Vec3& metres);
  Vec3 carried(std::uint32_t node) const;
  void set_camera(const std::optional<Camera>& camera);

  /// From the first to the last key, both included; 1 for a scene without animation.
  int frames() const;
  std::size_t triangle_count() const;
  /// The node's number in the file that a triangle hangs on: one body, unless its mesh deforms.
  std::uint32_t instance_of(std::uint32_t triangle) const;
  /// The nodes of AnimatedFrame::light, in its order.
  std::vector<std::uint32_t> light_nodes() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace haarlight
