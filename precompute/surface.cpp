// What a ray from the camera meets: place, normals, colour.

#include "precompute/surface.h"

#include <algorithm>
#include <cmath>

namespace haarlight {
namespace {

template <typename T>
T interpolate(const T& a, const T& b, const T& c, double b1, double b2) {
  return a * (1 - b1 - b2) + b * b1 + c * b2;
}

Rgb albedo_at(const Scene& scene, const Triangle& t, double b1, double b2) {
  const Material& material = scene.material[t.material];
  Rgb albedo = material.albedo;
  if (material.texture >= 0) {
    const auto& a = scene.uv[t.vertex[0]];
    const auto& b = scene.uv[t.vertex[1]];
    const auto& c = scene.uv[t.vertex[2]];
    const auto mix = [&](std::size_t i) {
      return interpolate(static_cast<double>(a[i]), static_cast<double>(b[i]),
                         static_cast<double>(c[i]), b1, b2);
    };
    albedo = albedo * sample_texture(scene.texture[static_cast<std::size_t>(material.texture)],
                                     mix(0), mix(1));
  }
  if (!scene.tint.empty()) {
    const RgbD tint = RgbD(scene.tint[t.vertex[0]]) * (1 - b1 - b2) +
                      RgbD(scene.tint[t.vertex[1]]) * b1 + RgbD(scene.tint[t.vertex[2]]) * b2;
    albedo = albedo * Rgb(tint);
  }
  return albedo;
}

}  // namespace

Rgb sample_texture(const Image& texture, double u, double v) {
  if (!std::isfinite(u) || !std::isfinite(v)) u = v = 0;
  const double x = (u - std::floor(u)) * texture.width - 0.5;
  const double y = (1 - (v - std::floor(v))) * texture.height - 0.5;
  const double x0 = std::floor(x), y0 = std::floor(y);
  const auto wrap = [](double i, int size) {
    const int k = static_cast<int>(i) % size;
    return k < 0 ? k + size : k;
  };
  const int left = wrap(x0, texture.width), right = wrap(x0 + 1, texture.width);
  const int top = wrap(y0, texture.height), bottom = wrap(y0 + 1, texture.height);
  const auto fx = static_cast<float>(x - x0), fy = static_cast<float>(y - y0);
  const Rgb upper = texture.at(left, top) * (1 - fx) + texture.at(right, top) * fx;
  const Rgb lower = texture.at(left, bottom) * (1 - fx) + texture.at(right, bottom) * fx;
  return upper * (1 - fy) + lower * fy;
}

std::optional<SurfaceHit> surface_hit(const Scene& scene, const Visibility& visibility,
                                      const Vec3& origin, const Vec3& direction) {
  const std::optional<Visibility::Hit> hit = visibility.first_hit(origin, direction);
  if (!hit) return std::nullopt;
  const Triangle& t = scene.triangle[hit->triangle];
  const Vec3 a = visibility.corner(hit->triangle, 0), b = visibility.corner(hit->triangle, 1),
             c = visibility.corner(hit->triangle, 2);
  SurfaceHit surface;
  surface.distance = hit->distance;
  surface.material = t.material;
  surface.to_viewer = -direction;
  // From the barycentric coordinates, in double: this lies in the plane Embree tests against, which
  // origin + distance * direction does not.
  surface.position = interpolate(a, b, c, hit->b1, hit->b2);
  const Vec3 across = cross(b - a, c - a);
  const double twice_area = length(across);
  // A sliver whose corners coincide after rounding to float is hit edge-on if at all.
  surface.geometric_normal = twice_area > 0 ? across * (1 / twice_area) : -direction;
  if (dot(surface.geometric_normal, direction) > 0) {
    surface.geometric_normal = -surface.geometric_normal;
  }
  const Vec3 smooth = interpolate(scene.normal[t.vertex[0]], scene.normal[t.vertex[1]],
                                  scene.normal[t.vertex[2]], hit->b1, hit->b2);
  const double smooth_length = length(smooth);
  surface.normal = smooth_length > 1e-6 ? smooth * (1 / smooth_length) : surface.geometric_normal;
  if (dot(surface.normal, surface.geometric_normal) < 0) surface.normal = -surface.normal;
  surface.albedo = albedo_at(scene, t, hit->b1, hit->b2);
  return surface;
}

ShadingPoint shading_point(const Scene& scene, const SurfaceHit& hit) {
  ShadingPoint point;
  const Vec3 origin = hit.position + Visibility::kSurfaceOffset * hit.geometric_normal;
  point.origin = {static_cast<float>(origin.x), static_cast<float>(origin.y),
                  static_cast<float>(origin.z)};
  point.geometric_normal = hit.geometric_normal;
  point.normal = hit.normal;
  const Material& material = scene.material[hit.material];
  point.glossy = l1_norm(material.specular) > 0;
  if (point.glossy) {
    point.mirror = normalize(2 * dot(hit.normal, hit.to_viewer) * hit.normal - hit.to_viewer);
    point.exponent = static_cast<double>(material.exponent);
  }
  return point;
}

}  // namespace haarlight
