// Primary rays of caching methods.

#include "caching/gather_points.h"

#include <algorithm>
#include <cmath>

#include "caching/lobe_harmonics.h"
#include "core/parallel.h"

namespace haarlight {
namespace {

constexpr int kMostMirrors = 8;
constexpr double kLeastWeight = 1e-3;

void follow(const FrameTracer& tracer, const Vec3& from, const Vec3& direction, const RgbD& weight,
            int mirrors, std::vector<GatherPoint>& points, RgbD& without) {
  const Scene& scene = tracer.frame().scene;
  const Visibility& visibility = tracer.visibility();
  const auto hit = visibility.first_hit(from, direction);
  if (!hit) {
    without += weight * tracer.frame().background_from(direction);
    return;
  }
  const SurfaceHit surface = surface_at(scene, visibility, *hit, direction);
  const Bsdf bsdf = bsdf_at(scene, surface);
  if (bsdf.is_specular()) {
    without += weight * tracer.emitted(surface);
  } else {
    GatherPoint p;
    p.place = {hit->triangle, hit->b1, hit->b2, surface.outside};
    const PlaceFrame at = place_in(scene, p.place);
    p.hit = *hit, p.direction = direction, p.weight = weight;
    p.position = at.position, p.normal = at.normal;
    p.broad = l1_norm(broad_reflectance(bsdf)) > 0;
    p.glossy = lobe_kind(bsdf) == LobeKind::glossy;
    if (p.glossy) p.lobe = lobe_table_key(bsdf);
    points.push_back(p);
  }
  if (mirrors == kMostMirrors) return;
  for (int d = 0; d < bsdf.delta_count; ++d) {
    const Bsdf::Delta& delta = bsdf.delta[static_cast<std::size_t>(d)];
    RgbD on = weight * delta.weight;
    if (!(luminance(on) > kLeastWeight)) continue;
    const Vec3 way = normalize(delta.direction);
    if (delta.transmitted && delta.enters) {
      // What glass swallows is known where its other side is met.
      const Rgb& e = scene.material[surface.material].extinction;
      const Vec3 inside = FrameTracer::off_surface(surface.position, surface.geometric_normal, way);
      if (const auto far = visibility.first_hit(inside, way); far && l1_norm(e) > 0) {
        const double metres = visibility.to_world_length(far->distance);
        on = on * RgbD{std::exp(-static_cast<double>(e.r) * metres),
                       std::exp(-static_cast<double>(e.g) * metres),
                       std::exp(-static_cast<double>(e.b) * metres)};
      }
    }
    follow(tracer, FrameTracer::off_surface(surface.position, surface.geometric_normal, way), way,
           on, mirrors + 1, points, without);
  }
}

}  // namespace

LobeKind lobe_kind(const Bsdf& bsdf) {
  if (!bsdf.has_lobe()) return LobeKind::none;
  const bool phong = bsdf.lobe == Bsdf::Lobe::phong;
  if (phong ? bsdf.width < 3 : bsdf.width > 0.4) return LobeKind::wide;
  return (phong ? bsdf.width < 60 : bsdf.width > 0.15) ? LobeKind::glossy : LobeKind::narrow;
}

RgbD broad_reflectance(const Bsdf& bsdf) {
  RgbD sum;
  if (bsdf.has_diffuse()) sum += bsdf.diffuse_out(bsdf.to_viewer);
  if (lobe_kind(bsdf) == LobeKind::wide) sum += bsdf.lobe_albedo();
  return sum;
}

GatherPoints gather_points(const FrameTracer& tracer, const Camera& camera) {
  GatherPoints out;
  out.without = Image(camera.width, camera.height);
  const auto rows = static_cast<std::size_t>(camera.height);
  out.row.resize(rows), out.first.resize(rows);
  const Vec3 eye = tracer.visibility().to_local(camera.position);
  parallel_for(camera.height, [&](int y) {
    auto& row = out.row[static_cast<std::size_t>(y)];
    auto& first = out.first[static_cast<std::size_t>(y)];
    for (int x = 0; x < camera.width; ++x) {
      first.push_back(row.size());
      RgbD without;
      follow(tracer, eye, camera.direction(x + 0.5, y + 0.5), {1, 1, 1}, 0, row, without);
      out.without.at(x, y) = Rgb(without);
    }
    first.push_back(row.size());
  });
  return out;
}

}  // namespace haarlight
