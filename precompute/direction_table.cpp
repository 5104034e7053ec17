// The fixed directions along which every shading point looks: a few in each cube texel.

#include "precompute/direction_table.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

double radical_inverse(int i) {
  double result = 0, digit = 0.5;
  for (; i > 0; i >>= 1, digit *= 0.5) result += (i & 1) * digit;
  return result;
}

Vec3 place_direction(int face, double column, double row, int n) {
  return cube_direction({face, 2 * column / n - 1, 2 * row / n - 1});
}

// Solid angle per unit of u and v, up to a constant factor.
double density(double column, double row, int n) {
  const double u = 2 * column / n - 1, v = 2 * row / n - 1;
  return std::pow(1 + u * u + v * v, -1.5);
}

// A chord, rounded up far enough that float dot products with it stay on the safe side: they are
// wrong by at most 4 u < 3e-7.
float safe_radius(double chord) { return static_cast<float>(chord + 1e-6); }

}  // namespace

std::vector<TexelPlace> texel_places(int count) {
  // Columns in order, rows in the order of the van der Corput sequence (Hammersley's set with both
  // projections made even). The small shift keeps rays off the lines of symmetry that made-up
  // scenes like to put their edges and vertices on.
  std::vector<int> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [](int a, int b) { return radical_inverse(a) < radical_inverse(b); });
  const double shift_u = 0.0271, shift_v = -0.0193;  // of a column; arbitrary
  std::vector<TexelPlace> places(static_cast<std::size_t>(count));
  for (int rank = 0; rank < count; ++rank) {
    const int i = order[static_cast<std::size_t>(rank)];
    places[static_cast<std::size_t>(i)] = {(i + 0.5 + shift_u) / count,
                                           (rank + 0.5 + shift_v) / count};
  }
  const auto off_middle = [](const TexelPlace& p) {
    return (p.u - 0.5) * (p.u - 0.5) + (p.v - 0.5) * (p.v - 0.5);
  };
  const auto nearest =
      std::min_element(places.begin(), places.end(),
                       [&](const auto& a, const auto& b) { return off_middle(a) < off_middle(b); });
  std::iter_swap(places.begin(), nearest);
  return places;
}

std::size_t texel_of(const Vec3& direction, int n) {
  const CubePoint p = cube_point(direction);
  return cube_index(p.face, cube_texel(p.u, n), cube_texel(p.v, n), n);
}

DirectionTable::DirectionTable(int face_size, int samples_per_texel)
    : n(face_size), samples(samples_per_texel) {
  const auto size = static_cast<std::size_t>(n);
  const std::size_t count = 6 * size * size;
  const auto per_texel = static_cast<std::size_t>(samples);
  sample.resize(count * per_texel);
  moment_x.resize(count), moment_y.resize(count), moment_z.resize(count);

  const std::vector<TexelPlace> places = texel_places(samples);
  const std::vector<double> solid_angle = cube_solid_angles(n);
  std::vector<double> share(per_texel);
  for (int face = 0; face < 6; ++face) {
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        const std::size_t texel = cube_index(face, x, y, n);
        double total = 0;
        for (std::size_t s = 0; s < per_texel; ++s) {
          share[s] = density(x + places[s].u, y + places[s].v, n);
          total += share[s];
        }
        const double whole = solid_angle[cube_index(0, x, y, n)];
        Vec3 moment;
        for (std::size_t s = 0; s < per_texel; ++s) {
          const Vec3 d = place_direction(face, x + places[s].u, y + places[s].v, n);
          const double omega = whole * share[s] / total;
          sample[texel * per_texel + s] = {static_cast<float>(d.x), static_cast<float>(d.y),
                                           static_cast<float>(d.z), static_cast<float>(omega)};
          moment = moment + omega * d;
        }
        moment_x[texel] = static_cast<float>(moment.x);
        moment_y[texel] = static_cast<float>(moment.y);
        moment_z[texel] = static_cast<float>(moment.z);
      }
    }
  }

  for (std::size_t s = 0; s < per_texel; ++s) {
    for (std::size_t k = 0; k < count; ++k) {
      const Sample& d = sample[k * per_texel + s];
      plane_x.push_back(d.x), plane_y.push_back(d.y), plane_z.push_back(d.z);
      plane_solid_angle.push_back(d.solid_angle);
    }
  }

  const int side = std::min(n, 8);
  for (int face = 0; face < 6; ++face) {
    for (int gy = 0; gy < n; gy += side) {
      for (int gx = 0; gx < n; gx += side) {
        // On a plane seen from a point a distance from an axis is largest at a corner.
        const Vec3 axis = place_direction(face, gx + 0.5 * side, gy + 0.5 * side, n);
        double reach = 0;
        for (int c = 0; c < 4; ++c) {
          const Vec3 corner = place_direction(face, gx + (c & 1) * side, gy + (c >> 1) * side, n);
          reach = std::max(reach, length(corner - axis));
        }
        Group g{static_cast<float>(axis.x),
                static_cast<float>(axis.y),
                static_cast<float>(axis.z),
                safe_radius(reach),
                static_cast<std::int32_t>(packet.size()),
                0};
        for (int y = gy; y < gy + side; y += 2) {
          for (int x = gx; x < gx + side; x += 4) {
            Packet p{};
            double radius = 0;
            for (int lane = 0; lane < 8; ++lane) {
              const int tx = x + lane % 4, ty = y + lane / 4;
              const Sample& first = sample[cube_index(face, tx, ty, n) * per_texel];
              const Vec3 centre = cube_texel_center(face, tx, ty, n);
              p.x[lane] = first.x, p.y[lane] = first.y, p.z[lane] = first.z;
              p.cx[lane] = static_cast<float>(centre.x);
              p.cy[lane] = static_cast<float>(centre.y);
              p.cz[lane] = static_cast<float>(centre.z);
              for (int c = 0; c < 4; ++c) {
                const Vec3 corner = place_direction(face, tx + (c & 1), ty + (c >> 1), n);
                radius = std::max(radius, length(corner - centre));
              }
            }
            p.radius = safe_radius(radius);
            p.top = static_cast<std::int32_t>(cube_index(face, x, y, n));
            p.bottom = static_cast<std::int32_t>(cube_index(face, x, y + 1, n));
            packet.push_back(p);
            ++g.count;
          }
        }
        group.push_back(g);
      }
    }
  }

  // Step a quarter of a texel over each border of each face and see where one lands.
  for (int face = 0; face < 6; ++face) {
    for (int side_of_face = 0; side_of_face < 4; ++side_of_face) {
      for (int i = 0; i < n; ++i) {
        const bool vertical = side_of_face < 2;
        const double border = side_of_face % 2 == 0 ? 0 : n;
        const double inward = side_of_face % 2 == 0 ? 0.25 : -0.25;
        const Vec3 edge = vertical ? place_direction(face, border, i + 0.5, n)
                                   : place_direction(face, i + 0.5, border, n);
        const Vec3 inside = vertical ? place_direction(face, border + inward, i + 0.5, n)
                                     : place_direction(face, i + 0.5, border + inward, n);
        const CubePoint over = cube_point(edge + (edge - inside));
        const int last = static_cast<int>(border) == 0 ? 0 : n - 1;
        const auto here = static_cast<std::int32_t>(vertical ? cube_index(face, last, i, n)
                                                             : cube_index(face, i, last, n));
        const auto there = static_cast<std::int32_t>(
            cube_index(over.face, cube_texel(over.u, n), cube_texel(over.v, n), n));
        if (here < there) seam.push_back({here, there});
      }
    }
  }
}

}  // namespace haarlight
