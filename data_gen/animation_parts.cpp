// What scenes that move have in common.

#include "data_gen/animation_parts.h"

#include <cmath>

namespace haarlight::data_gen {

Scene finished(MeshBuilder& builder) { return builder.finish(Camera()); }

Scene quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  MeshBuilder builder;
  builder.add_quad(builder.add_material("", {1, 1, 1}), a, b, c, d);
  return finished(builder);
}

void add_box_room(AnimatedWriter& writer) {
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

void add_box_camera(AnimatedWriter& writer) {
  writer.add_camera_node(look_at({0, 1, 0.97}, {0, 0.9, -0.6}, 1.2, 512, 384));
}

std::size_t add_lamp(AnimatedWriter& writer, const Vec3& place, double intensity) {
  const auto light = writer.add_point_light({1.0f, 0.95f, 0.85f}, intensity);
  nlohmann::json node{{"name", "lamp"}, {"translation", {place.x, place.y, place.z}}};
  node["extensions"]["KHR_lights_punctual"]["light"] = light;
  return writer.add_node(node);
}

std::vector<double> turn(const Vec3& axis, double radians) {
  const double s = std::sin(radians / 2);
  return {axis.x * s, axis.y * s, axis.z * s, std::cos(radians / 2)};
}

std::size_t add_still(AnimatedWriter& writer, const char* name, std::size_t mesh, const Vec3& place,
                      double radians, double scale) {
  nlohmann::json node{{"name", name}, {"mesh", mesh}, {"translation", {place.x, place.y, place.z}}};
  if (radians != 0) node["rotation"] = turn({0, 1, 0}, radians);
  if (scale != 1) node["scale"] = {scale, scale, scale};
  return writer.add_node(node);
}

}  // namespace haarlight::data_gen
