// Cube map geometry: which direction is which texel, and how much of the sphere it covers.

#pragma once

#include <cstddef>
#include <vector>

#include "core/rgb.h"
#include "core/vec.h"

namespace haarlight {

/// Where a direction meets the cube: face 0..5 in the order +X -X +Y -Y +Z -Z, and (u, v) in
/// [-1, 1] with u to the right and v down as the face's texels are stored.
///
///   face      direction of (u, v), before normalising     (OpenGL's cube map orientation)
///   0  +X     ( 1, -v, -u)
///   1  -X     (-1, -v,  u)
///   2  +Y     ( u,  1,  v)
///   3  -Y     ( u, -1, -v)
///   4  +Z     ( u, -v,  1)
///   5  -Z     (-u, -v, -1)
struct CubePoint {
  int face = 0;
  double u = 0, v = 0;
};

/// The unit direction of a point on the cube.
Vec3 cube_direction(const CubePoint& point);

/// The face and (u, v) of a direction of any non-zero length. On edges and corners the axis of
/// lower number wins (X before Y before Z); u and v are clamped to [-1, 1], so that the texel found
/// from them is always in range.
CubePoint cube_point(const Vec3& direction);

/// Texel of a coordinate in [-1, 1] on an axis of n texels: floor, with +1 belonging to the last.
int cube_texel(double coordinate, int n);

/// Index of texel (x, y) of a face in [face][y][x] order.
constexpr std::size_t cube_index(int face, int x, int y, int n) {
  return (static_cast<std::size_t>(face) * static_cast<std::size_t>(n) +
          static_cast<std::size_t>(y)) *
             static_cast<std::size_t>(n) +
         static_cast<std::size_t>(x);
}

/// Direction through the centre of texel (x, y).
Vec3 cube_texel_center(int face, int x, int y, int n);

/// Exact solid angle (sr) of a texel of an n x n face, the same on every face; relative error below
/// 1e-14. By Gauss-Legendre quadrature of (1 + u^2 + v^2)^(-3/2): the closed form by four corners,
/// atan2(u v, sqrt(1 + u^2 + v^2)), loses 1 / solid angle to cancellation. Needs n >= 1.
double cube_texel_solid_angle(int x, int y, int n);

/// All n * n solid angles of one face, row-major; 6 times their sum is 4 pi.
std::vector<double> cube_solid_angles(int n);

/// A cube map of radiance: texels in [face][y][x] order, 6 * n * n of them.
struct Cubemap {
  int n = 0;
  std::vector<Rgb> texels;

  explicit Cubemap(int face_size = 0)
      : n(face_size),
        texels(6 * static_cast<std::size_t>(face_size) * static_cast<std::size_t>(face_size)) {}
};

}  // namespace haarlight
