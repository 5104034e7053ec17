// The list of scenes, and the simple ones.

#include "data_gen/scenes.h"

#include <array>
#include <string>

#include "core/error.h"
#include "data_gen/mesh_builder.h"
#include "data_gen/random.h"

namespace haarlight::data_gen {
namespace {

constexpr std::array kScenes{
    SceneEntry{"plant", "a potted plant with hundreds of curved leaves by a low wall", make_plant},
    SceneEntry{"pillars", "columns and spheres on a ground", make_pillars},
    SceneEntry{"spheres", "spheres over a ground", make_spheres},
    SceneEntry{"ring", "a shiny ring on a matt ground: its caustic", make_ring},
    SceneEntry{"glass", "glass bodies and a mirror on a checkered floor", make_glass},
    SceneEntry{"cornell", "a box with a red and a green wall, open in front", make_cornell},
    SceneEntry{"cornell-dark", "the same with black walls: nothing bounces", make_cornell_dark},
    SceneEntry{"metals", "balls of gold, copper and plastic, smooth to rough", make_metals},
    SceneEntry{"room", "a furnished room, lit through its window only", make_room},
    SceneEntry{"street", "a street with shiny lamps, 40,000 vertices", make_street},
    SceneEntry{"convex", "one convex body in the open: nothing but its own horizon", make_convex},
};

}  // namespace

std::span<const SceneEntry> scenes() { return kScenes; }

Scene make_scene(std::string_view name, std::uint64_t seed) {
  std::string names;
  for (const SceneEntry& entry : kScenes) {
    if (entry.name == name) return entry.make(seed);
    names += (names.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw Error(ErrorKind::invalid_argument,
              "scene \"" + std::string(name) + "\" is not known, wanted one of " + names);
}

Scene make_pillars(std::uint64_t seed) {
  Random random(seed);
  MeshBuilder builder;
  const auto ground = builder.add_material("ground", {0.60f, 0.57f, 0.52f});
  const auto stone = builder.add_material("stone", {0.55f, 0.53f, 0.50f});
  const auto red = builder.add_material("red", {0.55f, 0.10f, 0.07f});
  const auto blue = builder.add_material("blue", {0.09f, 0.17f, 0.45f});
  builder.add_ground(ground, 8);
  // Two rows of five columns, each with a square foot and head.
  for (int i = 0; i < 5; ++i) {
    for (const double z : {-1.0, 1.0}) {
      const Vec3 base{(i - 2) * 1.1, 0, z};
      builder.add_box(stone, base, {0.46, 0.10, 0.46});
      const std::array profile{ProfilePoint{0.17, 0.10}, ProfilePoint{0.15, 1.0},
                               ProfilePoint{0.13, 1.9}};
      builder.add_lathe(stone, base, profile, 32);
      builder.add_box(stone, base + Vec3{0, 1.9, 0}, {0.40, 0.12, 0.40});
    }
  }
  for (int i = 0; i < 4; ++i) {
    const double radius = random.between(0.16, 0.30);
    builder.add_ellipsoid(i % 2 == 0 ? red : blue,
                          {(i - 1.5) * 1.1, radius, random.between(-0.4, 0.6)},
                          {radius, radius, radius}, 48);
  }
  return builder.finish(look_at({2.6, 2.4, 6.2}, {0, 0.85, 0}, 0.61, 512, 512));
}

Scene make_spheres(std::uint64_t seed) {
  Random random(seed);
  MeshBuilder builder;
  const auto ground = builder.add_material("ground", {0.6f, 0.6f, 0.6f});
  const std::array materials{builder.add_material("clay", {0.55f, 0.30f, 0.20f}),
                             builder.add_material("chalk", {0.75f, 0.74f, 0.70f}),
                             builder.add_material("moss", {0.22f, 0.35f, 0.14f})};
  builder.add_ground(ground, 6);
  for (int i = 0; i < 9; ++i) {
    const double radius = random.between(0.18, 0.42);
    const Vec3 center{(i % 3 - 1) * 1.2 + random.between(-0.2, 0.2),
                      radius + random.between(0, 0.4),
                      (i / 3 - 1) * 1.2 + random.between(-0.2, 0.2)};
    builder.add_ellipsoid(materials[static_cast<std::size_t>(i) % materials.size()], center,
                          {radius, radius, radius}, 64);
  }
  return builder.finish(look_at({1.8, 2.6, 5.0}, {0, 0.35, 0}, 0.61, 512, 512));
}

Scene make_convex(std::uint64_t seed) {
  Random random(seed);
  MeshBuilder builder;
  const auto clay = builder.add_material("clay", {0.70f, 0.42f, 0.28f});
  builder.add_ellipsoid(clay, {0, 0.6, 0},
                        {random.between(0.7, 0.8), 0.6, random.between(0.5, 0.6)}, 64);
  return builder.finish(look_at({1.2, 1.5, 3.2}, {0, 0.6, 0}, 0.5, 512, 512));
}

}  // namespace haarlight::data_gen
