// Furnished rooms in which something moves. The interior is as large as the Japanese Interior of
// Gautron and others 2007, section 6; desk and office are after Debattista and others 2009.

#include <array>
#include <cmath>
#include <vector>

#include "data_gen/animation_parts.h"
#include "data_gen/animation_scenes.h"
#include "data_gen/figures.h"
#include "data_gen/furniture.h"

namespace haarlight::data_gen {
namespace {

using nlohmann::json;

struct RoomLook {
  Vec3 half;  // half width, height, half depth
  Rgb wall, accent;
  double door = 0;  // width of an opening in the back wall at x = 0.9, 2.05 m high; 0: none
};

Scene shell(const RoomLook& look) {
  MeshBuilder b;
  Material boards;
  boards.name = "boards", boards.albedo = {1, 1, 1},
  boards.texture = b.add_texture(board_picture(9));
  const auto floor = b.add_material(boards);
  const auto wall = b.add_material("wall", look.wall);
  const auto accent = b.add_material("accent wall", look.accent);
  const auto white = b.add_material("white paint", {0.80f, 0.79f, 0.77f});
  const double x = look.half.x, h = look.half.y, z = look.half.z;
  b.add_quad(floor, {-x, 0, z}, {x, 0, z}, {x, 0, -z}, {-x, 0, -z}, {6, 3});
  b.add_quad(white, {-x, h, -z}, {x, h, -z}, {x, h, z}, {-x, h, z});
  b.add_quad(accent, {-x, 0, z}, {-x, 0, -z}, {-x, h, -z}, {-x, h, z});
  b.add_quad(wall, {x, 0, -z}, {x, 0, z}, {x, h, z}, {x, h, -z});
  b.add_quad(wall, {x, 0, z}, {-x, 0, z}, {-x, h, z}, {x, h, z});
  const double from = 0.9 - look.door / 2, to = 0.9 + look.door / 2, top = 2.05;
  if (look.door > 0) {
    b.add_quad(wall, {-x, 0, -z}, {from, 0, -z}, {from, h, -z}, {-x, h, -z});
    b.add_quad(wall, {to, 0, -z}, {x, 0, -z}, {x, h, -z}, {to, h, -z});
    b.add_quad(wall, {from, top, -z}, {to, top, -z}, {to, h, -z}, {from, h, -z});
    add_block(b, white, {from - 0.06, 0, -z - 0.15}, {from, top + 0.06, -z + 0.02});
    add_block(b, white, {to, 0, -z - 0.15}, {to + 0.06, top + 0.06, -z + 0.02});
    add_block(b, white, {from, top, -z - 0.15}, {to, top + 0.06, -z + 0.02});
  } else {
    b.add_quad(wall, {-x, 0, -z}, {x, 0, -z}, {x, h, -z}, {-x, h, -z});
  }
  for (const double side : {-1.0, 1.0}) {
    add_block(b, white, {side * x - 0.012, 0, -z}, {side * x + 0.012, 0.09, z});
  }
  return finished(b);
}

Scene rug(double width, double depth, int rows) {
  MeshBuilder b;
  Material m;
  m.name = "rug", m.albedo = {1, 1, 1}, m.texture = b.add_texture(rug_picture());
  // Pile: small humps.
  b.add_grid(b.add_material(m), rows * 3 / 2, rows, [&](double s, double t) {
    const double hump = 0.003 * std::sin(90 * s) * std::sin(60 * t);
    return Vec3{width * (s - 0.5), 0.012 + hump, -depth * (t - 0.5)};
  });
  Scene scene = finished(b);
  for (std::size_t v = 0; v < scene.position.size(); ++v) {
    scene.uv[v] = {static_cast<float>(scene.position[v].x / width + 0.5),
                   static_cast<float>(0.5 - scene.position[v].z / depth)};
  }
  return scene;
}

// A shade of paper about a point light, open above and below, that hangs from y = 0.
Scene lantern(double drop) {
  MeshBuilder b;
  const auto paper = b.add_material("lamp shade", {0.82f, 0.74f, 0.56f});
  const auto cord = b.add_material("cord", {0.05f, 0.05f, 0.05f});
  const auto wall = [&](double s, double t, double scale) {
    const double rib = 1 + 0.03 * std::cos(2 * kPi * 24 * s);
    const double r = scale * rib * (0.13 + 0.14 * (1 - t));
    const double a = 2 * kPi * s;
    return Vec3{r * std::sin(a), -drop - 0.08 + 0.24 * t, r * std::cos(a)};
  };
  b.add_grid(
      paper, 96, 10, [&](double s, double t) { return wall(s, t, 1); }, true);
  b.add_grid(
      paper, 96, 10, [&](double s, double t) { return wall(1 - s, t, 0.985); }, true);
  const std::array path{Vec3{0, 0, 0}, Vec3{0, -drop + 0.16, 0}};
  const std::array radii{0.006, 0.006};
  b.add_tube(cord, path, radii, 8);
  return finished(b);
}

// A lamp that swings about where it hangs, its light with it.
void add_swinging_lamp(AnimatedWriter& writer, const Scene& body, const Vec3& hook,
                       const Vec3& light_place, double intensity, double swing, double period) {
  const auto light = writer.add_point_light({1.0f, 0.90f, 0.74f}, intensity);
  json bulb{{"name", "bulb"}, {"translation", {light_place.x, light_place.y, light_place.z}}};
  bulb["extensions"]["KHR_lights_punctual"]["light"] = light;
  const auto child = writer.add_node(bulb);
  const auto node = writer.add_node({{"name", "lamp"},
                                     {"mesh", writer.add_body(body)},
                                     {"translation", {hook.x, hook.y, hook.z}},
                                     {"children", {child}}});
  writer.animate(node, "rotation", kAnimationSeconds, 256, [&](double t) {
    return turn({0, 0, 1}, swing * std::sin(2 * kPi * t / period));
  });
}

// A desk lamp's arm and head above its joint at the origin; the bulb is at (0.2, 0.2, 0).
Scene desk_lamp_head() {
  MeshBuilder b;
  const auto paint = b.add_material("lamp paint", {0.08f, 0.30f, 0.20f}, {0.04f, 0.04f, 0.04f}, 60);
  const std::array arm{Vec3{0, 0, 0}, Vec3{0.08, 0.24, 0}, Vec3{0.2, 0.3, 0}};
  const std::array radii{0.009, 0.009, 0.009};
  b.add_tube(paint, arm, radii, 12);
  const auto shade = [&](double s, double t, double scale) {
    const double r = scale * (0.03 + 0.075 * (1 - t)), a = 2 * kPi * s;
    return Vec3{0.2 + r * std::sin(a), 0.17 + 0.13 * t, r * std::cos(a)};
  };
  b.add_grid(
      paint, 64, 8, [&](double s, double t) { return shade(s, t, 1); }, true);
  b.add_grid(
      paint, 64, 8, [&](double s, double t) { return shade(1 - s, t, 0.97); }, true);
  return finished(b);
}

Scene desk_lamp_foot() {
  MeshBuilder b;
  const auto paint = b.add_material("lamp paint", {0.08f, 0.30f, 0.20f}, {0.04f, 0.04f, 0.04f}, 60);
  b.add_lathe(paint, {0, 0, 0},
              std::array{ProfilePoint{0, 0}, ProfilePoint{0.09, 0}, ProfilePoint{0.09, 0.012},
                         ProfilePoint{0.03, 0.03}, ProfilePoint{0.014, 0.05},
                         ProfilePoint{0.014, 0.2}, ProfilePoint{0, 0.2}},
              48);
  return finished(b);
}

Scene blinds(double width, double height) {
  MeshBuilder b;
  const auto slat = b.add_material("blinds", {0.75f, 0.74f, 0.70f});
  const int count = static_cast<int>(height / 0.07);
  for (int i = 0; i < count; ++i) {
    const double y = height * (i + 0.5) / count;
    b.add_grid(slat, 12, 4, [&](double s, double t) {
      const double arch = 0.008 * (1 - 4 * (t - 0.5) * (t - 0.5));
      return Vec3{width * (s - 0.5), y + arch + 0.05 * (t - 0.5), 0.06 * (0.5 - t)};
    });
  }
  return finished(b);
}

// Moves a node to and fro along a line: out and back `times` times.
void push(AnimatedWriter& writer, std::size_t node, const Vec3& from, const Vec3& way, int times) {
  writer.animate(node, "translation", kAnimationSeconds, 256, [&](double t) {
    const double u = 0.5 - 0.5 * std::cos(2 * kPi * times * t / kAnimationSeconds);
    const Vec3 p = from + way * u;
    return std::vector{p.x, p.y, p.z};
  });
}

}  // namespace

void add_interior(AnimatedWriter& writer) {
  const RoomLook look{{2.6, 2.7, 2.2}, {0.72f, 0.66f, 0.55f}, {0.24f, 0.36f, 0.34f}, 1.0};
  add_still(writer, "room", writer.add_body(shell(look)));
  add_still(writer, "rug", writer.add_body(rug(2.4, 1.6, 64)), {-0.3, 0, -0.2});
  add_still(writer, "sofa", writer.add_body(make_sofa()), {-2.05, 0, -0.35}, kPi / 2);
  add_still(writer, "table", writer.add_body(make_low_table()), {-0.55, 0.012, -0.35}, kPi / 2);
  add_still(writer, "fruit", writer.add_body(make_fruit_bowl()), {-0.55, 0.45, -0.15});
  add_still(writer, "books", writer.add_body(make_books(4, 8)), {-0.6, 0.45, -0.72}, 0.4);
  for (int i = 0; i < 2; ++i) {
    add_still(writer, "shelf", writer.add_body(make_bookshelf(static_cast<std::uint64_t>(20 + i))),
              {-1.75 + 1.02 * i, 0, -2.03});
  }
  const auto chair = writer.add_body(make_chair());
  add_still(writer, "chair", chair, {1.75, 0, -0.75}, -1.1);
  add_still(writer, "chair", chair, {1.85, 0, 0.45}, -1.9);
  add_still(writer, "plant", writer.add_body(make_potted_plant()), {2.1, 0, -1.65}, 0.4, 1.2);
  add_still(writer, "curtains", writer.add_body(make_curtains(1.6, 2.2)), {-2.55, 0.1, -1.45},
            kPi / 2);
  const auto marble = writer.add_material("marble", {0.75f, 0.74f, 0.70f});
  add_still(writer, "statue", writer.add_mesh(make_statue(80), marble), {-1.75, 1.9, -2.0}, 0.3,
            0.45);
  const auto vase = writer.add_body(make_vase());
  add_still(writer, "vase", vase, {-0.75, 1.9, -2.0});
  add_still(writer, "vase", vase, {-0.25, 0, -1.95}, 0, 1.7);

  // Behind the sliding door lies a bright garden.
  const auto sky = writer.add_material("daylight", {0, 0, 0}, 0, 1, {2.2f, 2.6f, 3.2f});
  const auto path = writer.add_material("path", {0.45f, 0.43f, 0.38f});
  add_still(writer, "path",
            writer.add_mesh(
                quad({0, -0.02, -2.2}, {1.8, -0.02, -2.2}, {1.8, -0.02, -3.12}, {0, -0.02, -3.12}),
                path));
  add_still(writer, "daylight",
            writer.add_mesh(
                quad({0.2, 0, -3.1}, {1.6, 0, -3.1}, {1.6, 2.4, -3.1}, {0.2, 2.4, -3.1}), sky));
  MeshBuilder builder;
  const auto frame = builder.add_material("door frame", {0.22f, 0.11f, 0.05f});
  const auto paper = builder.add_material("door paper", {0.80f, 0.78f, 0.72f});
  add_block(builder, paper, {-0.5, 0.02, -0.006}, {0.5, 2.04, 0.006});
  for (int i = 0; i <= 4; ++i) {
    const double x = -0.5 + 0.25 * i;
    add_block(builder, frame, {x - 0.015, 0.01, -0.018}, {x + 0.015, 2.05, 0.018});
  }
  for (int i = 0; i <= 6; ++i) {
    const double y = 0.025 + 0.333 * i;
    add_block(builder, frame, {-0.51, y - 0.015, -0.016}, {0.51, y + 0.015, 0.016});
  }
  const Vec3 shut{0.9, 0, -2.17};
  const auto door = add_still(writer, "door", writer.add_body(finished(builder)), shut);
  push(writer, door, shut, {-0.95, 0, 0}, 1);
  add_swinging_lamp(writer, lantern(0.75), {0.1, 2.69, -0.1}, {0, -0.74, 0}, 4.5, 0.22, 4);
  writer.add_camera_node(look_at({1.7, 1.6, 2.05}, {-0.5, 0.95, -1.1}, 1.05, 512, 384));
}

void add_desk(AnimatedWriter& writer) {
  const RoomLook look{{1.7, 2.5, 1.6}, {0.70f, 0.67f, 0.60f}, {0.30f, 0.40f, 0.55f}, 0};
  add_still(writer, "room", writer.add_body(shell(look)));
  const Vec3 desk{0, 0, -1.15};
  add_still(writer, "desk", writer.add_body(make_desk()), desk);
  const Vec3 top = desk + Vec3{0, 0.741, 0};
  add_still(writer, "screen", writer.add_body(make_monitor()), top + Vec3{0.1, 0, -0.05}, -0.15);
  add_still(writer, "shelf", writer.add_body(make_bookshelf(31)), {-1.15, 0, -1.44});
  add_still(writer, "plant", writer.add_body(make_vase()), top + Vec3{0.55, 0, -0.15});
  add_still(writer, "lamp foot", writer.add_body(desk_lamp_foot()), top + Vec3{-0.5, 0, -0.12});
  const auto mug = add_still(writer, "mug", writer.add_body(make_mug()));
  push(writer, mug, top + Vec3{-0.3, 0, 0.22}, {0.75, 0, 0.02}, 2);
  const auto books = add_still(writer, "books", writer.add_body(make_books(3, 12)), {}, 0.2);
  push(writer, books, top + Vec3{-0.53, 0, 0.17}, {0.12, 0, 0}, 2);
  const auto chair = add_still(writer, "chair", writer.add_body(make_office_chair()), {}, 2.8);
  push(writer, chair, {0.75, 0, -0.35}, {-1.3, 0, 0.1}, 1);
  add_swinging_lamp(writer, desk_lamp_head(), top + Vec3{-0.5, 0.19, -0.12}, {0.2, 0.2, 0}, 1.3,
                    0.25, 3.2);
  // The ceiling's light is a panel.
  const auto shine = writer.add_material("panel", {0, 0, 0}, 0, 1, {5, 4.8f, 4.4f});
  add_still(
      writer, "panel",
      writer.add_mesh(
          quad({-0.3, 2.49, -0.3}, {0.3, 2.49, -0.3}, {0.3, 2.49, 0.3}, {-0.3, 2.49, 0.3}), shine));
  writer.add_camera_node(look_at({1.0, 1.65, 1.5}, {-0.1, 0.75, -1.1}, 0.95, 512, 384));
}

void add_office(AnimatedWriter& writer) {
  const RoomLook look{{3.2, 2.7, 2.6}, {0.72f, 0.71f, 0.68f}, {0.58f, 0.62f, 0.60f}, 0};
  add_still(writer, "room", writer.add_body(shell(look)));
  const auto desk = writer.add_body(make_desk()), screen = writer.add_body(make_monitor());
  const auto chair = writer.add_body(make_office_chair()), mug = writer.add_body(make_mug());
  for (int i = 0; i < 4; ++i) {
    const double x = i % 2 ? 1.1 : -1.3, z = i / 2 ? 0.3 : -1.7;
    const double facing = i / 2 ? 0.12 : -0.08;
    add_still(writer, "desk", desk, {x, 0, z}, facing);
    add_still(writer, "screen", screen, {x - 0.05, 0.741, z - 0.03}, facing + 0.1);
    add_still(writer, "books",
              writer.add_body(make_books(2 + i, static_cast<std::uint64_t>(40 + i))),
              {x + 0.45, 0.741, z - 0.05}, 0.3 * i);
    add_still(writer, "mug", mug, {x - 0.45, 0.741, z + 0.15}, 1.0 * i);
    if (i != 0) add_still(writer, "chair", chair, {x + 0.1, 0, z + 0.7}, kPi + 0.4 * (i - 2));
  }
  const auto rolling = add_still(writer, "rolling chair", chair, {}, 2.6);
  push(writer, rolling, {-1.3, 0, -0.95}, {2.3, 0, 0.15}, 2);
  for (int i = 0; i < 3; ++i) {
    add_still(writer, "shelf", writer.add_body(make_bookshelf(static_cast<std::uint64_t>(50 + i))),
              {-3.03, 0, -1.9 + 1.02 * i}, kPi / 2);
  }
  const auto slats = writer.add_body(blinds(1.8, 1.3));
  const auto sky = writer.add_material("daylight", {0, 0, 0}, 0, 1, {2.4f, 2.7f, 3.2f});
  const auto window =
      writer.add_mesh(quad({-0.9, 0, 0}, {0.9, 0, 0}, {0.9, 1.3, 0}, {-0.9, 1.3, 0}), sky);
  for (const double x : {-1.4, 1.1}) {
    add_still(writer, "window", window, {x, 0.95, -2.59});
    add_still(writer, "blinds", slats, {x, 0.95, -2.52});
  }
  add_still(writer, "plant", writer.add_body(make_vase()), {2.7, 0, -2.2}, 0, 2);
  add_swinging_lamp(writer, lantern(0.5), {0.1, 2.69, -0.3}, {0, -0.49, 0}, 6, 0.15, 4);
  writer.add_camera_node(look_at({2.9, 1.75, 2.45}, {-0.6, 0.8, -1.0}, 1.0, 512, 384));
}

}  // namespace haarlight::data_gen
