// What a ray from the camera meets: place, normals, colour.

#include "precompute/surface.h"

#include <array>
#include <cmath>

#include "precompute/texture.h"

namespace haarlight {
namespace {

template <typename T>
T interpolate(const T& a, const T& b, const T& c, double b1, double b2) {
  return a * (1 - b1 - b2) + b * b1 + c * b2;
}

const Image& texture_of(const Scene& scene, int index) {
  return scene.texture[static_cast<std::size_t>(index)];
}

// Where on a triangle, as textures see it.
struct Spot {
  const Triangle& triangle;
  double b1, b2;

  // On a texture.
  std::array<double, 2> on(const Scene& scene, const TextureMap& map) const {
    const auto a = texture_place(scene, triangle.vertex[0], map);
    const auto b = texture_place(scene, triangle.vertex[1], map);
    const auto c = texture_place(scene, triangle.vertex[2], map);
    return {interpolate(a[0], b[0], c[0], b1, b2), interpolate(a[1], b[1], c[1], b1, b2)};
  }
};

Rgb albedo_at(const Scene& scene, const Material& material, const Spot& spot) {
  Rgb albedo = material.albedo;
  if (material.texture >= 0) {
    const auto [u, v] = spot.on(scene, material.map);
    albedo = albedo * sample_texture(texture_of(scene, material.texture), u, v);
  }
  if (!scene.tint.empty()) {
    const auto& vertex = spot.triangle.vertex;
    const RgbD tint = interpolate(RgbD(scene.tint[vertex[0]]), RgbD(scene.tint[vertex[1]]),
                                  RgbD(scene.tint[vertex[2]]), spot.b1, spot.b2);
    albedo = albedo * Rgb(tint);
  }
  return albedo;
}

// `smooth` (unit) as the normal texture has it. The tangent runs along u, the bitangent along v,
// both across `smooth`; a triangle without area in the texture keeps its normal.
Vec3 bumped(const Scene& scene, const Material& material, const Spot& spot, const Vec3& smooth,
            const Vec3& ab, const Vec3& ac) {
  const auto& vertex = spot.triangle.vertex;
  const auto first = texture_place(scene, vertex[0], material.normal_map);
  const auto second = texture_place(scene, vertex[1], material.normal_map);
  const auto third = texture_place(scene, vertex[2], material.normal_map);
  const double u1 = second[0] - first[0], v1 = second[1] - first[1];
  const double u2 = third[0] - first[0], v2 = third[1] - first[1];
  const double area = u1 * v2 - u2 * v1;
  Vec3 along = area < 0 ? ab * -v2 + ac * v1 : ab * v2 - ac * v1;  // dp/du, but for its length
  along = along - dot(along, smooth) * smooth;
  const double size = length(along);
  if (area == 0 || !(size > 0) || !std::isfinite(size)) return smooth;
  const Vec3 tangent = along * (1 / size);
  // A texture that is mirrored on the surface turns the frame's hand round.
  const bool mirrored = (dot(cross(ab, ac), smooth) < 0) != (area < 0);
  const Vec3 bitangent = mirrored ? -cross(smooth, tangent) : cross(smooth, tangent);
  const auto [u, v] = spot.on(scene, material.normal_map);
  const RgbD texel(sample_texture(texture_of(scene, material.normal_texture), u, v));
  const double scale = static_cast<double>(material.normal_scale);
  const Vec3 bump = tangent * ((2 * texel.r - 1) * scale) +
                    bitangent * ((2 * texel.g - 1) * scale) + smooth * (2 * texel.b - 1);
  const double bump_size = length(bump);
  return bump_size > 1e-6 ? bump * (1 / bump_size) : smooth;
}

// Turns `normal` towards `direction` (both unit, not opposite) until it is above its horizon.
Vec3 bent_towards(const Vec3& normal, const Vec3& direction) {
  constexpr double kLeast = 1e-3;
  const double cosine = dot(normal, direction);
  if (cosine > 0) return normal;
  const Vec3 bent = normal + (kLeast - cosine) * direction;
  const double size = length(bent);
  return size > 1e-6 ? bent * (1 / size) : direction;
}

}  // namespace

std::optional<SurfaceHit> surface_hit(const Scene& scene, const Visibility& visibility,
                                      const Vec3& origin, const Vec3& direction) {
  const std::optional<Visibility::Hit> hit = visibility.first_hit(origin, direction);
  if (!hit) return std::nullopt;
  return surface_at(scene, visibility, *hit, direction);
}

SurfaceHit surface_at(const Scene& scene, const Visibility& visibility, const Visibility::Hit& hit,
                      const Vec3& direction) {
  const Triangle& t = scene.triangle[hit.triangle];
  const Material& material = scene.material[t.material];
  const Spot spot{t, hit.b1, hit.b2};
  const auto [a, b, c] = visibility.corners(hit.triangle);
  SurfaceHit surface;
  surface.distance = hit.distance;
  surface.material = t.material;
  surface.to_viewer = -direction;
  // From the barycentric coordinates, in double: this lies in the plane Embree tests against, which
  // origin + distance * direction does not.
  surface.position = interpolate(a, b, c, hit.b1, hit.b2);
  const Vec3 across = cross(b - a, c - a);
  const double twice_area = length(across);
  // A sliver whose corners coincide after rounding to float is hit edge-on if at all.
  surface.geometric_normal = twice_area > 0 ? across * (1 / twice_area) : -direction;
  surface.outside = dot(surface.geometric_normal, direction) <= 0;
  if (!surface.outside) surface.geometric_normal = -surface.geometric_normal;

  Vec3 normal = interpolate(scene.normal[t.vertex[0]], scene.normal[t.vertex[1]],
                            scene.normal[t.vertex[2]], hit.b1, hit.b2);
  const double smooth_length = length(normal);
  normal = smooth_length > 1e-6 ? normal * (1 / smooth_length) : surface.geometric_normal;
  const bool turn = dot(normal, surface.geometric_normal) < 0;
  if (material.normal_texture >= 0) normal = bumped(scene, material, spot, normal, b - a, c - a);
  if (turn) normal = -normal;
  normal = bent_towards(normal, surface.geometric_normal);
  surface.normal = bent_towards(normal, surface.to_viewer);

  surface.albedo = albedo_at(scene, material, spot);
  surface.metallic = material.metallic, surface.roughness = material.roughness;
  if (material.metallic_roughness_texture >= 0) {
    const auto [u, v] = spot.on(scene, material.metallic_roughness_map);
    const Rgb factor = sample_texture(texture_of(scene, material.metallic_roughness_texture), u, v);
    surface.metallic *= factor.b, surface.roughness *= factor.g;
  }
  return surface;
}

}  // namespace haarlight
