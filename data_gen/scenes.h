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
/// A smooth gold ring lying on a matt ground, high enough that light comes back off its inner wall
/// as a caustic. After Overbeck et al. 2006, Figure 1.
Scene make_ring(std::uint64_t seed);
/// A ball, a slab and a green blob of glass before a mirror, on a checkered floor.
Scene make_glass(std::uint64_t seed);
/// The Cornell box, 2 m wide, two boxes in it; where the original has its camera it is open, and
/// that is where light comes from.
Scene make_cornell(std::uint64_t seed);
/// The same room with walls of albedo 0 around one box, which is convex: no light bounces at all.
Scene make_cornell_dark(std::uint64_t seed);
/// Fifteen balls of GGX on a ground: gold, copper and white plastic, roughness 0.05 to 1.
Scene make_metals(std::uint64_t seed);
/// A closed room of 5 x 2.7 x 4 m with one window; table, sofa, shelf, rug and a screen with holes.
Scene make_room(std::uint64_t seed);
/// A street with shiny lamps and bollards before a house front, 40,000 vertices, most of them on
/// the ground. After Overbeck et al. 2006, Figures 11 and 12.
Scene make_street(std::uint64_t seed);
/// One clay ellipsoid in the air.
Scene make_convex(std::uint64_t seed);

}  // namespace haarlight::data_gen
