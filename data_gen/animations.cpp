// Scenes that move.

#include "data_gen/animations.h"

#include <array>
#include <cmath>

#include "core/error.h"
#include "data_gen/animated_writer.h"
#include "data_gen/mesh_builder.h"
#include "data_gen/random.h"

namespace haarlight::data_gen {
namespace {

constexpr std::array kAnimations{
    AnimationEntry{"cube-in-box", "a cube that slides and turns in a coloured box: 24 triangles"},
    AnimationEntry{"moving-light", "the same at rest under a moving lamp: 24 triangles"},
    AnimationEntry{"spheres", "66 balls, matt and glossy, bounce before a glossy wall"},
};

constexpr double kLength = 16;  // seconds: 401 frames at 25 a second

Scene finished(MeshBuilder& builder) { return builder.finish(Camera()); }

Scene quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  MeshBuilder builder;
  builder.add_quad(builder.add_material("", {1, 1, 1}), a, b, c, d);
  return finished(builder);
}

Scene cube(double size) {
  MeshBuilder builder;
  builder.add_box(builder.add_material("", {1, 1, 1}), {0, -size / 2, 0}, {size, size, size});
  return finished(builder);
}

// Six walls of a room of 2 x 2 x 2 m about (0, 1, 0), facing inwards.
void add_room(AnimatedWriter& writer) {
  const auto white = writer.add_material("white", {0.73f, 0.73f, 0.73f});
  const auto red = writer.add_material("red", {0.63f, 0.065f, 0.05f});
  const auto green = writer.add_material("green", {0.14f, 0.45f, 0.091f});
  const Vec3 a{-1, 0, 1}, b{1, 0, 1}, c{1, 0, -1}, d{-1, 0, -1}, up{0, 2, 0};
  writer.add_node({{"name", "floor"}, {"mesh", writer.add_mesh(quad(a, b, c, d), white)}});
  writer.add_node({{"name", "ceiling"},
                   {"mesh", writer.add_mesh(quad(a + up, d + up, c + up, b + up), white)}});
  writer.add_node({{"name", "back"}, {"mesh", writer.add_mesh(quad(d, c, c + up, d + up), white)}});
  writer.add_node(
      {{"name", "front"}, {"mesh", writer.add_mesh(quad(b, a, a + up, b + up), white)}});
  writer.add_node({{"name", "left"}, {"mesh", writer.add_mesh(quad(a, d, d + up, a + up), red)}});
  writer.add_node(
      {{"name", "right"}, {"mesh", writer.add_mesh(quad(c, b, b + up, c + up), green)}});
}

std::size_t add_lamp(AnimatedWriter& writer, const Vec3& place, double intensity) {
  const auto light = writer.add_point_light({1.0f, 0.95f, 0.85f}, intensity);
  nlohmann::json node{{"name", "lamp"}, {"translation", {place.x, place.y, place.z}}};
  node["extensions"]["KHR_lights_punctual"]["light"] = light;
  return writer.add_node(node);
}

void add_camera(AnimatedWriter& writer) {
  writer.add_camera_node(look_at({0, 1, 0.97}, {0, 0.9, -0.6}, 1.2, 512, 384));
}

void cube_in_box(AnimatedWriter& writer) {
  add_room(writer);
  const auto blue = writer.add_material("blue", {0.2f, 0.3f, 0.7f});
  const auto body = writer.add_node({{"name", "cube"}, {"mesh", writer.add_mesh(cube(0.5), blue)}});
  add_lamp(writer, {0, 1.5, 0.2}, 1);
  add_camera(writer);
  std::vector<float> time, move, turn;
  constexpr int kKeys = 64;
  for (int k = 0; k <= kKeys; ++k) {
    const double t = static_cast<double>(k) / kKeys, angle = 2 * kPi * t;
    time.push_back(static_cast<float>(kLength * t));
    for (const double x :
         {0.5 * std::sin(angle), 0.55 + 0.2 * std::sin(2 * angle), -0.35 - 0.2 * std::cos(angle)}) {
      move.push_back(static_cast<float>(x));
    }
    for (const double x : {0.0, std::sin(angle / 2), 0.0, std::cos(angle / 2)}) {
      turn.push_back(static_cast<float>(x));
    }
  }
  writer.animate(body, "translation", time, move);
  writer.animate(body, "rotation", time, turn);
}

void moving_light(AnimatedWriter& writer) {
  add_room(writer);
  const auto blue = writer.add_material("blue", {0.2f, 0.3f, 0.7f});
  writer.add_node({{"name", "cube"},
                   {"mesh", writer.add_mesh(cube(0.5), blue)},
                   {"translation", {0.1, 0.25, -0.4}}});
  const auto lamp = add_lamp(writer, {0, 1.5, 0}, 1);
  add_camera(writer);
  std::vector<float> time, move;
  constexpr int kKeys = 64;
  for (int k = 0; k <= kKeys; ++k) {
    const double t = static_cast<double>(k) / kKeys, angle = 4 * kPi * t;
    time.push_back(static_cast<float>(kLength * t));
    for (const double x :
         {0.7 * std::sin(angle), 1.4 + 0.3 * std::cos(2 * angle), 0.6 * std::cos(angle) - 0.1}) {
      move.push_back(static_cast<float>(x));
    }
  }
  writer.animate(lamp, "translation", time, move);
}

void spheres(AnimatedWriter& writer) {
  add_room(writer);
  const auto wall = writer.add_material("polished", {0.9f, 0.85f, 0.8f}, 1, 0.45f);
  writer.add_node({{"name", "polished wall"},
                   {"mesh", writer.add_mesh(quad({-0.9, 0.1, -0.98}, {0.9, 0.1, -0.98},
                                                 {0.9, 1.9, -0.98}, {-0.9, 1.9, -0.98}),
                                            wall)}});
  constexpr int kBalls = 66, kSegments = 32;
  constexpr double kRadius = 0.06;
  MeshBuilder builder;
  builder.add_ellipsoid(builder.add_material("", {1, 1, 1}), {0, 0, 0}, {kRadius, kRadius, kRadius},
                        kSegments);
  const Scene ball = finished(builder);
  const std::array materials{writer.add_material("clay", {0.6f, 0.3f, 0.2f}),
                             writer.add_material("gold", {1.0f, 0.78f, 0.34f}, 1, 0.4f),
                             writer.add_material("moss", {0.2f, 0.45f, 0.15f}),
                             writer.add_material("steel", {0.6f, 0.62f, 0.65f}, 1, 0.45f)};
  Random random(1);
  for (int i = 0; i < kBalls; ++i) {
    const auto mesh = writer.add_mesh(ball, materials[static_cast<std::size_t>(i) % 4]);
    const auto node = writer.add_node({{"name", "ball"}, {"mesh", mesh}});
    const double x = (i % 11 - 5) * 0.17, z = (i / 11) * 0.22 - 0.75;
    const double height = random.between(0.3, 1.2), period = random.between(0.8, 1.6);
    const double shift = random.uniform();
    std::vector<float> time, move;
    constexpr int kKeys = 256;  // fine enough that a parabola is one to a millimetre
    for (int k = 0; k <= kKeys; ++k) {
      const double t = kLength * k / kKeys;
      const double u = t / period + shift, phase = u - std::floor(u);
      time.push_back(static_cast<float>(t));
      for (const double v : {x, kRadius + 0.001 + 4 * height * phase * (1 - phase), z}) {
        move.push_back(static_cast<float>(v));
      }
    }
    writer.animate(node, "translation", time, move);
  }
  add_lamp(writer, {0, 1.5, 0.4}, 1);
  add_camera(writer);
}

}  // namespace

std::span<const AnimationEntry> animations() { return kAnimations; }

std::size_t save_animation(const std::filesystem::path& file, std::string_view name) {
  AnimatedWriter writer;
  if (name == "cube-in-box") {
    cube_in_box(writer);
  } else if (name == "moving-light") {
    moving_light(writer);
  } else if (name == "spheres") {
    spheres(writer);
  } else {
    throw Error(ErrorKind::invalid_argument, "animation \"" + std::string(name) +
                                                 "\" is not known, wanted cube-in-box, "
                                                 "moving-light or spheres");
  }
  writer.save(file);
  return writer.triangles();
}

}  // namespace haarlight::data_gen
