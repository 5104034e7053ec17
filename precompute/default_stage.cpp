// What a bare mesh lacks to make a picture: a ground to stand on and a camera.

#include "precompute/default_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"

namespace haarlight {
namespace {

struct Bounds {
  Vec3 low, high;
  Vec3 middle() const { return (low + high) * 0.5; }
  Vec3 size() const { return high - low; }
  double footprint() const { return size().x * size().z; }
};

Bounds bounds_of(const Scene& scene) {
  if (scene.triangle.empty()) {
    throw Error(ErrorKind::missing,
                fmt::format("{}: no triangles, expected at least one", scene.name));
  }
  constexpr double kMax = std::numeric_limits<double>::max();
  Bounds b{{kMax, kMax, kMax}, {-kMax, -kMax, -kMax}};
  for (const Triangle& t : scene.triangle) {
    for (const std::uint32_t v : t.vertex) {
      const Vec3& p = scene.position[v];
      b.low = {std::min(b.low.x, p.x), std::min(b.low.y, p.y), std::min(b.low.z, p.z)};
      b.high = {std::max(b.high.x, p.x), std::max(b.high.y, p.y), std::max(b.high.z, p.z)};
    }
  }
  return b;
}

// Area of nearly horizontal triangles facing up (or down) within 5 % of the height from the bottom
// (or top), seen from above.
double level_area(const Scene& scene, const Bounds& bounds, bool floor) {
  const double band = 0.05 * bounds.size().y;
  double area = 0;
  for (const Triangle& t : scene.triangle) {
    const Vec3 &a = scene.position[t.vertex[0]], &b = scene.position[t.vertex[1]],
               &c = scene.position[t.vertex[2]];
    const Vec3 across = cross(b - a, c - a);
    const double up = floor ? across.y : -across.y;
    if (up < 0.95 * length(across)) continue;
    const double far = floor ? std::max({a.y, b.y, c.y}) - bounds.low.y
                             : bounds.high.y - std::min({a.y, b.y, c.y});
    if (far <= band) area += 0.5 * up;
  }
  return area;
}

bool has_floor(const Scene& scene, const Bounds& bounds) {
  return level_area(scene, bounds, true) >= 0.5 * bounds.footprint() && bounds.footprint() > 0;
}

bool is_room(const Scene& scene, const Bounds& bounds) {
  return has_floor(scene, bounds) && level_area(scene, bounds, false) >= 0.5 * bounds.footprint();
}

void add_ground(Scene& scene, const Bounds& bounds, const StageOptions& options) {
  const double width = std::max(bounds.size().x, bounds.size().z);
  // A scene without any width (a wall seen edge-on) still gets a ground to stand on.
  const double half = 0.5 * options.ground_size * (width > 0 ? width : bounds.size().y);
  const Vec3 m = bounds.middle();
  const auto first = static_cast<std::uint32_t>(scene.position.size());
  for (const auto& [x, z] : {std::array{-1, -1}, {-1, 1}, {1, 1}, {1, -1}}) {
    scene.position.push_back({m.x + x * half, bounds.low.y, m.z + z * half});
    scene.normal.push_back({0, 1, 0});
    scene.uv.push_back({0, 0});
    if (!scene.uv2.empty()) scene.uv2.push_back({0, 0});
    if (!scene.tint.empty()) scene.tint.push_back({1, 1, 1});
  }
  Material material;
  material.name = "ground";
  material.albedo = options.ground_albedo;
  const auto number = static_cast<std::uint32_t>(scene.material.size());
  scene.material.push_back(material);
  scene.triangle.push_back({{first, first + 1, first + 2}, number});
  scene.triangle.push_back({{first, first + 2, first + 3}, number});
}

}  // namespace

bool needs_ground(const Scene& scene) {
  return !scene.camera && !has_floor(scene, bounds_of(scene));
}

Camera framing_camera(const Scene& scene, int width, int height) {
  const Bounds bounds = bounds_of(scene);
  const Vec3 middle = bounds.middle();
  double radius = 0;
  for (const Triangle& t : scene.triangle) {
    for (const std::uint32_t v : t.vertex) {
      radius = std::max(radius, length(scene.position[v] - middle));
    }
  }
  const double degree = kPi / 180;
  const bool room = is_room(scene, bounds);
  const double turn = room ? 0 : 30 * degree, rise = room ? 0 : 20 * degree;
  const double fov = 35 * degree;
  // The narrower field of view has to hold the sphere.
  const double half = std::atan(std::tan(0.5 * fov) * std::min(1.0, double(width) / height));
  const double distance = 1.02 * radius / std::sin(half);
  const Vec3 towards{std::sin(turn) * std::cos(rise), std::sin(rise),
                     std::cos(turn) * std::cos(rise)};
  return look_at(middle + distance * towards, middle, fov, width, height);
}

Stage set_stage(Scene& scene, const StageOptions& options) {
  if (!(options.ground_size > 0) || !std::isfinite(options.ground_size)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("ground size is {}, expected a value above 0", options.ground_size));
  }
  if (options.width < 1 || options.height < 1) {
    throw Error(
        ErrorKind::invalid_argument,
        fmt::format("picture size is {}x{}, expected at least 1x1", options.width, options.height));
  }
  Stage stage;
  if (scene.camera && options.use_scene_camera) {
    stage.camera = *scene.camera;
    stage.camera.width = options.width;
    stage.camera.height = options.height;
  } else {
    stage.camera = framing_camera(scene, options.width, options.height);
    stage.camera_made = true;
  }
  stage.ground_added = options.ground == GroundMode::on ||
                       (options.ground == GroundMode::automatic && needs_ground(scene));
  if (stage.ground_added) add_ground(scene, bounds_of(scene), options);
  return stage;
}

}  // namespace haarlight
