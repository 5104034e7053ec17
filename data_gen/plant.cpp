// The demo scene: a potted plant whose leaves throw intricate shadows.

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "data_gen/mesh_builder.h"
#include "data_gen/noise.h"
#include "data_gen/random.h"
#include "data_gen/scenes.h"

namespace haarlight::data_gen {
namespace {

constexpr Vec3 kUp{0, 1, 0};
constexpr double kGoldenAngle = 2.39996322972865332;  // pi (3 - sqrt 5), radians
constexpr double kSoilHeight = 0.275;                 // metres
constexpr int kStems = 13;

Vec3 heading(double azimuth) { return {std::sin(azimuth), 0, std::cos(azimuth)}; }

struct Leaf {
  Vec3 base;          // where the blade begins
  Vec3 direction;     // horizontal heading, unit
  double rise = 0;    // angle of the blade's first piece above the horizon, radians
  double droop = 0;   // how far it has bent down at the tip, radians
  double roll = 0;    // tilt about its own length, radians
  double length = 0;  // metres
  double width = 0;   // half, at the widest place
  double fold = 0;    // how far the halves stand up from the midrib, radians
  double phase = 0;   // of the waves along the edge
};

// The outline of an egg-shaped leaf with a drip tip: half width at s, 1 at the widest place.
double leaf_outline(double s) {
  // s^a (1 - s)^b has its largest value at s = a / (a + b).
  constexpr double a = 0.62, b = 1.05, peak = a / (a + b);
  static const double scale = 1 / (std::pow(peak, a) * std::pow(1 - peak, b));
  if (s <= 0 || s >= 1) return 0;
  return scale * std::pow(s, a) * std::pow(1 - s, b);
}

// Upper and lower sheet of a blade with the thickness of paper, closed along the edge, so that the
// leaf has an inside and a ray can never meet the wrong side of it.
void add_leaf(MeshBuilder& builder, std::uint32_t material, const Leaf& leaf) {
  constexpr int kAlong = 12, kAcross = 4;
  constexpr double kHalfThickness = 0.0004;

  const Vec3 level_side = cross(leaf.direction, kUp);
  const auto blade = [&](double s, double across, double sheet) {
    // The midrib is an arc: heading at s is rise - droop s, integrated in closed form.
    const double angle = leaf.rise - leaf.droop * s;
    double forward, upward;
    if (std::abs(leaf.droop) < 1e-6) {
      forward = s * std::cos(leaf.rise);
      upward = s * std::sin(leaf.rise);
    } else {
      forward = (std::sin(leaf.rise) - std::sin(angle)) / leaf.droop;
      upward = (std::cos(angle) - std::cos(leaf.rise)) / leaf.droop;
    }
    const Vec3 rib = leaf.base + (leaf.direction * forward + kUp * upward) * leaf.length;
    const Vec3 level_normal = kUp * std::cos(angle) - leaf.direction * std::sin(angle);
    const Vec3 side = level_side * std::cos(leaf.roll) + level_normal * std::sin(leaf.roll);
    const Vec3 normal = level_normal * std::cos(leaf.roll) - level_side * std::sin(leaf.roll);

    const double half = leaf.width * leaf_outline(s);
    const double wave = 0.035 * leaf.length * leaf_outline(s) * across * across *
                        std::sin(2 * kPi * 2.5 * s + leaf.phase + (across > 0 ? 1.3 : 0.0));
    const double lift =
        std::abs(across) * half * std::sin(leaf.fold) + wave +
        sheet * kHalfThickness * (1 - across * across) * std::min(1.0, 4 * leaf_outline(s));
    return rib + side * (across * half * std::cos(leaf.fold)) + normal * lift;
  };
  // side x along points up: across runs forwards on the upper sheet and backwards on the lower.
  builder.add_grid(material, kAcross, kAlong,
                   [&](double s, double t) { return blade(t, 2 * s - 1, 1); });
  builder.add_grid(material, kAcross, kAlong,
                   [&](double s, double t) { return blade(t, 1 - 2 * s, -1); });
}

struct Stem {
  std::vector<Vec3> point;
  std::vector<double> radius;

  Vec3 at(double s) const {
    const double place = s * static_cast<double>(point.size() - 1);
    const auto i = std::min(static_cast<std::size_t>(place), point.size() - 2);
    const double t = place - static_cast<double>(i);
    return point[i] * (1 - t) + point[i + 1] * t;
  }
  Vec3 tangent(double s) const {
    const auto i = std::min(static_cast<std::size_t>(s * static_cast<double>(point.size() - 1)),
                            point.size() - 2);
    return normalize(point[i + 1] - point[i]);
  }
};

Stem make_stem(int index, Random& random) {
  const double azimuth = index * kGoldenAngle + random.between(-0.25, 0.25);
  // The first stems stand upright and tall in the middle, the later ones lean out.
  const double outward = static_cast<double>(index) / (kStems - 1);
  const double height = 0.86 - 0.42 * outward + random.between(-0.06, 0.06);
  const double reach = 0.05 + 0.42 * outward + random.between(-0.03, 0.05);
  const Vec3 out = heading(azimuth), side = cross(out, kUp);
  const Vec3 foot = Vec3{0, kSoilHeight - 0.01, 0} + out * (0.015 + 0.075 * outward);
  const double sway = random.between(-0.04, 0.04), phase = random.between(0, 2 * kPi);

  Stem stem;
  constexpr int kPieces = 20;
  for (int i = 0; i <= kPieces; ++i) {
    const double s = static_cast<double>(i) / kPieces;
    stem.point.push_back(foot + kUp * (height * (s - 0.22 * outward * s * s * s)) +
                         out * (reach * std::pow(s, 1.7)) +
                         side * (sway * (std::sin(3 * s + phase) - std::sin(phase)) * s));
    stem.radius.push_back(0.0075 * (1 - s) + 0.0022);
  }
  return stem;
}

void add_pot(MeshBuilder& builder, Random random) {
  const auto terracotta = builder.add_material("terracotta", {0.47f, 0.19f, 0.10f});
  const auto soil = builder.add_material("soil", {0.060f, 0.042f, 0.030f});
  // Up the outside, over the rim and down the inside to below the soil; a saucer under it.
  const std::array saucer{ProfilePoint{0, 0.0005},    ProfilePoint{0.17, 0.001},
                          ProfilePoint{0.205, 0.022}, ProfilePoint{0.197, 0.024},
                          ProfilePoint{0.166, 0.010}, ProfilePoint{0, 0.010}};
  builder.add_lathe(terracotta, {0, 0, 0}, saucer, 72);
  const std::array pot{
      ProfilePoint{0.118, 0.011}, ProfilePoint{0.132, 0.06},  ProfilePoint{0.152, 0.15},
      ProfilePoint{0.168, 0.238}, ProfilePoint{0.186, 0.240}, ProfilePoint{0.191, 0.246},
      ProfilePoint{0.193, 0.292}, ProfilePoint{0.188, 0.298}, ProfilePoint{0.176, 0.298},
      ProfilePoint{0.171, 0.292}, ProfilePoint{0.165, 0.24}};
  builder.add_lathe(terracotta, {0, 0, 0}, pot, 72);
  const double offset = random.between(0, 100);
  builder.add_grid(
      soil, 64, 12,
      [&](double s, double t) {
        const double radius = 0.170 * (1 - t), around = 2 * kPi * s;
        // At the middle all columns must meet in one point to the bit.
        const double x = t == 1 ? 0.0 : radius * std::sin(around);
        const double z = t == 1 ? 0.0 : radius * std::cos(around);
        return Vec3{x, kSoilHeight + 0.006 * fractal_noise({x * 40 + offset, 0, z * 40}, 3), z};
      },
      true);
}

void add_plant(MeshBuilder& builder, const Random& random) {
  // From old to young leaves; both the light and the shade of one plant are in here.
  constexpr std::array<Rgb, 8> kGreens{Rgb{0.030f, 0.095f, 0.022f}, Rgb{0.040f, 0.130f, 0.025f},
                                       Rgb{0.055f, 0.160f, 0.030f}, Rgb{0.075f, 0.195f, 0.035f},
                                       Rgb{0.100f, 0.225f, 0.040f}, Rgb{0.135f, 0.270f, 0.048f},
                                       Rgb{0.190f, 0.320f, 0.060f}, Rgb{0.270f, 0.370f, 0.080f}};
  std::array<std::uint32_t, kGreens.size()> greens{};
  for (std::size_t i = 0; i < greens.size(); ++i) {
    greens[i] = builder.add_material("leaf " + std::to_string(i + 1), kGreens[i]);
  }
  const auto bark = builder.add_material("stem", {0.150f, 0.155f, 0.060f});

  for (int index = 0; index < kStems; ++index) {
    Random of_stem = random.fork(static_cast<std::uint64_t>(index));
    const Stem stem = make_stem(index, of_stem);
    builder.add_tube(bark, stem.point, stem.radius, 8);

    const int leaves = 23 + of_stem.below(6);
    double azimuth = of_stem.between(0, 2 * kPi);
    for (int i = 0; i < leaves; ++i) {
      const double age = 1 - static_cast<double>(i) / (leaves - 1);  // 0 at the tip
      const double s = 1 - 0.74 * std::pow(age, 1.15);
      azimuth += kGoldenAngle + of_stem.between(-0.3, 0.3);

      // A petiole leaves the stem upwards and levels out; the blade goes on where it ends.
      const Vec3 out = heading(azimuth), along = stem.tangent(s);
      const double petiole = (0.025 + 0.06 * age) * of_stem.between(0.8, 1.2);
      const Vec3 foot = stem.at(s);
      std::vector<Vec3> path;
      std::vector<double> radii;
      constexpr int kPieces = 4;
      for (int k = 0; k <= kPieces; ++k) {
        const double t = static_cast<double>(k) / kPieces;
        path.push_back(foot +
                       (out * (0.85 * t) + (along + kUp) * (0.55 * t - 0.28 * t * t)) * petiole);
        radii.push_back(0.0019 - 0.0006 * t);
      }
      builder.add_tube(bark, path, radii, 5);

      Leaf leaf;
      leaf.base = path.back();
      leaf.direction = out;
      leaf.rise = 0.75 - 0.65 * age + of_stem.between(-0.25, 0.25);
      leaf.droop = 0.55 + 0.75 * age + of_stem.between(-0.3, 0.4);
      leaf.roll = of_stem.between(-0.45, 0.45);
      leaf.length = (0.055 + 0.115 * std::pow(std::sin(kPi * (0.12 + 0.72 * age)), 1.2)) *
                    of_stem.between(0.85, 1.15);
      leaf.width = leaf.length * of_stem.between(0.20, 0.27);
      leaf.fold = of_stem.between(0.12, 0.45);
      leaf.phase = of_stem.between(0, 2 * kPi);
      const double shade = (1 - age) * 6.3 + of_stem.between(-1.3, 1.9);
      const auto green = static_cast<std::size_t>(std::clamp(shade, 0.0, 7.0));
      add_leaf(builder, greens[green], leaf);
    }
  }

  // A few leaves have fallen.
  Random fallen = random.fork(1000);
  const auto dry = builder.add_material("dry leaf", {0.31f, 0.20f, 0.065f});
  for (int i = 0; i < 7; ++i) {
    Leaf leaf;
    leaf.direction = heading(fallen.between(0, 2 * kPi));
    leaf.base = heading(fallen.between(-1.5, 1.5)) * fallen.between(0.32, 0.85) + kUp * 0.004;
    leaf.rise = 0.35;
    leaf.droop = 0.62;
    leaf.length = fallen.between(0.10, 0.15);
    leaf.width = leaf.length * 0.24;
    leaf.fold = fallen.between(0.15, 0.5);
    leaf.phase = fallen.between(0, 2 * kPi);
    add_leaf(builder, dry, leaf);
  }
}

}  // namespace

Scene make_plant(std::uint64_t seed) {
  const Random random(seed);
  MeshBuilder builder;
  const auto ground = builder.add_material("ground", {0.62f, 0.58f, 0.52f});
  const auto plaster = builder.add_material("plaster", {0.66f, 0.63f, 0.58f});
  const auto coping = builder.add_material("coping", {0.42f, 0.37f, 0.33f});
  const auto pebble = builder.add_material("pebble", {0.36f, 0.34f, 0.33f});

  constexpr double kHalf = 6;
  builder.add_quad(ground, {-kHalf, 0, kHalf}, {kHalf, 0, kHalf}, {kHalf, 0, -kHalf},
                   {-kHalf, 0, -kHalf});
  // The low wall stands behind the plant to the left, so that the other half shows the distance.
  constexpr double kTurn = 0.42;
  builder.add_box(plaster, {-0.78, 0, -0.72}, {1.50, 0.52, 0.16}, kTurn);
  builder.add_box(coping, {-0.78, 0.52, -0.72}, {1.58, 0.05, 0.23}, kTurn);

  add_pot(builder, random.fork(1));
  add_plant(builder, random.fork(2));

  Random stones = random.fork(3);
  for (int i = 0; i < 9; ++i) {
    const double size = stones.between(0.018, 0.055);
    const Vec3 place = heading(stones.between(-2.2, 2.2)) * stones.between(0.35, 1.0);
    builder.add_ellipsoid(pebble, place + kUp * (size * 0.55),
                          {size * stones.between(0.9, 1.3), size * 0.62, size}, 24);
  }
  return builder.finish(look_at({0.56, 1.08, 2.72}, {-0.10, 0.49, 0}, 0.56, 512, 512));
}

}  // namespace haarlight::data_gen
