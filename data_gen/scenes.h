// The scenes that the project makes itself.

#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "precompute/scene.h"

namespace haarlight::data_gen {

struct SceneEntry {
  std::string_view name;
  std::string_view description;
  Scene (*make)(std::uint64_t seed);
};

/// All scenes, in the order of the help text.
std::span<const SceneEntry> scenes();

/// The scene of that name; the same seed gives the same scene. Throws Error{invalid_argument}
/// listing the names.
Scene make_scene(std::string_view name, std::uint64_t seed = 1);

/// A potted plant: a dozen stems and a few hundred curved leaves over a light ground, with a low
/// wall to catch their shadows. In the manner of the plant of Overbeck et al. 2006, Figure 1.
Scene make_plant(std::uint64_t seed);
/// Columns and spheres on a ground.
Scene make_pillars(std::uint64_t seed);
/// A ground under spheres of several sizes.
Scene make_spheres(std::uint64_t seed);

}  // namespace haarlight::data_gen
