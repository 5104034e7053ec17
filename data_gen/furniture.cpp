// Furniture for rooms that move.

#include "data_gen/furniture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "data_gen/animation_parts.h"
#include "data_gen/noise.h"
#include "data_gen/scenes.h"

namespace haarlight::data_gen {
namespace {

constexpr Rgb kOak{0.50f, 0.31f, 0.15f}, kBrass{0.75f, 0.55f, 0.25f}, kSteel{0.55f, 0.56f, 0.58f},
    kDark{0.045f, 0.045f, 0.05f};

double signed_power(double x, double e) { return std::copysign(std::pow(std::abs(x), e), x); }

std::uint32_t add_metal(MeshBuilder& builder, const std::string& name, const Rgb& color,
                        float roughness) {
  Material m;
  m.name = name, m.model = SurfaceModel::metallic_roughness;
  m.albedo = color, m.metallic = 1, m.roughness = roughness;
  return builder.add_material(m);
}

// A turned leg from y = 0 to `height`.
void add_leg(MeshBuilder& builder, std::uint32_t wood, const Vec3& foot, double height,
             double radius) {
  constexpr int kRings = 16;
  std::vector<ProfilePoint> profile;
  for (int i = 0; i <= kRings; ++i) {
    const double t = static_cast<double>(i) / kRings;
    const double swell = 0.65 + 0.35 * t + 0.18 * std::sin(5 * kPi * t);
    profile.push_back({radius * swell, height * t});
  }
  builder.add_lathe(wood, foot, profile, 16);
}

void add_rod(MeshBuilder& builder, std::uint32_t material, const Vec3& a, const Vec3& b,
             double radius, int sides = 12) {
  const std::array path{a, b};
  const std::array radii{radius, radius};
  builder.add_tube(material, path, radii, sides);
}

Rgb book_color(Random& random) {
  static constexpr std::array kColors{Rgb{0.45f, 0.06f, 0.05f}, Rgb{0.06f, 0.16f, 0.35f},
                                      Rgb{0.07f, 0.26f, 0.13f}, Rgb{0.62f, 0.45f, 0.14f},
                                      Rgb{0.25f, 0.08f, 0.22f}, Rgb{0.66f, 0.61f, 0.50f},
                                      Rgb{0.10f, 0.09f, 0.08f}, Rgb{0.55f, 0.22f, 0.07f}};
  return kColors[static_cast<std::size_t>(random.below(static_cast<int>(kColors.size())))];
}

// A lying or standing book: a cover round a block of pages, the spine towards +Z.
void add_book(MeshBuilder& builder, std::uint32_t cover, std::uint32_t pages, const Vec3& base,
              const Vec3& size, double radians) {
  builder.add_box(pages, base + Vec3{0, 0.003, 0}, size - Vec3{0.004, 0.006, 0.006}, radians);
  const Vec3 across = rotation_y(radians) * Vec3{1, 0, 0};
  const bool lies = size.y < size.x;
  if (lies) {
    builder.add_box(cover, base, {size.x, 0.003, size.z}, radians);
    builder.add_box(cover, base + Vec3{0, size.y - 0.003, 0}, {size.x, 0.003, size.z}, radians);
  } else {
    const Vec3 side = across * (size.x / 2 - 0.0015);
    builder.add_box(cover, base + side, {0.003, size.y, size.z}, radians);
    builder.add_box(cover, base - side, {0.003, size.y, size.z}, radians);
  }
  const Vec3 out = rotation_y(radians) * Vec3{0, 0, size.z / 2 - 0.002};
  builder.add_box(cover, base + out, {size.x, size.y, 0.004}, radians);
}

}  // namespace

void add_block(MeshBuilder& builder, std::uint32_t material, const Vec3& low, const Vec3& high) {
  builder.add_box(material, {(low.x + high.x) / 2, low.y, (low.z + high.z) / 2}, high - low);
}

void add_cushion(MeshBuilder& builder, std::uint32_t material, const Vec3& center, const Vec3& half,
                 double round, int segments) {
  builder.add_grid(
      material, segments, segments / 2,
      [&](double s, double t) {
        const double around = 2 * kPi * s, up = kPi * (t - 0.5);
        const double ring = t == 0 || t == 1 ? 0 : signed_power(std::cos(up), round);
        const double height = t == 0 ? -1 : t == 1 ? 1 : signed_power(std::sin(up), round);
        return center + Vec3{half.x * ring * signed_power(std::sin(around), round), half.y * height,
                             half.z * ring * signed_power(std::cos(around), round)};
      },
      true);
}

Image board_picture(std::uint64_t seed) {
  constexpr int kSize = 128, kBoards = 4;
  Image image(kSize, kSize);
  Random random(seed);
  std::array<double, 2 * kBoards> shade{};
  for (double& s : shade) s = random.between(0.75, 1.15);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const int board = x * kBoards / kSize;
      const int joint = board % 2 == 0 ? 0 : kSize / 2;
      const bool far_half = (y + joint) % kSize >= kSize / 2;
      const double grain = fractal_noise({x * 0.35 + 31 * board, y * 0.03, 4.0}, 3);
      double v = shade[static_cast<std::size_t>(2 * board + (far_half ? 1 : 0))] + 0.22 * grain;
      if (x * kBoards % kSize < kBoards || (y + joint) % (kSize / 2) == 0) v *= 0.45;
      const auto w = static_cast<float>(std::clamp(v, 0.1, 1.4));
      image.at(x, y) = Rgb{0.46f, 0.29f, 0.15f} * w;
    }
  }
  return image;
}

Image paper_picture() {
  constexpr int kSize = 64;
  Image image(kSize, kSize);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double u = 2 * kPi * x / kSize, v = 2 * kPi * y / kSize;
      const double leaf = std::sin(u) * std::sin(v) + 0.5 * std::sin(2 * u + std::sin(v));
      const bool printed = leaf > 0.55;
      image.at(x, y) = printed ? Rgb{0.55f, 0.62f, 0.48f} : Rgb{0.74f, 0.71f, 0.62f};
    }
  }
  return image;
}

Image rug_picture() {
  constexpr int kSize = 128;
  Image image(kSize, kSize);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double u = std::abs(2.0 * x / kSize - 1), v = std::abs(2.0 * y / kSize - 1);
      const double edge = std::max(u, v), star = u + v;
      Rgb c{0.45f, 0.07f, 0.06f};
      if (edge > 0.93)
        c = {0.12f, 0.10f, 0.20f};
      else if (edge > 0.80)
        c = (x / 4 + y / 4) % 2 ? Rgb{0.66f, 0.52f, 0.30f} : Rgb{0.12f, 0.14f, 0.28f};
      else if (std::fmod(star, 0.4) < 0.08)
        c = {0.68f, 0.56f, 0.36f};
      else if (star < 0.4)
        c = {0.13f, 0.15f, 0.32f};
      image.at(x, y) = c;
    }
  }
  return image;
}

Scene make_chair() {
  MeshBuilder b;
  const auto wood = b.add_material("chair wood", {0.32f, 0.17f, 0.08f}, {0.03f, 0.03f, 0.03f}, 40);
  const auto cloth = b.add_material("seat", {0.14f, 0.25f, 0.30f});
  for (const double x : {-0.19, 0.19}) {
    add_leg(b, wood, {x, 0, 0.18}, 0.42, 0.024);
    add_leg(b, wood, {x, 0, -0.18}, 0.42, 0.024);
    add_rod(b, wood, {x, 0.42, -0.19}, {x, 0.92, -0.25}, 0.017);
    add_rod(b, wood, {x, 0.16, -0.18}, {x, 0.16, 0.18}, 0.011);
  }
  add_cushion(b, wood, {0, 0.425, 0}, {0.225, 0.018, 0.215}, 0.3, 24);
  add_cushion(b, cloth, {0, 0.455, 0.005}, {0.2, 0.03, 0.19}, 0.5, 32);
  for (int i = -2; i <= 2; ++i) {
    add_rod(b, wood, {0.07 * i, 0.43, -0.195}, {0.07 * i, 0.86, -0.245}, 0.009);
  }
  add_cushion(b, wood, {0, 0.89, -0.248}, {0.225, 0.045, 0.016}, 0.4, 24);
  return finished(b);
}

Scene make_office_chair() {
  MeshBuilder b;
  const auto metal = add_metal(b, "chrome", kSteel, 0.25f);
  const auto plastic = b.add_material("black plastic", kDark, {0.04f, 0.04f, 0.04f}, 30);
  const auto cloth = b.add_material("blue cloth", {0.08f, 0.16f, 0.42f});
  for (int i = 0; i < 5; ++i) {
    const double a = 2 * kPi * i / 5;
    const Vec3 way{std::sin(a), 0, std::cos(a)};
    add_rod(b, metal, Vec3{0, 0.11, 0}, way * 0.27 + Vec3{0, 0.07, 0}, 0.018);
    b.add_ellipsoid(plastic, way * 0.27 + Vec3{0, 0.033, 0}, {0.032, 0.032, 0.032}, 24);
  }
  add_rod(b, metal, {0, 0.08, 0}, {0, 0.42, 0}, 0.025, 24);
  add_cushion(b, plastic, {0, 0.415, 0}, {0.2, 0.02, 0.2}, 0.5, 24);
  add_cushion(b, cloth, {0, 0.46, 0.01}, {0.24, 0.045, 0.235}, 0.45, 40);
  add_rod(b, metal, {0, 0.42, -0.2}, {0, 0.66, -0.27}, 0.016);
  add_cushion(b, cloth, {0, 0.80, -0.27}, {0.21, 0.2, 0.04}, 0.5, 40);
  for (const double x : {-0.27, 0.27}) {
    add_rod(b, metal, {x * 0.85, 0.42, 0}, {x, 0.64, 0}, 0.012);
    add_cushion(b, plastic, {x, 0.655, 0.02}, {0.03, 0.016, 0.14}, 0.5, 24);
  }
  return finished(b);
}

Scene make_desk() {
  MeshBuilder b;
  const auto wood = b.add_material("desk wood", kOak, {0.04f, 0.04f, 0.04f}, 60);
  const auto brass = add_metal(b, "brass", kBrass, 0.3f);
  add_cushion(b, wood, {0, 0.72, 0}, {0.7, 0.02, 0.35}, 0.12, 40);
  for (const double z : {-0.3, 0.3}) add_leg(b, wood, {-0.63, 0, z}, 0.70, 0.032);
  add_block(b, wood, {0.28, 0.08, -0.32}, {0.66, 0.70, 0.30});
  for (int i = 0; i < 3; ++i) {
    const double y = 0.11 + 0.2 * i;
    add_block(b, wood, {0.30, y, 0.30}, {0.64, y + 0.17, 0.315});
    b.add_ellipsoid(brass, {0.47, y + 0.085, 0.33}, {0.018, 0.018, 0.018}, 24);
  }
  for (const double x : {0.31, 0.63}) {
    for (const double z : {-0.29, 0.27})
      add_block(b, wood, {x - 0.02, 0, z - 0.02}, {x + 0.02, 0.08, z + 0.02});
  }
  add_block(b, wood, {-0.6, 0.35, -0.31}, {0.28, 0.70, -0.29});
  return finished(b);
}

Scene make_low_table() {
  MeshBuilder b;
  const auto wood = b.add_material("table wood", {0.36f, 0.19f, 0.09f}, {0.05f, 0.05f, 0.05f}, 80);
  add_cushion(b, wood, {0, 0.43, 0}, {0.55, 0.02, 0.35}, 0.25, 48);
  for (const double x : {-0.46, 0.46}) {
    for (const double z : {-0.27, 0.27}) add_leg(b, wood, {x, 0, z}, 0.42, 0.035);
  }
  return finished(b);
}

Scene make_sofa() {
  MeshBuilder b;
  const auto cloth = b.add_material("sofa cloth", {0.30f, 0.33f, 0.24f});
  const auto pillow = b.add_material("pillow", {0.68f, 0.36f, 0.10f});
  const auto foot = b.add_material("sofa foot", {0.10f, 0.06f, 0.03f});
  add_cushion(b, cloth, {0, 0.24, 0}, {1.0, 0.15, 0.42}, 0.2, 48);
  for (const double x : {-0.46, 0.46}) {
    add_cushion(b, cloth, {x, 0.44, 0.05}, {0.45, 0.085, 0.36}, 0.35, 64);
    add_cushion(b, cloth, {x, 0.66, -0.29}, {0.45, 0.24, 0.11}, 0.4, 64);
  }
  for (const double x : {-1.03, 1.03})
    add_cushion(b, cloth, {x, 0.36, 0}, {0.12, 0.29, 0.42}, 0.35, 56);
  add_cushion(b, pillow, {-0.62, 0.66, -0.10}, {0.2, 0.19, 0.07}, 0.6, 48);
  add_cushion(b, pillow, {0.66, 0.66, -0.10}, {0.2, 0.19, 0.07}, 0.6, 48);
  for (const double x : {-0.9, 0.9}) {
    for (const double z : {-0.33, 0.33}) add_leg(b, foot, {x, 0, z}, 0.1, 0.03);
  }
  return finished(b);
}

Scene make_bookshelf(std::uint64_t seed) {
  MeshBuilder b;
  Random random(seed);
  const auto wood = b.add_material("shelf wood", {0.42f, 0.26f, 0.13f});
  const auto pages = b.add_material("pages", {0.72f, 0.68f, 0.58f});
  std::vector<std::uint32_t> covers;
  for (int i = 0; i < 8; ++i) covers.push_back(b.add_material("cover", book_color(random)));
  constexpr double kHalf = 0.5, kDeep = 0.15, kTop = 1.9;
  for (const double x : {-kHalf, kHalf - 0.025})
    add_block(b, wood, {x, 0, -kDeep}, {x + 0.025, kTop, kDeep});
  add_block(b, wood, {-kHalf + 0.025, 0, -kDeep}, {kHalf - 0.025, kTop, -kDeep + 0.012});
  constexpr int kBoards = 5;
  for (int i = 0; i <= kBoards; ++i) {
    const double y = (kTop - 0.025) * i / kBoards;
    add_block(b, wood, {-kHalf + 0.025, y, -kDeep + 0.012}, {kHalf - 0.025, y + 0.025, kDeep});
    if (i == kBoards) break;
    for (double x = -kHalf + 0.03; x < kHalf - 0.09;) {
      if (random.uniform() < 0.06) x += random.between(0.04, 0.12);
      const double thick = random.between(0.018, 0.05), deep = random.between(0.16, 0.23);
      if (x + thick > kHalf - 0.03) break;
      const double height = random.between(0.2, 0.32);
      const auto cover = covers[static_cast<std::size_t>(random.below(8))];
      add_book(b, cover, pages, {x + thick / 2, y + 0.025, kDeep - 0.02 - deep / 2},
               {thick, height, deep}, 0);
      x += thick + 0.002;
    }
  }
  return finished(b);
}

Scene make_monitor() {
  MeshBuilder b;
  const auto plastic = b.add_material("screen case", kDark, {0.04f, 0.04f, 0.04f}, 60);
  Material shown;
  shown.name = "screen";
  shown.albedo = {1, 1, 1};
  Image picture(32, 20);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 32; ++x) {
      const bool line = y > 3 && y % 3 == 0 && x > 2 && x < 8 + (y * 7) % 20;
      picture.at(x, y) = y < 3  ? Rgb{0.15f, 0.3f, 0.6f}
                         : line ? Rgb{0.2f, 0.2f, 0.25f}
                                : Rgb{0.75f, 0.78f, 0.8f};
    }
  }
  shown.texture = b.add_texture(picture);
  const auto screen = b.add_material(shown);
  add_cushion(b, plastic, {0, 0.32, -0.1}, {0.275, 0.17, 0.02}, 0.15, 40);
  b.add_quad(screen, {-0.255, 0.165, -0.078}, {0.255, 0.165, -0.078}, {0.255, 0.475, -0.078},
             {-0.255, 0.475, -0.078}, {1, 1});
  add_rod(b, plastic, {0, 0.01, -0.12}, {0, 0.25, -0.12}, 0.025, 24);
  add_cushion(b, plastic, {0, 0.008, -0.12}, {0.13, 0.008, 0.09}, 0.6, 32);
  add_cushion(b, plastic, {0, 0.012, 0.14}, {0.21, 0.011, 0.075}, 0.15, 32);
  const auto keys = b.add_material("keys", {0.5f, 0.5f, 0.5f});
  for (int row = 0; row < 5; ++row) {
    for (int i = 0; i < 14; ++i) {
      b.add_box(keys, {-0.19 + 0.029 * i, 0.021, 0.09 + 0.025 * row}, {0.022, 0.006, 0.019});
    }
  }
  return finished(b);
}

Scene make_books(int count, std::uint64_t seed) {
  MeshBuilder b;
  Random random(seed);
  const auto pages = b.add_material("pages", {0.72f, 0.68f, 0.58f});
  double y = 0;
  for (int i = 0; i < count; ++i) {
    const auto cover = b.add_material("cover", book_color(random));
    const double thick = random.between(0.02, 0.045);
    add_book(b, cover, pages, {0, y, 0},
             {random.between(0.2, 0.26), thick, random.between(0.15, 0.19)},
             random.between(-0.3, 0.3));
    y += thick + 0.0005;
  }
  return finished(b);
}

Scene make_mug() {
  MeshBuilder b;
  const auto china = b.add_material("mug", {0.68f, 0.14f, 0.10f}, {0.04f, 0.04f, 0.04f}, 200);
  const std::array profile{ProfilePoint{0, 0},         ProfilePoint{0.036, 0},
                           ProfilePoint{0.04, 0.004},  ProfilePoint{0.04, 0.095},
                           ProfilePoint{0.038, 0.097}, ProfilePoint{0.036, 0.095},
                           ProfilePoint{0.036, 0.006}, ProfilePoint{0, 0.006}};
  b.add_lathe(china, {0, 0, 0}, profile, 48);
  std::vector<Vec3> path;
  std::vector<double> radii;
  for (int i = 0; i <= 16; ++i) {
    const double a = kPi * (i / 16.0 - 0.5);
    path.push_back({0.038 + 0.027 * std::cos(a), 0.05 + 0.03 * std::sin(a), 0});
    radii.push_back(0.0055);
  }
  b.add_tube(china, path, radii, 12);
  return finished(b);
}

Scene make_vase() {
  MeshBuilder b;
  const auto china = b.add_material("vase", {0.16f, 0.30f, 0.52f}, {0.05f, 0.05f, 0.05f}, 200);
  b.add_grid(
      china, 64, 48,
      [](double s, double t) {
        // Up the outside, over the rim and down the inside.
        const double up = t < 0.8 ? t / 0.8 : 1 - (t - 0.8);
        const double wall = t < 0.8 ? 0 : 0.006;
        double r = 0.06 + 0.055 * std::sin(kPi * std::pow(up, 0.8)) - 0.03 * up * up - wall;
        if (t == 0) r = 0;
        const double a = 2 * kPi * s;
        return Vec3{r * std::sin(a), 0.34 * up, r * std::cos(a)};
      },
      true);
  return finished(b);
}

Scene make_fruit_bowl() {
  MeshBuilder b;
  const auto wood = b.add_material("bowl", {0.24f, 0.13f, 0.06f}, {0.05f, 0.05f, 0.05f}, 60);
  const auto orange = b.add_material("orange", {0.75f, 0.28f, 0.03f}, {0.04f, 0.04f, 0.04f}, 30);
  const auto apple = b.add_material("apple", {0.45f, 0.07f, 0.05f}, {0.04f, 0.04f, 0.04f}, 120);
  const std::array bowl{
      ProfilePoint{0, 0},         ProfilePoint{0.06, 0},     ProfilePoint{0.07, 0.01},
      ProfilePoint{0.13, 0.05},   ProfilePoint{0.16, 0.09},  ProfilePoint{0.155, 0.092},
      ProfilePoint{0.125, 0.055}, ProfilePoint{0.06, 0.016}, ProfilePoint{0, 0.015}};
  b.add_lathe(wood, {0, 0, 0}, bowl, 64);
  const std::array<Vec3, 7> places{Vec3{0.055, 0.06, 0.02},  Vec3{-0.05, 0.06, 0.04},
                                   Vec3{0.0, 0.06, -0.06},   Vec3{0.085, 0.1, -0.05},
                                   Vec3{-0.085, 0.1, -0.03}, Vec3{0.01, 0.105, 0.085},
                                   Vec3{0.0, 0.12, 0.0}};
  for (std::size_t i = 0; i < places.size(); ++i) {
    b.add_ellipsoid(i % 2 ? apple : orange, places[i], {0.042, 0.039, 0.042}, 32);
  }
  return finished(b);
}

Scene make_curtains(double width, double height) {
  MeshBuilder b;
  const auto cloth = b.add_material("curtain", {0.62f, 0.55f, 0.40f});
  const auto brass = add_metal(b, "curtain rail", kBrass, 0.35f);
  for (const double side : {-1.0, 1.0}) {
    const auto fold = [&](double s, double t) {
      const double gather = 0.16 * width + 0.03 * std::sin(3 * t);
      const double x = side * (width / 2 + 0.06) - side * gather * s;
      return Vec3{x, height * t, 0.03 * std::sin(2 * kPi * 5 * s + 0.5 * std::sin(4 * t)) + 0.05};
    };
    if (side > 0) {
      b.add_grid(cloth, 80, 24, [&](double s, double t) { return fold(1 - s, t); });
    } else {
      b.add_grid(cloth, 80, 24, fold);
    }
  }
  add_rod(b, brass, {-width / 2 - 0.12, height + 0.02, 0.05},
          {width / 2 + 0.12, height + 0.02, 0.05}, 0.012, 16);
  return finished(b);
}

Scene make_potted_plant() {
  Scene plant = make_plant(1);
  const std::set<std::string> around{"ground", "plaster", "coping", "pebble", "dry leaf"};
  std::erase_if(plant.triangle, [&](const Triangle& t) {
    return around.contains(plant.material[t.material].name);
  });
  return plant;
}

}  // namespace haarlight::data_gen
