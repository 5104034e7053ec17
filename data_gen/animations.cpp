// Scenes that move.

#include "data_gen/animations.h"

#include <array>
#include <cmath>

#include "core/error.h"
#include "data_gen/animated_writer.h"
#include "data_gen/animation_parts.h"
#include "data_gen/animation_scenes.h"
#include "data_gen/mesh_builder.h"
#include "data_gen/random.h"

namespace haarlight::data_gen {
namespace {

constexpr std::array kAnimations{
    AnimationEntry{"cube-in-box", "a cube that slides and turns in a coloured box: 24 triangles"},
    AnimationEntry{"moving-light", "the same at rest under a moving lamp: 24 triangles"},
    AnimationEntry{"spheres", "66 balls, matt and glossy, bounce before a glossy wall"},
    AnimationEntry{"flying-kite", "a kite of painted cloth sinks past a lamp in a papered room"},
    AnimationEntry{"interior", "a furnished room; its lamp swings, its door opens to daylight"},
    AnimationEntry{"cornell-bunny", "a bunny hops round a statue in the Cornell box"},
    AnimationEntry{"wobble", "a cylinder bends to and fro by morph targets in the Cornell box"},
    AnimationEntry{"desk", "a desk: its lamp swings, a mug and books are pushed, a chair rolls"},
    AnimationEntry{"bunnies", "nine bunnies in the Cornell box, of which --count bounce"},
    AnimationEntry{"office", "four desks behind blinds; a chair rolls, the lamp swings"},
};

Scene cube(double size) {
  MeshBuilder builder;
  builder.add_box(builder.add_material("", {1, 1, 1}), {0, -size / 2, 0}, {size, size, size});
  return finished(builder);
}

void add_cube_in_box(AnimatedWriter& writer) {
  add_box_room(writer);
  const auto blue = writer.add_material("blue", {0.2f, 0.3f, 0.7f});
  const auto body = writer.add_node({{"name", "cube"}, {"mesh", writer.add_mesh(cube(0.5), blue)}});
  add_lamp(writer, {0, 1.5, 0.2}, 1);
  add_box_camera(writer);
  std::vector<float> time, move, turn;
  constexpr int kKeys = 64;
  for (int k = 0; k <= kKeys; ++k) {
    const double t = static_cast<double>(k) / kKeys, angle = 2 * kPi * t;
    time.push_back(static_cast<float>(kAnimationSeconds * t));
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

void add_moving_light(AnimatedWriter& writer) {
  add_box_room(writer);
  const auto blue = writer.add_material("blue", {0.2f, 0.3f, 0.7f});
  writer.add_node({{"name", "cube"},
                   {"mesh", writer.add_mesh(cube(0.5), blue)},
                   {"translation", {0.1, 0.25, -0.4}}});
  const auto lamp = add_lamp(writer, {0, 1.5, 0}, 1);
  add_box_camera(writer);
  std::vector<float> time, move;
  constexpr int kKeys = 64;
  for (int k = 0; k <= kKeys; ++k) {
    const double t = static_cast<double>(k) / kKeys, angle = 4 * kPi * t;
    time.push_back(static_cast<float>(kAnimationSeconds * t));
    for (const double x :
         {0.7 * std::sin(angle), 1.4 + 0.3 * std::cos(2 * angle), 0.6 * std::cos(angle) - 0.1}) {
      move.push_back(static_cast<float>(x));
    }
  }
  writer.animate(lamp, "translation", time, move);
}

void add_spheres(AnimatedWriter& writer) {
  add_box_room(writer);
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
  std::array<std::size_t, materials.size()> meshes{};
  for (std::size_t m = 0; m < meshes.size(); ++m) meshes[m] = writer.add_mesh(ball, materials[m]);
  Random random(1);
  for (int i = 0; i < kBalls; ++i) {
    const auto mesh = meshes[static_cast<std::size_t>(i) % meshes.size()];
    const auto node = writer.add_node({{"name", "ball"}, {"mesh", mesh}});
    const double x = (i % 11 - 5) * 0.17, z = (i / 11) * 0.22 - 0.75;
    const double height = random.between(0.3, 1.2), period = random.between(0.8, 1.6);
    const double shift = random.uniform();
    std::vector<float> time, move;
    constexpr int kKeys = 256;  // fine enough that a parabola is one to a millimetre
    for (int k = 0; k <= kKeys; ++k) {
      const double t = kAnimationSeconds * k / kKeys;
      const double u = t / period + shift, phase = u - std::floor(u);
      time.push_back(static_cast<float>(t));
      for (const double v : {x, kRadius + 0.001 + 4 * height * phase * (1 - phase), z}) {
        move.push_back(static_cast<float>(v));
      }
    }
    writer.animate(node, "translation", time, move);
  }
  add_lamp(writer, {0, 1.5, 0.4}, 1);
  add_box_camera(writer);
}

}  // namespace

std::span<const AnimationEntry> animations() { return kAnimations; }

std::size_t save_animation(const std::filesystem::path& file, std::string_view name,
                           const AnimationOptions& options) {
  if (options.count < 1 || options.count > 9) {
    throw Error(ErrorKind::invalid_argument,
                std::to_string(options.count) + " bunnies move, wanted 1 to 9");
  }
  AnimatedWriter writer;
  if (name == "cube-in-box") {
    add_cube_in_box(writer);
  } else if (name == "moving-light") {
    add_moving_light(writer);
  } else if (name == "spheres") {
    add_spheres(writer);
  } else if (name == "flying-kite") {
    add_flying_kite(writer);
  } else if (name == "interior") {
    add_interior(writer);
  } else if (name == "cornell-bunny") {
    add_cornell_bunny(writer, options);
  } else if (name == "wobble") {
    add_wobble(writer);
  } else if (name == "desk") {
    add_desk(writer);
  } else if (name == "bunnies") {
    add_bunnies(writer, options);
  } else if (name == "office") {
    add_office(writer);
  } else {
    std::string known;
    for (const AnimationEntry& entry : kAnimations) known.append(" ").append(entry.name);
    throw Error(ErrorKind::invalid_argument,
                "animation \"" + std::string(name) + "\" is not known, wanted one of" + known);
  }
  writer.save(file);
  return writer.triangles();
}

}  // namespace haarlight::data_gen
