// The connected pieces of a scene, and which of them are convex.

#include "precompute/scene_objects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace haarlight {
namespace {

constexpr double kFlat = 1e-6;

std::uint32_t root(std::vector<std::uint32_t>& parent, std::uint32_t v) {
  while (parent[v] != v) {
    parent[v] = parent[parent[v]];
    v = parent[v];
  }
  return v;
}

// Half the longest side of the box around a scene; 0 for none.
double half_extent(const Scene& scene) {
  constexpr double kMax = std::numeric_limits<double>::max();
  Vec3 low{kMax, kMax, kMax}, high = -low;
  for (const Vec3& p : scene.position) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  return scene.position.empty() ? 0
                                : 0.5 * std::max({high.x - low.x, high.y - low.y, high.z - low.z});
}

// The first vertex at the same place to `grain`, for each.
std::vector<std::uint32_t> weld(const Scene& scene, double grain) {
  const std::vector<Vec3>& p = scene.position;
  std::vector<std::uint32_t> order(p.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t v) {
    return std::array<double, 3>{std::round(p[v].x / grain), std::round(p[v].y / grain),
                                 std::round(p[v].z / grain)};
  };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return key(a) != key(b) ? key(a) < key(b) : a < b;
  });
  std::vector<std::uint32_t> first(p.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && key(order[i]) == key(order[i - 1]);
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  return first;
}

struct Edge {
  std::uint32_t from, to, triangle, opposite;
  bool forward;  // as the triangle's corners run
};

}  // namespace

SceneObjects find_objects(const Scene& scene) {
  const double grain = std::max(kFlat * half_extent(scene), std::numeric_limits<double>::min());
  const std::vector<std::uint32_t> place = weld(scene, grain);
  std::vector<std::uint32_t> parent(scene.position.size());
  std::iota(parent.begin(), parent.end(), 0u);
  for (const Triangle& t : scene.triangle) {
    for (const std::uint32_t v : t.vertex) {
      const std::uint32_t a = root(parent, place[t.vertex[0]]), b = root(parent, place[v]);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  SceneObjects objects;
  std::vector<std::int32_t> number(scene.position.size(), -1);
  for (const Triangle& t : scene.triangle) {
    std::int32_t& n = number[root(parent, place[t.vertex[0]])];
    if (n < 0) {
      n = static_cast<std::int32_t>(objects.convex.size());
      objects.convex.push_back(true);
    }
    objects.object_of.push_back(n);
  }

  std::vector<Edge> edges;
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t a = place[scene.triangle[t].vertex[c]];
      const std::uint32_t b = place[scene.triangle[t].vertex[(c + 1) % 3]];
      edges.push_back({std::min(a, b), std::max(a, b), static_cast<std::uint32_t>(t),
                       place[scene.triangle[t].vertex[(c + 2) % 3]], a < b});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::array{a.from, a.to, a.triangle} < std::array{b.from, b.to, b.triangle};
  });

  // Euler's characteristic and the signs of edges: one sign for all of an object.
  const std::size_t count = objects.convex.size();
  std::vector<std::int64_t> vertices(count, 0), pairs(count, 0), faces(count, 0);
  std::vector<int> sign(count, 0);
  std::vector<bool> counted(scene.position.size(), false);
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    const auto object = static_cast<std::size_t>(objects.object_of[t]);
    ++faces[object];
    for (const std::uint32_t v : scene.triangle[t].vertex) {
      if (counted[place[v]]) continue;
      counted[place[v]] = true;
      ++vertices[object];
    }
  }
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && edges[end].from == edges[i].from && edges[end].to == edges[i].to) {
      ++end;
    }
    const auto object = static_cast<std::size_t>(objects.object_of[edges[i].triangle]);
    ++pairs[object];
    if (end - i != 2 || edges[i].forward == edges[i + 1].forward) {
      objects.convex[object] = false;
    } else {
      // On which side of the first triangle's plane the second one's far corner lies.
      const Triangle& t = scene.triangle[edges[i].triangle];
      const Vec3& a = scene.position[t.vertex[0]];
      const Vec3 normal = cross(scene.position[t.vertex[1]] - a, scene.position[t.vertex[2]] - a);
      const Vec3 far = scene.position[edges[i + 1].opposite] - a;
      const double above = dot(normal, far);
      if (std::abs(above) > grain * length(normal)) {
        const int side = above > 0 ? 1 : -1;
        if (sign[object] == -side) objects.convex[object] = false;
        sign[object] = side;
      }
    }
    i = end;
  }
  for (std::size_t o = 0; o < count; ++o) {
    if (vertices[o] - pairs[o] + faces[o] != 2 || sign[o] == 0) objects.convex[o] = false;
  }
  return objects;
}

}  // namespace haarlight
