// What the pixels of a picture see, lit directly.

#include "caching/surface_points.h"

#include <algorithm>
#include <cmath>

#include "caching/frame_tracer.h"
#include "caching/gather_points.h"
#include "core/hash_bits.h"
#include "core/parallel.h"
#include "precompute/random.h"

namespace haarlight {
namespace {

constexpr int kMostMirrors = 8;
constexpr double kLeastWeight = 1e-3;

// One pixel's rays.
class Looker {
 public:
  Looker(const MovingVisibility& scene, const SurfacePointOptions& options,
         std::span<const VirtualLight> shining, std::vector<SurfacePoint>& out)
      : scene_(scene), options_(options), shining_(shining), out_(out) {}

  // `lobes`: whether narrow lobes are followed; `shines`: whether what the ray meets is seen to
  // shine, which it is not where direct() has counted it.
  void look(const Vec3& from, const Vec3& way, const RgbD& weight, int mirrors, bool lobes,
            bool shines) {
    const AnimatedFrame& frame = scene_.frame();
    const auto hit = scene_.first_hit(from, way);
    if (!hit) {
      light += weight * frame.background_from(way);
      return;
    }
    const SurfaceHit surface = scene_.surface(*hit, way);
    const Emission& emission = frame.emission[surface.material];
    if (shines && (surface.outside || emission.both_sides)) light += weight * emission.radiance;
    const Bsdf bsdf = bsdf_at(frame.scene, surface);
    if (!bsdf.is_specular()) {
      light += weight * direct(surface, bsdf);
      const LobeKind lobe = lobe_kind(bsdf);
      const bool narrow = lobe == LobeKind::glossy || lobe == LobeKind::narrow;
      RgbD even = broad_reflectance(bsdf);
      // At the end of the way a lobe is as good as an even one.
      if (narrow && !lobes) even += bsdf.lobe_albedo();
      if (l1_norm(even) > 0) add(*hit, surface, weight * even * (1 / kPi));
      if (narrow && lobes) follow_lobe(surface, bsdf, weight, mirrors);
    }
    if (mirrors == kMostMirrors) return;
    for (int d = 0; d < bsdf.delta_count; ++d) {
      const Bsdf::Delta& delta = bsdf.delta[static_cast<std::size_t>(d)];
      RgbD on = weight * delta.weight;
      if (!(luminance(on) > kLeastWeight)) continue;
      const Vec3 next = normalize(delta.direction);
      const Vec3 start = FrameTracer::off_surface(surface.position, surface.geometric_normal, next);
      if (delta.transmitted && delta.enters) on = on * swallowed(surface.material, start, next);
      look(start, next, on, mirrors + 1, lobes, true);
    }
  }

  RgbD light;  // all but what points add
  std::uint64_t key = 0;

 private:
  // What glass leaves of light on the way to its other side.
  RgbD swallowed(std::uint32_t material, const Vec3& from, const Vec3& way) const {
    const RgbD e(scene_.frame().scene.material[material].extinction);
    if (!(l1_norm(e) > 0)) return {1, 1, 1};
    const auto far = scene_.first_hit(from, way);
    if (!far) return {1, 1, 1};
    const double metres = far->distance / scene_.scale();
    return {std::exp(-e.r * metres), std::exp(-e.g * metres), std::exp(-e.b * metres)};
  }

  RgbD direct(const SurfaceHit& surface, const Bsdf& bsdf) const {
    RgbD sum;
    for (const SceneLight& lamp : scene_.frame().light) {
      SceneLight local = lamp;
      local.position = scene_.to_local(lamp.position);
      LightArrival a = light_at(local, surface.position);
      if (lamp.kind != SceneLight::Kind::directional) {
        a.irradiance *= scene_.scale() * scene_.scale();
      }
      if (!(l1_norm(a.irradiance) > 0)) continue;
      const RgbD f = reflected(bsdf, a.from);
      if (!(l1_norm(f) > 0)) continue;
      Segment s = segment_towards(surface.position, surface.geometric_normal, a.from);
      if (std::isfinite(a.distance)) s.length = a.distance;
      if (!scene_.occluded(s)) sum += f * a.irradiance;
    }
    for (const VirtualLight& place : shining_) {
      const Vec3 way = place.position - surface.position;
      const double square = dot(way, way), there = -dot(place.normal, way);
      if (!(there > 0) || !(square > 0)) continue;
      const double distance = std::sqrt(square);
      const RgbD f = reflected(bsdf, way * (1 / distance));
      if (!(l1_norm(f) > 0)) continue;
      if (scene_.occluded(segment_to(place, surface.position, surface.geometric_normal))) continue;
      sum += f * place.intensity * (there / (distance * square));
    }
    return sum;
  }

  void add(const Visibility::Hit& hit, const SurfaceHit& surface, const RgbD& weight) {
    SurfacePoint p;
    p.place = {hit.triangle, hit.b1, hit.b2, surface.outside};
    p.position = surface.position, p.geometric_normal = surface.geometric_normal;
    p.normal = smooth_normal(scene_.frame().scene, hit, surface.geometric_normal);
    p.weight = weight;
    out_.push_back(p);
  }

  void follow_lobe(const SurfaceHit& surface, const Bsdf& bsdf, const RgbD& weight, int mirrors) {
    PathRandom random(mix_bits(key, static_cast<std::uint64_t>(mirrors)));
    const double su = random.next(), sv = random.next();
    for (int s = 0; s < options_.glossy_samples; ++s) {
      const double u = (s + su) / options_.glossy_samples;
      const double w = sv + s * 0.6180339887498949;
      const auto sample = bsdf.sample_lobe(u, w - std::floor(w));
      if (!sample || !(dot(sample->direction, surface.geometric_normal) > 0)) continue;
      const Bsdf::LobeValues lobe = bsdf.lobe_values(sample->direction);
      const RgbD f = bsdf.gloss_first * lobe.first + bsdf.gloss_second * lobe.second;
      const RgbD on = weight * f * (1 / (sample->pdf * options_.glossy_samples));
      if (!(luminance(on) > 0)) continue;
      look(FrameTracer::off_surface(surface.position, surface.geometric_normal, sample->direction),
           sample->direction, on, kMostMirrors, false, false);
    }
  }

  const MovingVisibility& scene_;
  const SurfacePointOptions& options_;
  std::span<const VirtualLight> shining_;
  std::vector<SurfacePoint>& out_;
};

}  // namespace

void surface_points(const MovingVisibility& scene, const Camera& camera,
                    const SurfacePointOptions& options, Image& picture,
                    std::vector<SurfaceRow>& rows,
                    const std::function<void(int rows_done)>& progress_row) {
  const std::vector<VirtualLight> shining = shining_places(scene, options.light_points);
  const Vec3 eye = scene.to_local(camera.position);
  picture = Image(camera.width, camera.height);
  rows.resize(static_cast<std::size_t>(camera.height));
  constexpr int kRows = 32;  // between two looks at the clock
  for (int top = 0; top < camera.height; top += kRows) {
    parallel_for(std::min(kRows, camera.height - top), [&](int i) {
      const int y = top + i;
      SurfaceRow& row = rows[static_cast<std::size_t>(y)];
      row.point.clear(), row.first.clear();
      for (int x = 0; x < camera.width; ++x) {
        row.first.push_back(row.point.size());
        Looker looker(scene, options, shining, row.point);
        looker.key = mix_bits(1, picture.index(x, y));
        looker.look(eye, camera.direction(x + 0.5, y + 0.5), {1, 1, 1}, 0, true, true);
        picture.at(x, y) = Rgb(looker.light);
      }
      row.first.push_back(row.point.size());
    });
    if (progress_row) progress_row(std::min(top + kRows, camera.height));
  }
}

}  // namespace haarlight
