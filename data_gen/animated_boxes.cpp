// Figures and a cylinder that move in a Cornell box. After Debattista and others 2009, section 4.

#include <algorithm>
#include <array>
#include <cmath>

#include "data_gen/animation_parts.h"
#include "data_gen/animation_scenes.h"
#include "data_gen/figures.h"

namespace haarlight::data_gen {
namespace {

Scene bunny_of(const AnimationOptions& options, int cells, double height) {
  return as_figure(options.figure ? *options.figure : make_bunny(cells), height);
}

// Looks into the box so that the floor is seen.
void add_low_camera(AnimatedWriter& writer) {
  writer.add_camera_node(look_at({0, 1.05, 0.97}, {0, 0.62, -0.6}, 1.25, 512, 384));
}

}  // namespace

void add_cornell_bunny(AnimatedWriter& writer, const AnimationOptions& options) {
  add_box_room(writer);
  const auto marble = writer.add_material("marble", {0.75f, 0.74f, 0.70f});
  const auto clay = writer.add_material("clay", {0.70f, 0.48f, 0.28f});
  const auto stone = writer.add_material("stone", {0.45f, 0.43f, 0.40f});
  MeshBuilder builder;
  builder.add_lathe(
      builder.add_material("", {1, 1, 1}), {0, 0, 0},
      std::array{ProfilePoint{0.26, 0}, ProfilePoint{0.26, 0.05}, ProfilePoint{0.21, 0.08},
                 ProfilePoint{0.21, 0.2}, ProfilePoint{0.25, 0.23}, ProfilePoint{0.25, 0.26},
                 ProfilePoint{0, 0.26}},
      64);
  const Vec3 middle{0, 0, -0.4};
  add_still(writer, "pedestal", writer.add_mesh(finished(builder), stone), middle);
  add_still(writer, "statue", writer.add_mesh(as_figure(make_statue(124), 1.15), marble),
            middle + Vec3{0, 0.26, 0}, 0.35);
  const auto bunny = add_still(writer, "bunny", writer.add_mesh(bunny_of(options, 85, 0.46), clay));
  add_lamp(writer, {0.25, 1.8, 0.25}, 1.2);
  add_low_camera(writer);
  constexpr int kPieces = 192;
  const auto angle = [](double t) { return 2 * kPi * t / kAnimationSeconds; };
  writer.animate(bunny, "translation", kAnimationSeconds, kPieces, [&](double t) {
    const double hop = std::abs(std::sin(12 * angle(t)));
    return std::vector{middle.x + 0.62 * std::sin(angle(t)), 0.001 + 0.08 * hop,
                       middle.z + 0.44 * std::cos(angle(t))};
  });
  // It looks along +X where it is in front, as it goes.
  writer.animate(bunny, "rotation", kAnimationSeconds, kPieces, [&](double t) {
    return turn({0, 1, 0}, angle(t));
  });
}

void add_wobble(AnimatedWriter& writer) {
  add_box_room(writer);
  // Sine and cosine of the wave are two targets; their weights make it travel:
  // sin(k y - w t) = sin(k y) cos(w t) - cos(k y) sin(w t).
  constexpr double kAmplitude = 0.13, kWaves = 1.5, kHeight = 1.3, kRadius = 0.24;
  const auto cylinder = [&](double sine, double cosine) {
    MeshBuilder builder;
    Material look;
    look.name = "rubber", look.albedo = {0.75f, 0.55f, 0.12f};
    const auto rubber = builder.add_material(look);
    builder.add_grid(
        rubber, 96, 84,
        [&](double s, double t) {
          // The bottom, the wall, the top: a tenth of the way each for the ends.
          const double up = std::clamp((t - 0.1) / 0.8, 0.0, 1.0);
          const double r = t == 0 || t == 1 ? 0
                           : t < 0.1        ? kRadius * t / 0.1
                           : t > 0.9        ? kRadius * (1 - t) / 0.1
                                            : kRadius;
          const double k = 2 * kPi * kWaves * up, a = 2 * kPi * s;
          const double shift = kAmplitude * up * (sine * std::sin(k) + cosine * std::cos(k));
          return Vec3{r * std::sin(a) + shift, kHeight * up, r * std::cos(a)};
        },
        true);
    return finished(builder);
  };
  const std::array morphs{cylinder(1, 0), cylinder(0, 1)};
  const auto body =
      add_still(writer, "cylinder", writer.add_body(cylinder(0, 0), morphs), {0, 0.001, -0.35});
  add_lamp(writer, {0.3, 1.8, 0.3}, 1.2);
  add_low_camera(writer);
  writer.animate(body, "weights", kAnimationSeconds, 256, [](double t) {
    const double w = 2 * kPi * t / 1.7;  // a wave in 1.7 seconds
    return std::vector{std::cos(w), -std::sin(w)};
  });
}

void add_bunnies(AnimatedWriter& writer, const AnimationOptions& options) {
  add_box_room(writer);
  const Scene figure = bunny_of(options, 46, 0.34);
  constexpr std::array kColors{Rgb{0.70f, 0.48f, 0.28f}, Rgb{0.20f, 0.40f, 0.62f},
                               Rgb{0.65f, 0.62f, 0.58f}};
  std::vector<std::size_t> meshes;
  for (const Rgb& color : kColors) {
    meshes.push_back(writer.add_mesh(figure, writer.add_material("fur", color)));
  }
  constexpr int kSide = 3;
  // Those nearest to the middle of the box move first.
  constexpr std::array kOrder{4, 1, 3, 5, 7, 0, 2, 6, 8};
  for (int i = 0; i < kSide * kSide; ++i) {
    const int at = kOrder[static_cast<std::size_t>(i)];
    const double x = 0.58 * (at % kSide - 1), z = 0.5 * (at / kSide - 1) - 0.3;
    const double heading = 0.7 * at - 1.2;
    const auto node = add_still(writer, "bunny", meshes[static_cast<std::size_t>(at) % 3],
                                {x, 0.001, z}, heading);
    if (i >= options.count) continue;
    const double period = 1 + 0.13 * i, shift = 0.37 * i, height = 0.75 - 0.05 * i;
    writer.animate(node, "translation", kAnimationSeconds, 320, [&](double t) {
      const double u = t / period + shift, phase = u - std::floor(u);
      return std::vector{x, 0.001 + 4 * height * phase * (1 - phase), z};
    });
    writer.animate(node, "rotation", kAnimationSeconds, 64, [&](double t) {
      return turn({0, 1, 0}, heading + 2 * kPi * t / kAnimationSeconds);
    });
  }
  add_lamp(writer, {0.1, 1.85, 0.35}, 1.2);
  add_low_camera(writer);
}

}  // namespace haarlight::data_gen
