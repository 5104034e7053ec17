// Glass bodies and a mirror on a checkered floor.

#include <cmath>
#include <string>

#include "data_gen/mesh_builder.h"
#include "data_gen/random.h"
#include "data_gen/scenes.h"

namespace haarlight::data_gen {
namespace {

Material glass(const std::string& name, float ior, const Rgb& extinction) {
  Material m;
  m.name = name;
  m.model = SurfaceModel::glass;
  m.albedo = {1, 1, 1};
  m.ior = ior;
  m.extinction = extinction;
  return m;
}

Image checkers(const Rgb& light, const Rgb& dark) {
  constexpr int kSize = 64;
  Image image(kSize, kSize);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      image.at(x, y) = (2 * x / kSize + 2 * y / kSize) % 2 == 0 ? light : dark;
    }
  }
  return image;
}

}  // namespace

Scene make_glass(std::uint64_t seed) {
  Random random(seed);
  MeshBuilder builder;
  Material tiles;
  tiles.name = "tiles";
  tiles.albedo = {0.8f, 0.8f, 0.8f};
  tiles.texture = builder.add_texture(checkers({0.90f, 0.88f, 0.84f}, {0.10f, 0.13f, 0.18f}));
  const auto floor = builder.add_material(tiles);
  Material silver;
  silver.name = "mirror";
  silver.model = SurfaceModel::mirror;
  silver.albedo = {0.90f, 0.92f, 0.91f};
  const auto mirror = builder.add_material(silver);
  const auto frame = builder.add_material("frame", {0.32f, 0.17f, 0.08f});
  const auto crown = builder.add_material(glass("crown glass", 1.52f, {}));
  const auto clear = builder.add_material(glass("slab", 1.5f, {1.6f, 0.5f, 0.8f}));
  const auto green = builder.add_material(glass("green glass", 1.5f, {3.5f, 0.5f, 2.2f}));

  // Nothing of glass touches the floor: both would lie in one plane.
  constexpr double kAbove = 1e-3;
  builder.add_ground(floor, 4, 10);
  builder.add_ellipsoid(crown, {-0.75, 0.5 + kAbove, 0.25}, {0.5, 0.5, 0.5}, 64);
  builder.add_box(clear, {0.15, kAbove, 0.75}, {0.75, 0.55, 0.14}, 0.35);
  // A pebble with soft dents.
  const double phase = random.between(0, 6);
  builder.add_grid(
      green, 72, 36,
      [&](double s, double t) {
        const double around = 2 * kPi * s;
        const double ring = t == 0 || t == 1 ? 0.0 : std::sin(kPi * t);
        const double up = t == 0 ? -1.0 : t == 1 ? 1.0 : -std::cos(kPi * t);
        const double r = 1 + 0.16 * ring * ring * std::sin(3 * around + phase) * (0.6 + up) +
                         0.08 * ring * std::cos(2 * around);
        return Vec3{0.85, 0.4 + kAbove, -0.35} + Vec3{0.48 * r * ring * std::sin(around), 0.4 * up,
                                                      0.48 * r * ring * std::cos(around)};
      },
      true);
  builder.add_box(frame, {0, 0, -1.42}, {2.7, 1.55, 0.08});
  builder.add_quad(mirror, {-1.28, 0.07, -1.375}, {1.28, 0.07, -1.375}, {1.28, 1.48, -1.375},
                   {-1.28, 1.48, -1.375});
  return builder.finish(look_at({-0.5, 1.75, 4.1}, {0.05, 0.48, 0}, 0.62, 512, 512));
}

}  // namespace haarlight::data_gen
