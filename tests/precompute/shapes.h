// Small scenes for tests: quads, boxes, spheres, random triangles.

#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <utility>

#include "precompute/scene.h"

namespace haarlight::shapes {

inline Scene empty_scene() {
  Scene scene;
  scene.name = "test";
  scene.material.emplace_back();
  return scene;
}

inline std::uint32_t add_vertex(Scene& scene, const Vec3& position, const Vec3& normal) {
  scene.position.push_back(position);
  scene.normal.push_back(normal);
  scene.uv.push_back({0, 0});
  return static_cast<std::uint32_t>(scene.position.size() - 1);
}

// A parallelogram with its own four vertices; faces cross(along, across).
inline void add_quad(Scene& scene, const Vec3& corner, const Vec3& along, const Vec3& across,
                     std::uint32_t material = 0) {
  const Vec3 normal = normalize(cross(along, across));
  const std::uint32_t a = add_vertex(scene, corner, normal);
  const std::uint32_t b = add_vertex(scene, corner + along, normal);
  const std::uint32_t c = add_vertex(scene, corner + along + across, normal);
  const std::uint32_t d = add_vertex(scene, corner + across, normal);
  scene.triangle.push_back({{a, b, c}, material});
  scene.triangle.push_back({{a, c, d}, material});
}

// A closed box, faces outwards.
inline void add_box(Scene& scene, const Vec3& low, const Vec3& high, std::uint32_t material = 0) {
  const Vec3 s = high - low;
  const Vec3 x{s.x, 0, 0}, y{0, s.y, 0}, z{0, 0, s.z};
  add_quad(scene, low, y, x, material);
  add_quad(scene, low, z, y, material);
  add_quad(scene, low, x, z, material);
  add_quad(scene, high, -x, -y, material);
  add_quad(scene, high, -y, -z, material);
  add_quad(scene, high, -z, -x, material);
}

// A sphere from an octahedron divided `levels` times, with smooth normals.
inline void add_sphere(Scene& scene, const Vec3& center, double radius, int levels,
                       std::uint32_t material = 0) {
  std::vector<Vec3> corner{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::vector<std::array<std::uint32_t, 3>> face{{4, 0, 2}, {0, 5, 2}, {5, 1, 2}, {1, 4, 2},
                                                 {0, 4, 3}, {5, 0, 3}, {1, 5, 3}, {4, 1, 3}};
  for (int l = 0; l < levels; ++l) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middle;
    const auto between = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, is_new] = middle.try_emplace({std::min(a, b), std::max(a, b)},
                                                   static_cast<std::uint32_t>(corner.size()));
      if (is_new) corner.push_back(normalize(corner[a] + corner[b]));
      return at->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : face) {
      const std::uint32_t ab = between(a, b), bc = between(b, c), ca = between(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    face = std::move(finer);
  }
  const auto first = static_cast<std::uint32_t>(scene.position.size());
  for (const Vec3& c : corner) add_vertex(scene, center + radius * c, c);
  for (const auto& [a, b, c] : face) {
    scene.triangle.push_back({{first + a, first + b, first + c}, material});
  }
}

inline Vec3 random_direction(std::mt19937& random) {
  std::normal_distribution<double> gauss;
  return normalize(Vec3{gauss(random), gauss(random), gauss(random)});
}

inline void add_random_triangles(Scene& scene, int count, double size, std::mt19937& random) {
  std::uniform_real_distribution<double> place(-1, 1);
  for (int i = 0; i < count; ++i) {
    const Vec3 a{place(random), place(random), place(random)};
    const Vec3 b = a + size * random_direction(random), c = a + size * random_direction(random);
    const Vec3 normal = normalize(cross(b - a, c - a));
    const std::uint32_t first = add_vertex(scene, a, normal);
    add_vertex(scene, b, normal);
    add_vertex(scene, c, normal);
    scene.triangle.push_back({{first, first + 1, first + 2}, 0});
  }
}

inline Scene moved(Scene scene, double scale, const Vec3& by) {
  for (Vec3& p : scene.position) p = scale * p + by;
  return scene;
}

}  // namespace haarlight::shapes
