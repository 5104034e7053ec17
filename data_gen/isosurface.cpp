// A closed body from a function of space: surface nets.

#include "data_gen/isosurface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace haarlight::data_gen {
namespace {

Vec3 gradient(const std::function<double(const Vec3&)>& f, const Vec3& p, double step) {
  return Vec3{f(p + Vec3{step, 0, 0}) - f(p - Vec3{step, 0, 0}),
              f(p + Vec3{0, step, 0}) - f(p - Vec3{0, step, 0}),
              f(p + Vec3{0, 0, step}) - f(p - Vec3{0, 0, step})} *
         (0.5 / step);
}

}  // namespace

Scene isosurface(const std::function<double(const Vec3&)>& inside, const Vec3& low,
                 const Vec3& high, int cells) {
  const Vec3 size = high - low;
  const double cell = std::max({size.x, size.y, size.z}) / cells;
  const std::array<int, 3> n{static_cast<int>(std::ceil(size.x / cell)) + 1,
                             static_cast<int>(std::ceil(size.y / cell)) + 1,
                             static_cast<int>(std::ceil(size.z / cell)) + 1};
  const auto index = [&](int x, int y, int z) {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(n[1]) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(n[0]) +
           static_cast<std::size_t>(x);
  };
  const auto at = [&](int x, int y, int z) { return low + Vec3{x * cell, y * cell, z * cell}; };
  std::vector<double> value(index(n[0] - 1, n[1] - 1, n[2] - 1) + 1);
  for (int z = 0; z < n[2]; ++z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x) value[index(x, y, z)] = inside(at(x, y, z));
    }
  }

  Scene scene;
  scene.material.emplace_back();
  std::vector<std::uint32_t> vertex(value.size(), 0);
  for (int z = 0; z + 1 < n[2]; ++z) {
    for (int y = 0; y + 1 < n[1]; ++y) {
      for (int x = 0; x + 1 < n[0]; ++x) {
        Vec3 sum;
        int crossings = 0;
        const auto edge = [&](int ax, int ay, int az, int bx, int by, int bz) {
          const double a = value[index(x + ax, y + ay, z + az)];
          const double b = value[index(x + bx, y + by, z + bz)];
          if ((a < 0) == (b < 0)) return;
          const double t = a / (a - b);
          sum = sum + at(x + ax, y + ay, z + az) * (1 - t) + at(x + bx, y + by, z + bz) * t;
          ++crossings;
        };
        for (int i = 0; i < 2; ++i) {
          for (int j = 0; j < 2; ++j) {
            edge(0, i, j, 1, i, j), edge(i, 0, j, i, 1, j), edge(i, j, 0, i, j, 1);
          }
        }
        if (crossings == 0) continue;
        Vec3 p = sum * (1.0 / crossings);
        const Vec3 middle = at(x, y, z) + Vec3{cell, cell, cell} * 0.5;
        Vec3 slope = gradient(inside, p, 0.1 * cell);
        // Newton's steps, kept in the vertex' own cell so that no triangle folds over.
        for (int step = 0; step < 2 && dot(slope, slope) > 1e-12; ++step) {
          p = p - slope * (inside(p) / dot(slope, slope));
          const Vec3 d = p - middle;
          const auto kept = [&](double c) { return std::clamp(c, -0.45 * cell, 0.45 * cell); };
          p = middle + Vec3{kept(d.x), kept(d.y), kept(d.z)};
          slope = gradient(inside, p, 0.1 * cell);
        }
        vertex[index(x, y, z)] = static_cast<std::uint32_t>(scene.position.size());
        scene.position.push_back(p);
        const double steep = length(slope);
        scene.normal.push_back(steep > 1e-9 ? slope * (1 / steep) : Vec3{0, 1, 0});
        scene.uv.push_back({0, 0});
      }
    }
  }

  // A quad about each edge of the grid that the surface crosses, its diagonal the shorter one.
  const auto quad = [&](std::array<std::uint32_t, 4> q, bool turned) {
    if (turned) std::swap(q[1], q[3]);
    const Vec3 first = scene.position[q[2]] - scene.position[q[0]];
    const Vec3 second = scene.position[q[3]] - scene.position[q[1]];
    const std::size_t k = dot(second, second) < dot(first, first) ? 1 : 0;
    scene.triangle.push_back({{q[k], q[k + 1], q[k + 2]}, 0});
    scene.triangle.push_back({{q[k], q[k + 2], q[(k + 3) % 4]}, 0});
  };
  for (int z = 0; z + 1 < n[2]; ++z) {
    for (int y = 0; y + 1 < n[1]; ++y) {
      for (int x = 0; x + 1 < n[0]; ++x) {
        const bool in = value[index(x, y, z)] < 0;
        const auto v = [&](int dx, int dy, int dz) {
          return vertex[index(x - dx, y - dy, z - dz)];
        };
        if (y > 0 && z > 0 && in != (value[index(x + 1, y, z)] < 0)) {
          quad({v(0, 0, 0), v(0, 1, 0), v(0, 1, 1), v(0, 0, 1)}, !in);
        }
        if (z > 0 && x > 0 && in != (value[index(x, y + 1, z)] < 0)) {
          quad({v(0, 0, 0), v(0, 0, 1), v(1, 0, 1), v(1, 0, 0)}, !in);
        }
        if (x > 0 && y > 0 && in != (value[index(x, y, z + 1)] < 0)) {
          quad({v(0, 0, 0), v(1, 0, 0), v(1, 1, 0), v(0, 1, 0)}, !in);
        }
      }
    }
  }
  return scene;
}

double smooth_union(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k * 0.25;
}

double sphere_distance(const Vec3& p, const Vec3& center, double radius) {
  return length(p - center) - radius;
}

double ellipsoid_distance(const Vec3& p, const Vec3& center, const Vec3& radii) {
  const Vec3 q = p - center;
  const Vec3 a{q.x / radii.x, q.y / radii.y, q.z / radii.z};
  const double size = length(a);
  // First order: the function over its slope.
  const Vec3 g{a.x / radii.x, a.y / radii.y, a.z / radii.z};
  const double steep = length(g);
  return steep > 0 ? size * (size - 1) / steep : -std::min({radii.x, radii.y, radii.z});
}

double rod_distance(const Vec3& p, const Vec3& a, const Vec3& b, double ra, double rb) {
  const Vec3 along = b - a;
  const double t = std::clamp(dot(p - a, along) / dot(along, along), 0.0, 1.0);
  return length(p - a - along * t) - (ra + (rb - ra) * t);
}

}  // namespace haarlight::data_gen
