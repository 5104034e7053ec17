// Which vertices stand at one place.

#include "precompute/vertex_places.h"

#include <algorithm>
#include <cstddef>
#include <tuple>

namespace haarlight {

std::vector<std::uint32_t> vertex_places(std::span<const Vec3> positions) {
  std::vector<std::uint32_t> sorted(positions.size());
  for (std::size_t v = 0; v < sorted.size(); ++v) sorted[v] = static_cast<std::uint32_t>(v);
  std::sort(sorted.begin(), sorted.end(), [&](std::uint32_t a, std::uint32_t b) {
    const Vec3 &p = positions[a], &q = positions[b];
    return std::tie(p.x, p.y, p.z, a) < std::tie(q.x, q.y, q.z, b);
  });
  std::vector<std::uint32_t> place(positions.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const bool same = i > 0 && positions[sorted[i]] == positions[sorted[i - 1]];
    place[sorted[i]] = same ? place[sorted[i - 1]] : sorted[i];
  }
  return place;
}

}  // namespace haarlight
