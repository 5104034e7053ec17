// A furnished room, lit through its window only.

#include <array>
#include <cmath>
#include <vector>

#include "data_gen/mesh_builder.h"
#include "data_gen/random.h"
#include "data_gen/scenes.h"

namespace haarlight::data_gen {
namespace {

constexpr double kHalfWidth = 2.5, kHalfDepth = 2, kHeight = 2.7, kWall = 0.2;

// An axis-aligned box by two corners.
void add_block(MeshBuilder& builder, std::uint32_t material, const Vec3& low, const Vec3& high) {
  builder.add_box(material, {(low.x + high.x) / 2, low.y, (low.z + high.z) / 2}, high - low);
}

// Floor, ceiling and walls as slabs; the left one has an opening of 1.7 x 1.4 m.
void add_shell(MeshBuilder& builder, std::uint32_t floor, std::uint32_t wall,
               std::uint32_t accent) {
  const double x = kHalfWidth, z = kHalfDepth, w = kWall;
  add_block(builder, floor, {-x - w, -w, -z - w}, {x + w, 0, z + w});
  add_block(builder, wall, {-x - w, kHeight, -z - w}, {x + w, kHeight + w, z + w});
  add_block(builder, wall, {-x - w, 0, -z - w}, {x + w, kHeight, -z});
  add_block(builder, wall, {-x - w, 0, z}, {x + w, kHeight, z + w});
  add_block(builder, accent, {x, 0, -z}, {x + w, kHeight, z});
  const double sill = 0.85, lintel = 2.25, left = -1.0, right = 0.7;
  add_block(builder, wall, {-x - w, 0, -z}, {-x, sill, z});
  add_block(builder, wall, {-x - w, lintel, -z}, {-x, kHeight, z});
  add_block(builder, wall, {-x - w, sill, -z}, {-x, lintel, left});
  add_block(builder, wall, {-x - w, sill, right}, {-x, lintel, z});
}

void add_table(MeshBuilder& builder, std::uint32_t wood, const Vec3& at) {
  add_block(builder, wood, at + Vec3{-0.6, 0.70, -0.4}, at + Vec3{0.6, 0.74, 0.4});
  for (const double x : {-0.54, 0.54}) {
    for (const double z : {-0.34, 0.34}) {
      add_block(builder, wood, at + Vec3{x - 0.03, 0, z - 0.03},
                at + Vec3{x + 0.03, 0.70, z + 0.03});
    }
  }
}

void add_sofa(MeshBuilder& builder, std::uint32_t cloth, const Vec3& at) {
  add_block(builder, cloth, at + Vec3{-0.95, 0.05, -0.4}, at + Vec3{0.95, 0.42, 0.42});
  add_block(builder, cloth, at + Vec3{-0.95, 0.42, -0.4}, at + Vec3{0.95, 0.85, -0.18});
  add_block(builder, cloth, at + Vec3{-1.15, 0.05, -0.4}, at + Vec3{-0.95, 0.62, 0.42});
  add_block(builder, cloth, at + Vec3{0.95, 0.05, -0.4}, at + Vec3{1.15, 0.62, 0.42});
}

// A shelf against the right wall with books of several colours.
void add_shelf(MeshBuilder& builder, std::uint32_t wood, const std::array<std::uint32_t, 3>& books,
               Random& random) {
  const double back = kHalfWidth, front = kHalfWidth - 0.32, z0 = -1.7, z1 = -0.3;
  for (const double y : {0.0, 0.5, 1.0, 1.5}) {
    add_block(builder, wood, {front, y, z0}, {back, y + 0.03, z1});
    if (y == 1.5) break;
    std::size_t color = 0;
    for (double z = z0 + 0.05; z < z1 - 0.12;) {
      const double thick = random.between(0.03, 0.08);
      add_block(builder, books[color++ % books.size()], {front + 0.04, y + 0.03, z},
                {back - 0.05, y + random.between(0.28, 0.42), z + thick});
      z += thick + 0.004;
    }
  }
  add_block(builder, wood, {front, 0, z0 - 0.03}, {back, 1.53, z0});
  add_block(builder, wood, {front, 0, z1}, {back, 1.53, z1 + 0.03});
}

// A sheet with round holes, as alpha.
int add_holes(MeshBuilder& builder) {
  constexpr int kSize = 32;
  Image color(kSize, kSize);
  std::vector<float> alpha(color.pixels.size(), 1.0f);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      color.at(x, y) = {0.75f, 0.60f, 0.40f};
      const double from_middle = std::hypot(x + 0.5 - kSize / 2.0, y + 0.5 - kSize / 2.0);
      if (from_middle < 0.34 * kSize) alpha[color.index(x, y)] = 0;
    }
  }
  return builder.add_texture(color, alpha);
}

}  // namespace

Scene make_room(std::uint64_t seed) {
  Random random(seed);
  MeshBuilder builder;
  const auto floor = builder.add_material("floor boards", {0.42f, 0.28f, 0.17f});
  const auto wall = builder.add_material("plaster", {0.78f, 0.76f, 0.71f});
  const auto accent = builder.add_material("blue wall", {0.17f, 0.36f, 0.58f});
  const auto wood = builder.add_material("oak", {0.50f, 0.31f, 0.15f});
  const auto cloth = builder.add_material("red cloth", {0.62f, 0.11f, 0.08f});
  const auto rug = builder.add_material("rug", {0.70f, 0.52f, 0.20f});
  const auto china =
      builder.add_material("china", {0.70f, 0.74f, 0.72f}, {0.05f, 0.05f, 0.05f}, 60);
  const auto teal = builder.add_material("teal", {0.08f, 0.38f, 0.34f});
  Material sheet;
  sheet.name = "screen";
  sheet.albedo = {0.9f, 0.9f, 0.9f};
  sheet.texture = add_holes(builder);
  sheet.alpha_cutoff = 0.5f;
  const auto screen = builder.add_material(sheet);

  add_shell(builder, floor, wall, accent);
  add_block(builder, rug, {-1.3, 0, -0.9}, {1.1, 0.012, 0.9});
  add_table(builder, wood, {-0.15, 0.012, 0.15});
  add_sofa(builder, cloth, {-0.2, 0, -1.5});
  add_shelf(builder, wood, {teal, cloth, rug}, random);
  const std::array vase{
      ProfilePoint{0.0, 0.0},   ProfilePoint{0.07, 0.0},  ProfilePoint{0.12, 0.08},
      ProfilePoint{0.11, 0.17}, ProfilePoint{0.05, 0.25}, ProfilePoint{0.06, 0.30},
      ProfilePoint{0.05, 0.30}, ProfilePoint{0.03, 0.24}, ProfilePoint{0.0, 0.22}};
  builder.add_lathe(china, {0.1, 0.752, 0.1}, vase, 40);
  builder.add_ellipsoid(teal, {-0.35, 0.852, 0.2}, {0.1, 0.1, 0.1}, 32);
  // Two leaves of a folding screen beside the window.
  const auto leaf = [&](const Vec3& foot, const Vec3& along) {
    const Vec3 up{0, 1.6, 0};
    builder.add_quad(screen, foot, foot + along, foot + along + up, foot + up, {4, 12});
  };
  leaf({-2.1, 0.02, -1.35}, {0.25, 0, 0.46});
  leaf({-1.85, 0.02, -0.89}, {-0.25, 0, 0.46});
  return builder.finish(look_at({1.9, 1.55, 1.85}, {-0.45, 0.8, -0.6}, 1.0, 512, 384));
}

}  // namespace haarlight::data_gen
