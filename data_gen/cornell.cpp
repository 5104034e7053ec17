// The Cornell box, open towards the camera.

#include "data_gen/mesh_builder.h"
#include "data_gen/random.h"
#include "data_gen/scenes.h"

namespace haarlight::data_gen {
namespace {

constexpr double kHalf = 1, kHeight = 2;

// Five walls facing inwards.
void add_walls(MeshBuilder& builder, std::uint32_t white, std::uint32_t left, std::uint32_t right) {
  const Vec3 a{-kHalf, 0, kHalf}, b{kHalf, 0, kHalf}, c{kHalf, 0, -kHalf}, d{-kHalf, 0, -kHalf};
  const Vec3 up{0, kHeight, 0};
  builder.add_quad(white, a, b, c, d);
  builder.add_quad(white, a + up, d + up, c + up, b + up);
  builder.add_quad(white, d, c, c + up, d + up);
  builder.add_quad(left, a, d, d + up, a + up);
  builder.add_quad(right, c, b, b + up, c + up);
}

Camera camera() { return look_at({0, 1, 4.7}, {0, 1, 0}, 0.55, 512, 512); }

}  // namespace

Scene make_cornell(std::uint64_t seed) {
  Random random(seed);
  MeshBuilder builder;
  const auto white = builder.add_material("white", {0.73f, 0.73f, 0.73f});
  const auto red = builder.add_material("red", {0.63f, 0.065f, 0.05f});
  const auto green = builder.add_material("green", {0.14f, 0.45f, 0.091f});
  add_walls(builder, white, red, green);
  builder.add_box(white, {-0.34, 0, -0.32}, {0.6, 1.2, 0.6}, random.between(0.25, 0.35));
  builder.add_box(white, {0.38, 0, 0.32}, {0.6, 0.6, 0.6}, random.between(-0.35, -0.25));
  return builder.finish(camera());
}

Scene make_cornell_dark(std::uint64_t seed) {
  Random random(seed);
  MeshBuilder builder;
  const auto black = builder.add_material("black", {0, 0, 0});
  const auto white = builder.add_material("white", {0.73f, 0.73f, 0.73f});
  add_walls(builder, black, black, black);
  builder.add_box(white, {0, 0, 0}, {0.8, 1.1, 0.8}, random.between(0.4, 0.6));
  return builder.finish(camera());
}

}  // namespace haarlight::data_gen
