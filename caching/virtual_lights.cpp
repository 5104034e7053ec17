// Virtual point lights.

#include "caching/virtual_lights.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <tuple>
#include <utility>

#include "caching/frame_tracer.h"
#include "caching/gather_points.h"
#include "caching/halton.h"
#include "core/parallel.h"
#include "precompute/chances.h"
#include "precompute/random.h"

namespace haarlight {
namespace {

// A lamp, a shining material, or the background.
struct Emitter {
  const SceneLight* lamp = nullptr;
  std::vector<std::uint32_t> triangle;  // of a material, those with area
  Chances area;                         // of them, local units squared
  RgbD radiance;                        // of a material
  bool both_sides = false;
};

// A path's first ray, from just off a light, and the flux (W) that a path carries.
struct Start {
  Vec3 from, direction;
  RgbD flux;
};

Vec3 even_direction(double u, double v) {
  const double y = 1 - 2 * u, r = std::sqrt(std::max(1 - y * y, 0.0)), angle = 2 * kPi * v;
  return {r * std::cos(angle), y, r * std::sin(angle)};
}

std::pair<Vec3, Vec3> across(const Vec3& w) {
  const Vec3 other = std::abs(w.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 t = normalize(cross(other, w));
  return {t, cross(w, t)};
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

// A place on a shining material by three numbers, and its geometric normal.
std::pair<Vec3, Vec3> place_on(const MovingVisibility& scene, const Emitter& e, double choice,
                               double u, double v) {
  const auto [a, b, c] = scene.corners(e.triangle[e.area.choose(choice)]);
  const double root = std::sqrt(u), w = v * root;
  return {a * (1 - root) + b * (root - w) + c * w, normalize(cross(b - a, c - a))};
}

// All light of an emitter, by four numbers; local lengths in the flux are undone by the caller.
Start start(const MovingVisibility& scene, const Emitter& e, const Halton& halton,
            std::uint64_t i) {
  const double u = halton.at(0, i), v = halton.at(1, i), s = halton.at(2, i), t = halton.at(3, i);
  const double metres = 1 / scene.scale();
  // A disc that all of the scene stands behind.
  const auto through_disc = [&](const Vec3& direction, const RgbD& irradiance) {
    const double radius = scene.reach();
    const auto [x, y] = across(direction);
    const double r = radius * std::sqrt(s), angle = 2 * kPi * t;
    const Vec3 from =
        direction * (-2 * radius) + x * (r * std::cos(angle)) + y * (r * std::sin(angle));
    return Start{from, direction, irradiance * (kPi * radius * radius * metres * metres)};
  };
  if (e.lamp) {
    const SceneLight& lamp = *e.lamp;
    if (lamp.kind == SceneLight::Kind::directional) {
      return through_disc(lamp.direction, lamp.intensity);
    }
    const Vec3 from = scene.to_local(lamp.position);
    if (lamp.kind == SceneLight::Kind::point) {
      return Start{from, even_direction(u, v), lamp.intensity * (4 * kPi)};
    }
    // Evenly within the cone of a spot, weighted by what it sends there.
    const double least = std::cos(lamp.outer), cosine = 1 - u * (1 - least);
    const double r = std::sqrt(std::max(1 - cosine * cosine, 0.0)), angle = 2 * kPi * v;
    const auto [x, y] = across(lamp.direction);
    const Vec3 way =
        lamp.direction * cosine + x * (r * std::cos(angle)) + y * (r * std::sin(angle));
    SceneLight unit = lamp;
    unit.position = {0, 0, 0};
    const LightArrival a = light_at(unit, way);
    return Start{from, normalize(way), a.irradiance * (2 * kPi * (1 - least))};
  }
  if (e.triangle.empty()) {
    const Vec3 d = even_direction(u, v);
    return through_disc(-d, scene.frame().background_from(d) * (4 * kPi));
  }
  double choice = halton.at(4, i);
  const double sides = e.both_sides ? 2 : 1;
  const bool back = e.both_sides && choice < 0.5;
  if (e.both_sides) choice = 2 * choice - (back ? 0 : 1);
  auto [from, normal] = place_on(scene, e, choice, s, t);
  if (back) normal = -normal;
  const Vec3 way = cosine_direction(normal, u, v);
  from = from + normal * Visibility::kSurfaceOffset;
  return Start{from, way, e.radiance * (sides * kPi * e.area.total() * metres * metres)};
}

// How many of an emitter's numbers are reflections of each order: halves, at least one each.
std::vector<int> orders(int share, int bounces) {
  std::vector<int> count;
  int left = share;
  for (int b = 0; b < bounces && left > 0; ++b) {
    const int here = b + 1 == bounces ? left : (left + 1) / 2;
    // Never more than paths that come that far.
    count.push_back(count.empty() ? here : std::min(here, count.back()));
    left -= count.back();
  }
  count[0] += left;
  return count;
}

// Follows path `i` of an emitter and sets its lights: reflections of order b at first_b + i.
void walk(const MovingVisibility& scene, const Emitter& e, const Halton& halton, std::uint64_t i,
          const std::vector<int>& order, std::span<VirtualLight> lights) {
  const Start begin = start(scene, e, halton, i);
  if (!(l1_norm(begin.flux) > 0)) return;
  PathRandom random(mix_bits(halton.seed(), i));
  RgbD flux = begin.flux;
  Vec3 from = begin.from, way = begin.direction;
  std::size_t first = 0;
  constexpr int kMostMirrors = 8;
  for (int b = 0, mirrors = 0; b < static_cast<int>(order.size());) {
    if (static_cast<int>(i) >= order[static_cast<std::size_t>(b)]) return;
    const auto hit = scene.first_hit(from, way);
    if (!hit) return;
    const SurfaceHit surface = scene.surface(*hit, way);
    // Seen from where the light comes: reflectances of diffuse parts are the same both ways.
    const Bsdf bsdf = bsdf_at(scene.frame().scene, surface);
    const RgbD even = broad_reflectance(bsdf);
    const double diffuse = luminance(even);
    double single = 0;
    for (int d = 0; d < bsdf.delta_count; ++d) {
      single += luminance(bsdf.delta[static_cast<std::size_t>(d)].weight);
    }
    if (!(diffuse + single > 0)) return;
    const double choice = bsdf.delta_count > 0 ? random.next() * (diffuse + single) : 0;
    if (choice >= diffuse && bsdf.delta_count > 0) {
      if (++mirrors > kMostMirrors) return;
      const std::size_t d =
          bsdf.delta_count == 1 || choice - diffuse < luminance(bsdf.delta[0].weight) ? 0 : 1;
      const double chance = luminance(bsdf.delta[d].weight) / (diffuse + single);
      flux = flux * bsdf.delta[d].weight * (1 / chance);
      way = normalize(bsdf.delta[d].direction);
      from = FrameTracer::off_surface(surface.position, surface.geometric_normal, way);
      continue;
    }
    flux = flux * even * ((diffuse + single) / diffuse);
    VirtualLight& light = lights[first + i];
    light.kind = VirtualLight::Kind::surface;
    light.position = surface.position;
    light.geometric_normal = surface.geometric_normal;
    light.normal = smooth_normal(scene.frame().scene, *hit, surface.geometric_normal);
    const double share = 1.0 / order[static_cast<std::size_t>(b)];
    light.intensity = flux * (share * scene.scale() * scene.scale() / kPi);
    first += static_cast<std::size_t>(order[static_cast<std::size_t>(b)]);
    ++b;
    way = cosine_direction(light.normal, halton.at(5 + 2 * (b - 1), i),
                           halton.at(6 + 2 * (b - 1), i));
    if (!(dot(way, surface.geometric_normal) > 0)) return;
    from = FrameTracer::off_surface(surface.position, surface.geometric_normal, way);
  }
}

}  // namespace

std::vector<VirtualLight> virtual_lights(const MovingVisibility& scene,
                                         const VirtualLightOptions& options) {
  const AnimatedFrame& frame = scene.frame();
  std::vector<VirtualLight> lights(static_cast<std::size_t>(options.count));
  std::vector<Emitter> emitters;
  for (const SceneLight& lamp : frame.light) {
    Emitter e;
    e.lamp = &lamp;
    emitters.push_back(e);
  }
  std::ranges::move(shining_materials(scene), std::back_inserter(emitters));
  const bool sky = l1_norm(frame.background) > 0 || frame.environment;
  if (sky) emitters.emplace_back();
  if (emitters.empty()) return lights;

  const Halton halton(options.seed);
  const std::size_t shares = emitters.size() + (sky ? 1 : 0);
  std::size_t done = 0;
  const auto share_of = [&](std::size_t n) {
    const std::size_t end = lights.size() * (n + 1) / shares;
    const std::span share(lights.data() + done, end - done);
    done = end;
    return share;
  };
  for (std::size_t n = 0; n < emitters.size(); ++n) {
    const std::span share = share_of(n);
    if (share.empty()) continue;  // more emitters than numbers
    const std::vector<int> order = orders(static_cast<int>(share.size()), options.bounces);
    constexpr int kChunk = 8;
    parallel_for(
        order[0],
        [&](int i) {
          walk(scene, emitters[n], halton, static_cast<std::uint64_t>(i), order, share);
        },
        kChunk);
  }
  if (!sky) return lights;
  // What the background sends straight to surfaces.
  const std::span share = share_of(emitters.size());
  for (std::size_t i = 0; i < share.size(); ++i) {
    share[i].position = even_direction(halton.at(0, i), halton.at(1, i));
    share[i].intensity =
        frame.background_from(share[i].position) * (4 * kPi / static_cast<double>(share.size()));
    if (l1_norm(share[i].intensity) > 0) share[i].kind = VirtualLight::Kind::distant;
  }
  return lights;
}

std::vector<VirtualLight> shining_places(const MovingVisibility& scene, int points) {
  const Halton halton(0);
  std::vector<VirtualLight> lights;
  for (const Emitter& e : shining_materials(scene)) {
    for (int i = 0; i < points; ++i) {
      const auto n = static_cast<std::uint64_t>(i);
      VirtualLight light;
      light.kind = VirtualLight::Kind::surface;
      std::tie(light.position, light.normal) =
          place_on(scene, e, (i + 0.5) / points, halton.at(0, n), halton.at(1, n));
      light.geometric_normal = light.normal;
      light.intensity = e.radiance * (e.area.total() / points);
      lights.push_back(light);
      if (!e.both_sides) continue;
      light.normal = light.geometric_normal = -light.normal;
      lights.push_back(light);
    }
  }
  return lights;
}

double smooth_step(double a, double b, double x) {
  if (x >= b) return 1;
  if (!(x > a)) return 0;
  const double t = (x - a) / (b - a);
  return t * t * (3 - 2 * t);
}

RgbD arrival(const VirtualLight& light, const Vec3& position, const Vec3& normal,
             double least_distance, RgbD* lost) {
  if (light.kind == VirtualLight::Kind::none) return {};
  if (light.kind == VirtualLight::Kind::distant) {
    return light.intensity * std::max(dot(normal, light.position), 0.0);
  }
  const Vec3 way = light.position - position;
  const double here = dot(normal, way), there = -dot(light.normal, way);
  if (!(here > 0) || !(there > 0)) return {};
  const double square = dot(way, way);
  const RgbD whole = light.intensity * (here * there / (square * square));
  const double share = smooth_step(0.8 * least_distance, 1.2 * least_distance, std::sqrt(square));
  // At no distance at all there is no number to lose.
  if (lost && share < 1 && is_finite(whole)) *lost += whole * (1 - share);
  return share > 0 && is_finite(whole) ? whole * share : RgbD{};
}

Segment segment_to(const VirtualLight& light, const Vec3& position, const Vec3& geometric_normal) {
  if (light.kind == VirtualLight::Kind::distant) {
    return segment_towards(position, geometric_normal, light.position);
  }
  return segment_between(position, geometric_normal, light.position, light.geometric_normal);
}

Vec3 smooth_normal(const Scene& scene, const Visibility::Hit& hit, const Vec3& geometric_normal) {
  const auto& v = scene.triangle[hit.triangle].vertex;
  const Vec3 sum = scene.normal[v[0]] * (1 - hit.b1 - hit.b2) + scene.normal[v[1]] * hit.b1 +
                   scene.normal[v[2]] * hit.b2;
  const double size = length(sum), cosine = dot(sum, geometric_normal);
  // One in the plane of the triangle, or none, says nothing.
  if (!(std::abs(cosine) > 1e-3 * size) || !std::isfinite(size)) return geometric_normal;
  return sum * ((cosine < 0 ? -1 : 1) / size);
}

}  // namespace haarlight
