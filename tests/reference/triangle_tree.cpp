// The nearest triangle along a ray.

#include "tests/reference/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"

namespace haarlight::reference {
namespace {

constexpr std::size_t kLeaf = 3;

Vec3 least(const Vec3& a, const Vec3& b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
Vec3 most(const Vec3& a, const Vec3& b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}
double axis(const Vec3& v, int k) { return k == 0 ? v.x : k == 1 ? v.y : v.z; }

// Whether a ray is inside a box anywhere between two distances.
bool meets(const Vec3& low, const Vec3& high, const Vec3& origin, const Vec3& inverse,
           double nearer, double farther) {
  for (int k = 0; k < 3; ++k) {
    const double one = (axis(low, k) - axis(origin, k)) * axis(inverse, k);
    const double two = (axis(high, k) - axis(origin, k)) * axis(inverse, k);
    // The borders are widened by more than three roundings, or flat boxes would lose rays.
    nearer = std::max(nearer, std::min(one, two) * (1 - 1e-15));
    farther = std::min(farther, std::max(one, two) * (1 + 1e-15));
  }
  return nearer <= farther;
}

}  // namespace

TriangleTree::TriangleTree(const Scene& scene) {
  if (scene.triangle.empty()) {
    throw Error(ErrorKind::missing, scene.name + ": no triangles, expected at least one");
  }
  for (std::uint32_t t = 0; t < scene.triangle.size(); ++t) {
    const Triangle& triangle = scene.triangle[t];
    const Vec3 a = scene.position[triangle.vertex[0]];
    corners_.push_back(
        {a, scene.position[triangle.vertex[1]] - a, scene.position[triangle.vertex[2]] - a, t});
  }
  build(0, corners_.size());
  const Vec3 size = nodes_[0].high - nodes_[0].low;
  extent_ = std::max({size.x, size.y, size.z});
}

void TriangleTree::build(std::size_t begin, std::size_t end) {
  const std::size_t self = nodes_.size();
  nodes_.emplace_back();
  Vec3 low = corners_[begin].a, high = low;
  for (std::size_t i = begin; i < end; ++i) {
    const Corners& c = corners_[i];
    for (const Vec3& p : {c.a, c.a + c.e1, c.a + c.e2}) low = least(low, p), high = most(high, p);
  }
  nodes_[self].low = low;
  nodes_[self].high = high;
  if (end - begin <= kLeaf) {
    nodes_[self].first = static_cast<std::uint32_t>(begin);
    nodes_[self].count = static_cast<std::uint32_t>(end - begin);
    return;
  }
  const Vec3 size = high - low;
  const int along = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto middle = [along](const Corners& c) {
    return 3 * axis(c.a, along) + axis(c.e1, along) + axis(c.e2, along);
  };
  const std::size_t cut = (begin + end) / 2;
  const auto at = [this](std::size_t i) { return corners_.begin() + static_cast<long>(i); };
  std::nth_element(at(begin), at(cut), at(end),
                   [&](const Corners& a, const Corners& b) { return middle(a) < middle(b); });
  build(begin, cut);
  nodes_[self].first = static_cast<std::uint32_t>(nodes_.size());
  build(cut, end);
}

std::optional<TriangleTree::Hit> TriangleTree::hit(const Vec3& origin, const Vec3& direction,
                                                   bool any, double nearer, double farther) const {
  // Finite, so that a ray in the plane of a flat box is in it (0 x infinity would be nowhere).
  const auto invert = [](double d) { return 1 / (d == 0 ? 1e-300 : d); };
  const Vec3 inverse{invert(direction.x), invert(direction.y), invert(direction.z)};
  std::optional<Hit> best;
  std::array<std::uint32_t, 64> todo;  // deeper than any tree cut at the median
  std::size_t depth = 0;
  todo[depth++] = 0;
  while (depth > 0) {
    const std::uint32_t index = todo[--depth];
    const Node& node = nodes_[index];
    if (!meets(node.low, node.high, origin, inverse, nearer, farther)) continue;
    if (node.count == 0) {
      todo[depth++] = node.first;
      todo[depth++] = index + 1;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Corners& c = corners_[i];
      const Vec3 p = cross(direction, c.e2);
      const double determinant = dot(c.e1, p);
      if (determinant == 0) continue;
      const Vec3 s = origin - c.a;
      const double u = dot(s, p) / determinant;
      if (u < 0 || u > 1) continue;
      const Vec3 q = cross(s, c.e1);
      const double v = dot(direction, q) / determinant;
      if (v < 0 || u + v > 1) continue;
      const double distance = dot(c.e2, q) / determinant;
      if (!(distance > nearer) || !(distance < farther)) continue;
      best = Hit{c.triangle, u, v, distance};
      if (any) return best;
      farther = distance;
    }
  }
  return best;
}

}  // namespace haarlight::reference
