// Where a place on a body is in one frame.

#include "caching/body_place.h"

#include <array>
#include <cmath>

namespace haarlight {
namespace {

Vec3 between(const Vec3& a, const Vec3& b, const Vec3& c, const BodyPlace& p) {
  return a * (1 - p.b1 - p.b2) + b * p.b1 + c * p.b2;
}

Vec3 unit_or(const Vec3& v, const Vec3& otherwise) {
  const double size = length(v);
  return size > 1e-12 && std::isfinite(size) ? v * (1 / size) : otherwise;
}

}  // namespace

PlaceFrame place_in(const Scene& scene, const BodyPlace& place) {
  const auto& v = scene.triangle[place.triangle].vertex;
  const std::array corner{scene.position[v[0]], scene.position[v[1]], scene.position[v[2]]};
  PlaceFrame out;
  out.position = between(corner[0], corner[1], corner[2], place);
  const Vec3 across = cross(corner[1] - corner[0], corner[2] - corner[0]);
  const Vec3 smooth = between(scene.normal[v[0]], scene.normal[v[1]], scene.normal[v[2]], place);
  const double area = length(across);
  Vec3 face = area > 0 ? across * (1 / area) : unit_or(smooth, {0, 1, 0});
  if (!place.front) face = -face;
  Vec3 normal = unit_or(smooth, face);
  if (dot(normal, face) < 0) normal = -normal;
  if (!(dot(normal, face) > 1e-3)) normal = face;  // a smooth normal in the plane is none
  out.geometric_normal = face, out.normal = normal;
  const auto flat = [&](const Vec3& d) { return d - normal * dot(d, normal); };
  const Vec3 other = std::abs(normal.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  out.tangent = unit_or(flat(corner[1] - corner[0]), normalize(flat(other)));
  out.bitangent = cross(normal, out.tangent);
  return out;
}

}  // namespace haarlight
