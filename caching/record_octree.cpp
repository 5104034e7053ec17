// Octree of records.

#include "caching/record_octree.h"

#include <algorithm>
#include <cmath>

namespace haarlight {

RecordOctree::RecordOctree(const Vec3& center, double half_edge)
    : low_(center - Vec3{half_edge, half_edge, half_edge}), edge_(2 * half_edge), cell_(1) {}

RecordOctree RecordOctree::around(const std::vector<Vec3>& points) {
  Vec3 low = points.front(), high = low;
  for (const Vec3& p : points) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const Vec3 size = high - low;
  const double edge = std::max({size.x, size.y, size.z});
  return {(low + high) * 0.5, edge > 0 ? edge / 2 : 1};
}

std::array<std::uint32_t, 3> RecordOctree::address(const Vec3& place) const {
  constexpr double kCells = 1 << kDeepest;
  const Vec3 at = (place - low_) * (kCells / edge_);
  const auto whole = [](double x) {
    return static_cast<std::uint32_t>(std::clamp(std::floor(x), 0.0, kCells - 1));
  };
  return {whole(at.x), whole(at.y), whole(at.z)};
}

void RecordOctree::insert(std::uint32_t number, const Vec3& position, double radius) {
  int level = 0;
  while (level < kDeepest && std::ldexp(edge_, -level - 1) >= 2 * radius) ++level;
  const Vec3 reach{radius, radius, radius};
  const auto low = address(position - reach), high = address(position + reach);
  const int shift = kDeepest - level;
  std::array<std::uint32_t, 3> at{};
  // A sphere no wider than half a cube touches at most two of them along each axis.
  for (std::uint32_t z = low[2] >> shift; z <= high[2] >> shift; ++z) {
    for (std::uint32_t y = low[1] >> shift; y <= high[1] >> shift; ++y) {
      for (std::uint32_t x = low[0] >> shift; x <= high[0] >> shift; ++x) {
        at = {x << shift, y << shift, z << shift};
        std::size_t cell = 0;
        for (int l = 0; l < level; ++l) {
          const std::size_t o = octant(at, l);
          if (cell_[cell].child[o] < 0) {
            cell_[cell].child[o] = static_cast<std::int32_t>(cell_.size());
            cell_.emplace_back();
          }
          cell = static_cast<std::size_t>(cell_[cell].child[o]);
        }
        cell_[cell].record.push_back(number);
      }
    }
  }
  depth_ = std::max(depth_, level);
}

}  // namespace haarlight
