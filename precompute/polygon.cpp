// Polygons into triangles.

#include "precompute/polygon.h"

#include <cmath>
#include <cstddef>
#include <numeric>

namespace haarlight {
namespace {

struct Flat {
  double x, y;
};

double turn(const Flat& a, const Flat& b, const Flat& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

bool inside(const Flat& p, const Flat& a, const Flat& b, const Flat& c) {
  return turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
}

// Seen along the largest part of its area vector, wound counter-clockwise.
std::vector<Flat> flatten(std::span<const Vec3> corners) {
  Vec3 area;  // Newell: sum of cross products about the first corner
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    area = area + cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
  }
  const double ax = std::abs(area.x), ay = std::abs(area.y), az = std::abs(area.z);
  std::vector<Flat> flat;
  flat.reserve(corners.size());
  for (const Vec3& p : corners) {
    if (az >= ax && az >= ay) {
      flat.push_back({area.z < 0 ? -p.x : p.x, p.y});
    } else if (ay >= ax) {
      flat.push_back({area.y < 0 ? -p.z : p.z, p.x});
    } else {
      flat.push_back({area.x < 0 ? -p.y : p.y, p.z});
    }
  }
  return flat;
}

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulate(std::span<const Vec3> corners) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  if (corners.size() < 3) return triangles;
  if (corners.size() == 3) return {{0, 1, 2}};
  const std::vector<Flat> flat = flatten(corners);
  std::vector<std::uint32_t> left(corners.size());
  std::iota(left.begin(), left.end(), 0u);

  const auto is_ear = [&](std::size_t i) {
    const std::size_t n = left.size();
    const std::uint32_t a = left[(i + n - 1) % n], b = left[i], c = left[(i + 1) % n];
    if (!(turn(flat[a], flat[b], flat[c]) > 0)) return false;
    for (const std::uint32_t other : left) {
      if (other == a || other == b || other == c) continue;
      if (inside(flat[other], flat[a], flat[b], flat[c])) return false;
    }
    return true;
  };
  // Finding ears takes the square of the corners; a face of thousands is a round cap: a fan will
  // do.
  constexpr std::size_t kMostCorners = 1024;
  while (left.size() > 3 && corners.size() <= kMostCorners) {
    std::size_t ear = left.size();
    for (std::size_t i = 1; i <= left.size() && ear == left.size(); ++i) {
      if (is_ear(i % left.size())) ear = i % left.size();
    }
    if (ear == left.size()) break;  // no simple polygon
    const std::size_t n = left.size();
    triangles.push_back({left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  for (std::size_t i = 1; i + 1 < left.size(); ++i) {
    triangles.push_back({left[0], left[i], left[i + 1]});
  }
  return triangles;
}

}  // namespace haarlight
