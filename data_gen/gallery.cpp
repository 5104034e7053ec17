// An interior by night: a long room with lamps, windows to the dusk and pictures on dark walls.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "data_gen/environments.h"
#include "data_gen/noise.h"
#include "data_gen/random.h"

namespace haarlight::data_gen {
namespace {

// The room in metres, the eye at the origin: floor 1.4 below it.
constexpr Vec3 kLow{-5.0, -1.4, -6.5}, kHigh{4.2, 2.9, 5.0};

struct Lamp {
  Vec3 place;
  double diameter;  // seen from the eye, degrees
  RgbD radiance;
};

// Warm spots under the ceiling, two strong work lights and a cool one by the door. Directions are
// far from each other, so that turning the room changes every shadow.
constexpr std::array<Lamp, 9> kLamps{{
    {{1.7, 2.60, 1.5}, 1.0, {5400, 4450, 3150}},
    {{-1.9, 2.50, 2.6}, 0.9, {1300, 1000, 620}},
    {{-2.8, 2.60, -2.4}, 0.8, {1500, 1240, 850}},
    {{1.3, 2.60, -3.4}, 1.1, {750, 590, 380}},
    {{3.6, 1.30, -1.1}, 1.3, {510, 630, 810}},
    {{0.3, 2.55, -5.8}, 1.0, {620, 450, 260}},
    {{-4.4, 2.30, 3.9}, 1.0, {600, 410, 220}},
    {{3.3, 2.60, 4.1}, 1.0, {600, 450, 285}},
    {{-0.6, 2.65, 0.9}, 1.3, {600, 490, 355}},
}};

double ramp(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

bool inside(double x, double low, double high) { return x >= low && x < high; }

// Where a ray from the eye meets the room, and the wall there, pointing inwards.
struct WallHit {
  Vec3 point, normal;
  double distance = 0;
};

WallHit hit_room(const Vec3& d) {
  WallHit hit{{}, {}, 1e9};
  const auto wall = [&](double component, double low, double high, const Vec3& axis) {
    if (component == 0) return;
    const double distance = (component > 0 ? high : low) / component;
    if (distance < hit.distance) {
      hit.distance = distance;
      hit.normal = axis * (component > 0 ? -1.0 : 1.0);
    }
  };
  wall(d.x, kLow.x, kHigh.x, {1, 0, 0});
  wall(d.y, kLow.y, kHigh.y, {0, 1, 0});
  wall(d.z, kLow.z, kHigh.z, {0, 0, 1});
  hit.point = d * hit.distance;
  return hit;
}

struct Surface {
  RgbD albedo;
  RgbD emission;
};

RgbD sky_at_dusk(const Vec3& d) {
  const double height = std::clamp(d.y * 2.2 + 0.35, 0.0, 1.0);
  return RgbD{21.0, 14.5, 9.8} * (1 - height) + RgbD{10.0, 14.0, 22.0} * height;
}

// Three tall windows with bars.
Surface window_wall(const Vec3& p, const Vec3& d, const RgbD& wall) {
  for (const double middle : {-3.9, -0.9, 2.1}) {
    const double across = p.z - middle;
    if (std::abs(across) > 0.62 || !inside(p.y, -0.5, 2.2)) continue;
    const bool frame = std::abs(across) > 0.55 || p.y < -0.42 || p.y > 2.12;
    const bool bar =
        std::abs(across) < 0.025 || std::abs(p.y - 0.4) < 0.025 || std::abs(p.y - 1.3) < 0.025;
    if (frame || bar) return {{0.10, 0.08, 0.06}, {}};
    // Roofs and trees stand before the sky.
    const double skyline =
        -0.05 + 0.22 * value_noise({p.z * 3.1, 7.7, 0}) + 0.05 * value_noise({p.z * 19.0, 1.2, 0});
    if (p.y < skyline) return {{}, {0.16, 0.15, 0.17}};
    return {{}, sky_at_dusk(d)};
  }
  return {wall, {}};
}

// A framed picture: soft blobs of a few paints, the same for the same seed.
Surface painting(double u, double v, std::uint64_t seed) {
  const double edge = std::max(std::abs(u), std::abs(v));
  if (edge > 0.94) return {{0.40, 0.27, 0.08}, {}};
  if (edge > 0.90) return {{0.05, 0.04, 0.03}, {}};
  Random random(seed);
  RgbD paint{random.between(0.05, 0.75), random.between(0.05, 0.60), random.between(0.05, 0.65)};
  for (int i = 0; i < 9; ++i) {
    const double x = random.between(-0.9, 0.9), y = random.between(-0.9, 0.9);
    const double radius = random.between(0.12, 0.55);
    const RgbD other{random.between(0.02, 0.9), random.between(0.02, 0.7),
                     random.between(0.02, 0.8)};
    const double t = ramp(radius, radius * 0.8, std::hypot(u - x, v - y));
    paint = paint * (1 - t) + other * t;
  }
  return {paint * (1 + 0.15 * fractal_noise({u * 14, v * 14, static_cast<double>(seed % 97)}, 3)),
          {}};
}

Surface surface_at(const WallHit& hit, const Vec3& d, std::uint64_t seed) {
  const Vec3& p = hit.point;
  const double grain = fractal_noise(p * 3.0, 5);
  const RgbD wall = RgbD{0.145, 0.115, 0.110} * (1 + 0.13 * grain);
  const auto picture = [&](double u, double v, std::uint64_t which) {
    return painting(u, v, mix_bits(seed + 10 * which));
  };

  if (hit.normal.y > 0) {  // the floor: planks along z, each of its own brown
    const double plank = std::floor(p.x / 0.16);
    const double tone =
        1 + 0.30 * value_noise({plank * 1.7, 3.3, std::floor(p.z / 1.9 + 0.37 * plank)});
    const bool gap = p.x / 0.16 - plank < 0.04;
    const double fibre = 1 + 0.18 * fractal_noise({p.x * 30, 0, p.z * 2}, 3);
    if (std::abs(p.x) < 1.6 && std::abs(p.z + 0.4) < 2.3) {  // a red rug with a border
      const bool border = std::abs(p.x) > 1.42 || std::abs(p.z + 0.4) > 2.12;
      const double weave = 1 + 0.2 * std::sin(p.x * 24) * std::sin(p.z * 24);
      return {(border ? RgbD{0.42, 0.30, 0.14} : RgbD{0.30, 0.045, 0.035}) * weave, {}};
    }
    return {RgbD{0.24, 0.145, 0.080} * (gap ? 0.25 : tone * fibre), {}};
  }
  if (hit.normal.y < 0) {  // the ceiling: beams across
    const bool beam = std::abs(p.z - 2.0 * std::round(p.z / 2.0)) < 0.14;
    return {beam ? RgbD{0.10, 0.065, 0.04} * (1 + 0.2 * grain) : RgbD{0.36, 0.34, 0.31}, {}};
  }
  if (p.y < -1.25) return {{0.06, 0.05, 0.045}, {}};  // skirting
  if (hit.normal.x > 0) return window_wall(p, d, wall);
  if (hit.normal.x < 0) {  // right: a lit doorway and two pictures
    if (inside(p.z, -0.75, 0.25) && p.y < 0.75) {
      const bool frame = p.z < -0.67 || p.z > 0.17 || p.y > 0.67;
      if (frame) return {{0.30, 0.28, 0.25}, {}};
      const double depth = 0.75 + 0.25 * std::sin(3 * p.y + 1);
      return {{}, RgbD{4.2, 2.85, 1.55} * depth};
    }
    if (inside(p.z, -4.6, -2.2) && inside(p.y, -0.4, 1.3)) {
      return picture((p.z + 3.4) / 1.2, (p.y - 0.45) / 0.85, 1);
    }
    if (inside(p.z, 1.4, 3.2) && inside(p.y, -0.3, 1.2)) {
      return picture((p.z - 2.3) / 0.9, (p.y - 0.45) / 0.75, 2);
    }
    return {wall, {}};
  }
  if (hit.normal.z > 0) {  // front: three pictures over a panelled dado
    for (int i = 0; i < 3; ++i) {
      const double middle = -3.1 + 2.75 * i;
      if (std::abs(p.x - middle) < 1.05 && inside(p.y, -0.2, 1.6)) {
        return picture((p.x - middle) / 1.05, (p.y - 0.7) / 0.9, 3 + static_cast<std::uint64_t>(i));
      }
    }
    const double panel = p.x - 0.8 * std::floor(p.x / 0.8);
    if (p.y < -0.45) return {RgbD{0.17, 0.10, 0.06} * (panel < 0.06 ? 0.4 : 1 + 0.15 * grain), {}};
    return {RgbD{0.075, 0.115, 0.125} * (1 + 0.13 * grain), {}};
  }
  // Back: shelves of books.
  if (std::abs(p.x + 0.3) < 2.9 && p.y < 1.7) {
    const double shelf = (p.y + 1.25) / 0.37, row = std::floor(shelf);
    if (shelf - row < 0.09) return {{0.14, 0.085, 0.05}, {}};
    const double book = std::floor(p.x / 0.052);
    Random random(mix_bits(static_cast<std::uint64_t>(static_cast<std::int64_t>(book) + 4096)) +
                  static_cast<std::uint64_t>(row));
    const double height = random.between(0.62, 0.96);
    if (shelf - row > height) return {{0.03, 0.022, 0.018}, {}};
    return {{random.between(0.05, 0.5), random.between(0.03, 0.28), random.between(0.03, 0.26)},
            {}};
  }
  return {wall, {}};
}

// What the walls receive: each lamp as a small sphere (it has its apparent size from the eye), and
// the windows as one broad source on their wall. No shadows: nothing stands in the room.
RgbD irradiance(const WallHit& hit) {
  RgbD sum{0.16, 0.15, 0.145};
  for (const Lamp& lamp : kLamps) {
    const Vec3 to_lamp = lamp.place - hit.point;
    const double square = dot(to_lamp, to_lamp) + 0.08;  // soft where a lamp nearly touches a wall
    const double cosine = std::max(0.0, dot(to_lamp, hit.normal)) / std::sqrt(square);
    const double radius = length(lamp.place) * std::tan(lamp.diameter * kPi / 360);
    sum += lamp.radiance * (kPi * radius * radius * cosine / square);
  }
  const Vec3 to_window = Vec3{kLow.x, 0.8, -0.9} - hit.point;
  const double square = dot(to_window, to_window) + 3.0;
  const double facing = std::max(0.0, -to_window.x) / std::sqrt(square);
  const double cosine = std::max(0.0, dot(to_window, hit.normal)) / std::sqrt(square);
  return sum + RgbD{14.0, 14.0, 15.3} * (8.0 * facing * cosine / square);
}

}  // namespace

EnvironmentModel make_gallery(std::uint64_t seed) {
  EnvironmentModel model;
  for (const Lamp& lamp : kLamps) {
    model.discs.push_back({normalize(lamp.place), lamp.diameter * kPi / 360, lamp.radiance});
  }
  model.smooth = [seed](const Vec3& direction) {
    const WallHit hit = hit_room(direction);
    const Surface surface = surface_at(hit, direction, seed);
    RgbD light = surface.emission + surface.albedo * irradiance(hit) * (1 / kPi);
    // The shades of the lamps glow a little around the bulbs.
    for (const Lamp& lamp : kLamps) {
      const Vec3 chord = direction - normalize(lamp.place);
      const double widths = std::sqrt(dot(chord, chord)) / (lamp.diameter * kPi / 360);
      if (widths < 6) light += lamp.radiance * (0.0016 * std::exp(-0.5 * widths));
    }
    return light;
  };
  return model;
}

}  // namespace haarlight::data_gen
