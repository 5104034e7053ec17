// Virtual point lights.

#include "caching/virtual_lights.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>
#include <utility>

#include "caching/emitters.h"
#include "caching/frame_tracer.h"
#include "caching/gather_points.h"
#include "caching/halton.h"
#include "core/parallel.h"
#include "precompute/random.h"

namespace haarlight {
namespace {

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
  const PathStart begin = path_start(scene, e, halton, i);
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
  const std::vector<Emitter> all = emitters(scene);
  if (all.empty()) return lights;
  const bool sky = all.back().is_background();

  const Halton halton(options.seed);
  const std::size_t shares = all.size() + (sky ? 1 : 0);
  std::size_t done = 0;
  const auto share_of = [&](std::size_t n) {
    const std::size_t end = lights.size() * (n + 1) / shares;
    const std::span share(lights.data() + done, end - done);
    done = end;
    return share;
  };
  for (std::size_t n = 0; n < all.size(); ++n) {
    const std::span share = share_of(n);
    if (share.empty()) continue;  // more emitters than numbers
    const std::vector<int> order = orders(static_cast<int>(share.size()), options.bounces);
    constexpr int kChunk = 8;
    parallel_for(
        order[0],
        [&](int i) { walk(scene, all[n], halton, static_cast<std::uint64_t>(i), order, share); },
        kChunk);
  }
  if (!sky) return lights;
  // What the background sends straight to surfaces.
  const std::span share = share_of(all.size());
  for (std::size_t i = 0; i < share.size(); ++i) {
    const auto [from, light] = frame.sample_background(halton.at(0, i), halton.at(1, i));
    share[i].position = from;
    share[i].intensity = light * (1 / static_cast<double>(share.size()));
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
