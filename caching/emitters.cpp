// Where the paths of virtual lights begin.

#include "caching/emitters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "precompute/bsdf.h"

namespace haarlight {
namespace {

std::pair<Vec3, Vec3> across(const Vec3& w) {
  const Vec3 other = std::abs(w.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 t = normalize(cross(other, w));
  return {t, cross(w, t)};
}

// Through a disc that all of the scene stands behind.
PathStart through_disc(const MovingVisibility& scene, const Vec3& direction, const RgbD& irradiance,
                       double s, double t) {
  const double metres = 1 / scene.scale(), radius = scene.reach();
  const auto [x, y] = across(direction);
  const double r = radius * std::sqrt(s), angle = 2 * kPi * t;
  const Vec3 from =
      direction * (-2 * radius) + x * (r * std::cos(angle)) + y * (r * std::sin(angle));
  return {from, direction, irradiance * (kPi * radius * radius * metres * metres)};
}

PathStart lamp_start(const MovingVisibility& scene, const SceneLight& lamp,
                     const std::array<double, 4>& number) {
  const auto [u, v, s, t] = number;
  if (lamp.kind == SceneLight::Kind::directional) {
    return through_disc(scene, lamp.direction, lamp.intensity, s, t);
  }
  const Vec3 from = scene.to_local(lamp.position);
  if (lamp.kind == SceneLight::Kind::point) {
    return {from, even_direction(u, v), lamp.intensity * (4 * kPi)};
  }
  // Evenly within the cone of a spot, weighted by what it sends there.
  const double least = std::cos(lamp.outer), cosine = 1 - u * (1 - least);
  const double r = std::sqrt(std::max(1 - cosine * cosine, 0.0)), angle = 2 * kPi * v;
  const auto [x, y] = across(lamp.direction);
  const Vec3 way = lamp.direction * cosine + x * (r * std::cos(angle)) + y * (r * std::sin(angle));
  SceneLight unit = lamp;
  unit.position = {0, 0, 0};
  const LightArrival a = light_at(unit, way);
  return {from, normalize(way), a.irradiance * (2 * kPi * (1 - least))};
}

}  // namespace

Vec3 even_direction(double u, double v) {
  const double y = 1 - 2 * u, r = std::sqrt(std::max(1 - y * y, 0.0)), angle = 2 * kPi * v;
  return {r * std::cos(angle), y, r * std::sin(angle)};
}

std::vector<Emitter> shining_materials(const MovingVisibility& scene) {
  const AnimatedFrame& frame = scene.frame();
  std::vector<Emitter> by_material(frame.emission.size());
  for (std::uint32_t t = 0; t < frame.scene.triangle.size(); ++t) {
    const std::uint32_t m = frame.scene.triangle[t].material;
    if (!(l1_norm(frame.emission[m].radiance) > 0)) continue;
    const auto [a, b, c] = scene.corners(t);
    const double area = 0.5 * length(cross(b - a, c - a));
    if (!(area > 0)) continue;
    by_material[m].triangle.push_back(t);
    by_material[m].area.add(area);
    by_material[m].radiance = frame.emission[m].radiance;
    by_material[m].both_sides = frame.emission[m].both_sides;
  }
  std::erase_if(by_material, [](const Emitter& e) { return e.triangle.empty(); });
  return by_material;
}

std::vector<Emitter> emitters(const MovingVisibility& scene) {
  const AnimatedFrame& frame = scene.frame();
  std::vector<Emitter> all;
  for (const SceneLight& lamp : frame.light) {
    Emitter& e = all.emplace_back();
    e.lamp.push_back(lamp), e.power.add(1);
  }
  if (std::vector<SceneLight> suns = frame.suns(); !suns.empty()) {
    Emitter& e = all.emplace_back();
    for (const SceneLight& sun : suns) e.power.add(luminance(sun.intensity));
    e.lamp = std::move(suns);
  }
  std::ranges::move(shining_materials(scene), std::back_inserter(all));
  if (l1_norm(frame.background) > 0 || frame.environment) all.emplace_back();
  return all;
}

std::pair<Vec3, Vec3> place_on(const MovingVisibility& scene, const Emitter& material,
                               double choice, double u, double v) {
  const auto [a, b, c] = scene.corners(material.triangle[material.area.choose(choice)]);
  const double root = std::sqrt(u), w = v * root;
  return {a * (1 - root) + b * (root - w) + c * w, normalize(cross(b - a, c - a))};
}

PathStart path_start(const MovingVisibility& scene, const Emitter& e, const Halton& halton,
                     std::uint64_t i) {
  const std::array<double, 4> number{halton.at(0, i), halton.at(1, i), halton.at(2, i),
                                     halton.at(3, i)};
  const auto [u, v, s, t] = number;
  if (!e.lamp.empty()) {
    const std::size_t n = e.lamp.size() > 1 ? e.power.choose(halton.at(4, i)) : 0;
    PathStart start = lamp_start(scene, e.lamp[n], number);
    start.flux *= 1 / e.power.of(n);
    return start;
  }
  if (e.is_background()) {
    const auto [d, light] = scene.frame().sample_background(u, v);
    return through_disc(scene, -d, light, s, t);
  }
  double choice = halton.at(4, i);
  const double sides = e.both_sides ? 2 : 1;
  const bool back = e.both_sides && choice < 0.5;
  if (e.both_sides) choice = 2 * choice - (back ? 0 : 1);
  auto [from, normal] = place_on(scene, e, choice, s, t);
  if (back) normal = -normal;
  const Vec3 way = cosine_direction(normal, u, v);
  from = from + normal * Visibility::kSurfaceOffset;
  const double metres = 1 / scene.scale();
  return {from, way, e.radiance * (sides * kPi * e.area.total() * metres * metres)};
}

}  // namespace haarlight
