// A kite in a room. After Gautron and others 2007, section 6.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "data_gen/animation_parts.h"
#include "data_gen/animation_scenes.h"
#include "data_gen/furniture.h"

namespace haarlight::data_gen {
namespace {

// Half widths and heights of the cloth, metres.
constexpr double kHalf = 0.42, kUp = 0.34, kDown = 0.66;

Image cloth_picture() {
  constexpr int kSize = 128;
  Image image(kSize, kSize);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      const double u = (x + 0.5) / kSize - 0.5, v = (y + 0.5) / kSize - 0.34;
      const bool left = u < 0, upper = v < 0;
      Rgb c = left == upper ? Rgb{0.80f, 0.10f, 0.06f} : Rgb{0.85f, 0.62f, 0.08f};
      const double away = std::hypot(u, v);
      if (away < 0.17) c = {0.85f, 0.85f, 0.80f};
      if (away < 0.11) c = {0.08f, 0.25f, 0.65f};
      if (std::abs(u) < 0.012 || std::abs(v) < 0.012) c = {0.10f, 0.07f, 0.05f};
      image.at(x, y) = c;
    }
  }
  return image;
}

// The kite about the crossing of its spars, in the plane z = 0, its tail hanging; `sine` and
// `cosine` of a wave that runs down cloth and tail.
Scene kite(double sine, double cosine) {
  MeshBuilder b;
  Material look;
  look.name = "kite cloth", look.albedo = {1, 1, 1};
  look.texture = b.add_texture(cloth_picture());
  const auto cloth = b.add_material(look);
  const auto spar = b.add_material("spar", {0.40f, 0.26f, 0.12f});
  const auto bow = b.add_material("bow", {0.10f, 0.42f, 0.62f});
  const auto wave = [&](double y, double size) {
    return size * (sine * std::sin(9 * y) + cosine * std::cos(9 * y));
  };
  const auto bulge = [&](double x, double y) {
    const double edge = std::abs(x) / kHalf + (y > 0 ? y / kUp : -y / kDown);
    return 0.05 * (1 - edge * edge) + wave(y, 0.025 * (1 - 0.5 * edge) * std::abs(x) / kHalf);
  };
  const auto sheet = [&](double s, double t, double side) {
    const double y = -kDown + (kUp + kDown) * t;
    const double half = kHalf * (y > 0 ? 1 - y / kUp : 1 + y / kDown);
    const double x = half * (2 * s - 1);
    return Vec3{x * side, y, bulge(x, y) + 0.001 * side};
  };
  constexpr int kColumns = 44, kRows = 50;
  b.add_grid(cloth, kColumns, kRows, [&](double s, double t) { return sheet(s, t, 1); });
  b.add_grid(cloth, kColumns, kRows, [&](double s, double t) { return sheet(s, t, -1); });
  const std::array spine{Vec3{0, -kDown, -0.01}, Vec3{0, kUp, -0.01}};
  const std::array cross_spar{Vec3{-kHalf, 0, -0.01}, Vec3{kHalf, 0, -0.01}};
  const std::array thin{0.006, 0.006};
  b.add_tube(spar, spine, thin, 8);
  b.add_tube(spar, cross_spar, thin, 8);
  // The tail, and bows on it.
  std::vector<Vec3> path;
  std::vector<double> radii;
  constexpr int kPieces = 80;
  for (int i = 0; i <= kPieces; ++i) {
    const double down = static_cast<double>(i) / kPieces;
    const double y = -kDown - 1.1 * down;
    path.push_back({wave(0.7 * y, 0.12 * down), y, wave(0.7 * y + 0.4, 0.10 * down)});
    radii.push_back(0.004);
  }
  b.add_tube(spar, path, radii, 6);
  for (int i = 1; i <= 6; ++i) {
    const Vec3 at = path[static_cast<std::size_t>(i * kPieces / 6)];
    for (const double side : {-1.0, 1.0}) {
      b.add_ellipsoid(bow, at + Vec3{0.045 * side, 0.005, 0}, {0.045, 0.026, 0.009}, 20);
    }
  }
  Scene scene = finished(b);
  // The picture hangs on the cloth at rest; shapes of the wave keep the rest's coordinates.
  for (std::size_t v = 0; v < scene.position.size(); ++v) {
    const Vec3& p = scene.position[v];
    scene.uv[v] = {static_cast<float>((p.x / kHalf + 1) / 2),
                   static_cast<float>((p.y + kDown) / (kUp + kDown))};
  }
  return scene;
}

Scene room() {
  MeshBuilder b;
  const auto textured = [&](const char* name, const Image& picture) {
    Material m;
    m.name = name, m.albedo = {1, 1, 1}, m.texture = b.add_texture(picture);
    return b.add_material(m);
  };
  const auto floor = textured("boards", board_picture(3));
  const auto paper = textured("wall paper", paper_picture());
  const auto white = b.add_material("ceiling", {0.80f, 0.79f, 0.76f});
  const auto wood = b.add_material("skirting", {0.75f, 0.73f, 0.70f});
  const double x = 2.4, z = 2, h = 2.7;
  b.add_quad(floor, {-x, 0, z}, {x, 0, z}, {x, 0, -z}, {-x, 0, -z}, {6, 3});
  b.add_quad(white, {-x, h, -z}, {x, h, -z}, {x, h, z}, {-x, h, z});
  const auto wall = [&](const Vec3& from, const Vec3& to) {
    const auto repeats = static_cast<float>(length(to - from) / 0.5);
    b.add_quad(paper, from, to, to + Vec3{0, h, 0}, from + Vec3{0, h, 0}, {repeats, 5.4f});
    const Vec3 in = normalize(cross({0, 1, 0}, to - from)) * -0.02;
    b.add_quad(wood, from + in, to + in, to + in + Vec3{0, 0.1, 0}, from + in + Vec3{0, 0.1, 0});
  };
  wall({-x, 0, -z}, {x, 0, -z});
  wall({x, 0, -z}, {x, 0, z});
  wall({x, 0, z}, {-x, 0, z});
  wall({-x, 0, z}, {-x, 0, -z});
  return finished(b);
}

Scene rug() {
  MeshBuilder b;
  Material m;
  m.name = "rug", m.albedo = {1, 1, 1}, m.texture = b.add_texture(rug_picture());
  b.add_quad(b.add_material(m), {-0.9, 0.008, 0.6}, {0.9, 0.008, 0.6}, {0.9, 0.008, -0.6},
             {-0.9, 0.008, -0.6}, {1, 1});
  return finished(b);
}

}  // namespace

void add_flying_kite(AnimatedWriter& writer) {
  add_still(writer, "room", writer.add_body(room()));
  add_still(writer, "rug", writer.add_body(rug()), {0.1, 0, -0.5});
  add_still(writer, "chair", writer.add_body(make_chair()), {-1.55, 0, -1.2}, 0.7);
  add_still(writer, "table", writer.add_body(make_low_table()), {1.5, 0, -1.3}, -0.1);
  add_still(writer, "vase", writer.add_body(make_vase()), {1.65, 0.45, -1.35});
  add_still(writer, "books", writer.add_body(make_books(4, 5)), {1.22, 0.45, -1.25}, 0.5);
  const std::array morphs{kite(1, 0), kite(0, 1)};
  const auto body = add_still(writer, "kite", writer.add_body(kite(0, 0), morphs));
  add_lamp(writer, {-0.4, 1.1, 0.9}, 3);
  writer.add_camera_node(look_at({0.3, 1.45, 1.9}, {-0.05, 1.3, -2}, 1.15, 512, 384));
  constexpr int kPieces = 256;
  writer.animate(body, "weights", kAnimationSeconds, kPieces, [](double t) {
    const double w = 2 * kPi * t / 1.6;
    return std::vector{std::cos(w), -std::sin(w)};
  });
  // It comes down from below the ceiling past the lamp, and rises again.
  const auto along = [](double t) { return 2 * kPi * t / kAnimationSeconds; };
  writer.animate(body, "translation", kAnimationSeconds, kPieces, [&](double t) {
    const double a = along(t);
    return std::vector{0.95 * std::sin(a), 1.95 - 0.22 * (1 - std::cos(a)) + 0.05 * std::sin(5 * a),
                       -0.75 - 0.4 * std::cos(a)};
  });
  writer.animate(body, "rotation", kAnimationSeconds, kPieces, [&](double t) {
    const double a = along(t);
    const auto y = turn({0, 1, 0}, 0.7 * std::sin(a)), z = turn({0, 0, 1}, -0.5 * std::cos(a));
    return std::vector{y[1] * z[2], y[1] * z[3], y[3] * z[2], y[3] * z[3]};  // y after z
  });
}

}  // namespace haarlight::data_gen
