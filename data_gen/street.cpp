// A street with lamps, after Overbeck et al. 2006, Figures 11 and 12.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "data_gen/mesh_builder.h"
#include "data_gen/random.h"
#include "data_gen/scenes.h"

namespace haarlight::data_gen {
namespace {

constexpr double kHalfLength = 7;  // along x
constexpr double kKerb = 0.13, kRoadSide = 2.3, kFront = -4.6, kNear = 4.5;
constexpr double kGroundCell = 0.077;  // shadows are as sharp as vertices are near

int cells(double size, double cell) {
  return std::max(1, static_cast<int>(std::lround(size / cell)));
}

// A parallelogram of even cells; the outside is where s x t points.
void add_sheet(MeshBuilder& builder, std::uint32_t material, const Vec3& corner, const Vec3& s,
               const Vec3& t, double cell) {
  builder.add_grid(material, cells(length(s), cell), cells(length(t), cell),
                   [=](double a, double b) { return corner + s * a + t * b; });
}

// A box of even cells without its bottom, which lies on something.
void add_block(MeshBuilder& builder, std::uint32_t material, const Vec3& low, const Vec3& high,
               double cell) {
  const Vec3 x{high.x - low.x, 0, 0}, y{0, high.y - low.y, 0}, z{0, 0, high.z - low.z};
  add_sheet(builder, material, low + y, z, x, cell);  // top
  add_sheet(builder, material, low + z, x, y, cell);  // front
  add_sheet(builder, material, low, y, x, cell);      // back
  add_sheet(builder, material, low, z, y, cell);      // left
  add_sheet(builder, material, low + x, y, z, cell);  // right
}

// The same profile with points at most `step` apart in height.
std::vector<ProfilePoint> fine_profile(const std::vector<ProfilePoint>& coarse, double step) {
  std::vector<ProfilePoint> fine{coarse.front()};
  for (std::size_t i = 1; i < coarse.size(); ++i) {
    const ProfilePoint a = coarse[i - 1], b = coarse[i];
    const int parts =
        std::max(1, static_cast<int>(std::ceil(std::abs(b.height - a.height) / step)));
    for (int k = 1; k <= parts; ++k) {
      const double share = static_cast<double>(k) / parts;
      fine.push_back(
          {a.radius + share * (b.radius - a.radius), a.height + share * (b.height - a.height)});
    }
  }
  return fine;
}

struct Metals {
  std::uint32_t iron, brass, globe;
};

// A cast post with a lantern of four bars around an opal globe.
void add_lamp(MeshBuilder& builder, const Metals& metals, const Vec3& foot, double turn) {
  constexpr int kAround = 17;
  const auto post = fine_profile({{0.19, 0.0},
                                  {0.19, 0.10},
                                  {0.13, 0.16},
                                  {0.11, 0.55},
                                  {0.13, 0.60},
                                  {0.13, 0.64},
                                  {0.065, 0.74},
                                  {0.05, 1.7},
                                  {0.075, 1.74},
                                  {0.075, 1.80},
                                  {0.048, 1.86},
                                  {0.038, 2.62},
                                  {0.09, 2.72}},
                                 0.14);
  builder.add_lathe(metals.iron, foot, post, kAround);
  const std::array plate{ProfilePoint{0.09, 2.72}, ProfilePoint{0.15, 2.76},
                         ProfilePoint{0.15, 2.79}, ProfilePoint{0.0, 2.79}};
  builder.add_lathe(metals.iron, foot, plate, kAround);
  const auto roof =
      fine_profile({{0.0, 3.26}, {0.27, 3.26}, {0.27, 3.29}, {0.14, 3.42}, {0.03, 3.52}}, 0.06);
  builder.add_lathe(metals.iron, foot, roof, kAround);
  builder.add_ellipsoid(metals.brass, foot + Vec3{0, 3.575, 0}, {0.06, 0.075, 0.06}, 16);
  builder.add_ellipsoid(metals.globe, foot + Vec3{0, 2.98, 0}, {0.125, 0.165, 0.125}, 24);
  for (int bar = 0; bar < 4; ++bar) {
    const double angle = turn + bar * kPi / 2;
    std::vector<Vec3> path;
    std::vector<double> radii;
    for (int i = 0; i <= 5; ++i) {
      const double share = i / 5.0, out = 0.14 + 0.11 * share;
      path.push_back(foot +
                     Vec3{out * std::cos(angle), 2.78 + 0.49 * share, out * std::sin(angle)});
      radii.push_back(0.012);
    }
    builder.add_tube(metals.iron, path, radii, 8);
  }
}

void add_bollard(MeshBuilder& builder, std::uint32_t iron, const Vec3& foot) {
  const auto profile = fine_profile({{0.085, 0.0},
                                     {0.085, 0.06},
                                     {0.06, 0.10},
                                     {0.052, 0.62},
                                     {0.075, 0.66},
                                     {0.075, 0.70},
                                     {0.05, 0.76},
                                     {0.0, 0.80}},
                                    0.12);
  builder.add_lathe(iron, foot, profile, 16);
}

// A rendered wall with a plinth, a cornice, framed windows and a door.
void add_front(MeshBuilder& builder, std::uint32_t wall, std::uint32_t stone, std::uint32_t pane,
               std::uint32_t wood) {
  const double top = 4.3, z = kFront;
  add_sheet(builder, wall, {-kHalfLength, kKerb, z}, {2 * kHalfLength, 0, 0}, {0, top - kKerb, 0},
            0.18);
  add_block(builder, stone, {-kHalfLength, kKerb, z}, {kHalfLength, 0.55, z + 0.07}, 0.2);
  add_block(builder, stone, {-kHalfLength, top - 0.12, z}, {kHalfLength, top + 0.12, z + 0.22},
            0.2);
  for (int i = 0; i < 6; ++i) {
    const double x = -5.75 + 2.3 * i;
    if (i == 3) {  // the door, two steps up
      add_block(builder, stone, {x - 0.75, kKerb, z}, {x + 0.75, 0.27, z + 0.55}, 0.15);
      add_block(builder, wood, {x - 0.48, 0.27, z}, {x + 0.48, 2.5, z + 0.05}, 0.15);
      add_block(builder, stone, {x - 0.62, 2.5, z}, {x + 0.62, 2.68, z + 0.2}, 0.12);
      add_block(builder, stone, {x - 0.62, 0.27, z}, {x - 0.48, 2.5, z + 0.12}, 0.12);
      add_block(builder, stone, {x + 0.48, 0.27, z}, {x + 0.62, 2.5, z + 0.12}, 0.12);
      continue;
    }
    const double low = 1.25, high = 2.95;
    add_block(builder, pane, {x - 0.45, low, z}, {x + 0.45, high, z + 0.03}, 0.15);
    add_block(builder, stone, {x - 0.62, low - 0.1, z}, {x + 0.62, low, z + 0.18}, 0.12);
    add_block(builder, stone, {x - 0.58, high, z}, {x + 0.58, high + 0.14, z + 0.12}, 0.12);
    add_block(builder, stone, {x - 0.55, low, z}, {x - 0.45, high, z + 0.09}, 0.15);
    add_block(builder, stone, {x + 0.45, low, z}, {x + 0.55, high, z + 0.09}, 0.15);
    add_block(builder, wood, {x - 0.03, low, z + 0.03}, {x + 0.03, high, z + 0.06}, 0.2);
  }
}

}  // namespace

Scene make_street(std::uint64_t seed) {
  Random random(seed);
  MeshBuilder builder;
  const auto asphalt = builder.add_material("asphalt", {0.30f, 0.30f, 0.31f});
  const auto paving = builder.add_material("paving", {0.55f, 0.52f, 0.48f});
  const auto kerb = builder.add_material("kerb", {0.62f, 0.61f, 0.58f});
  const auto wall = builder.add_material("render", {0.72f, 0.60f, 0.44f});
  const auto stone = builder.add_material("stone", {0.66f, 0.63f, 0.58f});
  const auto wood =
      builder.add_material("green paint", {0.09f, 0.22f, 0.15f}, {0.08f, 0.08f, 0.08f}, 24);
  const auto pane = builder.add_material("pane", {0.05f, 0.06f, 0.08f}, {0.22f, 0.22f, 0.22f}, 24);
  // Fairly sharp: half of a highlight lies within 12 degrees.
  const Metals metals{
      builder.add_material("iron", {0.035f, 0.045f, 0.045f}, {0.42f, 0.43f, 0.45f}, 30),
      builder.add_material("brass", {0.16f, 0.10f, 0.03f}, {0.62f, 0.46f, 0.20f}, 30),
      builder.add_material("opal glass", {0.58f, 0.56f, 0.52f}, {0.30f, 0.30f, 0.30f}, 30)};

  const Vec3 along{2 * kHalfLength, 0, 0};
  const auto floor = [&](std::uint32_t material, double y, double from, double to) {
    add_sheet(builder, material, {-kHalfLength, y, from}, {0, 0, to - from}, along, kGroundCell);
  };
  floor(asphalt, 0, -kRoadSide, kRoadSide);
  for (const double side : {-1.0, 1.0}) {
    const double edge = side * kRoadSide, stone_end = edge + side * 0.16;
    const double end = side < 0 ? kFront : kNear;
    floor(kerb, kKerb, std::min(edge, stone_end), std::max(edge, stone_end));
    floor(paving, kKerb, std::min(stone_end, end), std::max(stone_end, end));
    // The face of the kerb looks at the road.
    const Vec3 up{0, kKerb, 0}, foot{-kHalfLength, 0, edge};
    if (side < 0) {
      add_sheet(builder, kerb, foot, along, up, kGroundCell);
    } else {
      add_sheet(builder, kerb, foot, up, along, kGroundCell);
    }
  }
  add_front(builder, wall, stone, pane, wood);

  for (const double x : {-4.6, 0.0, 4.6}) {
    add_lamp(builder, metals, {x, kKerb, -kRoadSide - 0.5}, random.between(0, kPi / 2));
  }
  for (const double x : {-2.3, 2.3}) {
    add_lamp(builder, metals, {x, kKerb, kRoadSide + 0.5}, random.between(0, kPi / 2));
  }
  for (const double x : {-4.9, -3.6, -1.0, 1.0, 3.6, 4.9}) {
    add_bollard(builder, metals.iron, {x, kKerb, kRoadSide + 0.4});
  }
  return builder.finish(look_at({5.2, 3.3, 8.6}, {-0.5, 1.05, -0.9}, 0.66, 640, 400));
}

}  // namespace haarlight::data_gen
