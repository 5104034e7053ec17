// Where the paths of virtual lights begin: lamps, suns, shining materials, the background.

#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "caching/halton.h"
#include "caching/moving_visibility.h"
#include "caching/scene_light.h"
#include "core/rgb.h"
#include "core/vec.h"
#include "precompute/chances.h"

namespace haarlight {

/// What has a share of all numbers of virtual lights: a lamp, all suns of the background, a shining
/// material, or what is left of the background.
struct Emitter {
  std::vector<SceneLight> lamp;         ///< one, or suns; world
  Chances power;                        ///< of lamp
  std::vector<std::uint32_t> triangle;  ///< of a material, those with area
  Chances area;                         ///< of them, local units squared
  RgbD radiance;                        ///< of a material
  bool both_sides = false;

  bool is_background() const { return lamp.empty() && triangle.empty(); }
};

/// Those of the current frame, the background last.
std::vector<Emitter> emitters(const MovingVisibility& scene);
std::vector<Emitter> shining_materials(const MovingVisibility& scene);

/// A place on a shining material by three numbers, and its geometric normal; local.
std::pair<Vec3, Vec3> place_on(const MovingVisibility& scene, const Emitter& material,
                               double choice, double u, double v);

/// A path's first ray, local, from just off a light.
struct PathStart {
  Vec3 from, direction;
  RgbD flux;  ///< that it carries, W
};
/// All light of an emitter by one path: point `i` of a sequence chooses which.
PathStart path_start(const MovingVisibility& scene, const Emitter& emitter, const Halton& halton,
                     std::uint64_t i);

/// By two numbers, evenly over the sphere.
Vec3 even_direction(double u, double v);

}  // namespace haarlight
