// Cube map geometry: which direction is which texel, and how much of the sphere it covers.

#include "wavelet/cubemap.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace haarlight {
namespace {

struct GaussPoint {
  double x, weight;
};

/// Gauss-Legendre on [-1, 1] with 4 points, exact to degree 7.
constexpr std::array<GaussPoint, 4> kGauss = {{{-0.861136311594052575224, 0.347854845137453857373},
                                               {-0.339981043584856264803, 0.652145154862546142627},
                                               {0.339981043584856264803, 0.652145154862546142627},
                                               {0.861136311594052575224, 0.347854845137453857373}}};

/// Squares along a face axis that the rule is used on at least. The integrand's nearest pole is at
/// distance 1 from the real axis; a square of half width h = 1/64 sees it at 64 half widths, so the
/// rule's error falls like (2 / h)^-8 = 1.4e-17.
constexpr int kLeastSquares = 64;

/// Integral of (1 + u^2 + v^2)^(-3/2), the solid angle of du dv, over one square.
double square_solid_angle(double u, double v, double half_width) {
  double sum = 0;
  for (const GaussPoint& gu : kGauss) {
    for (const GaussPoint& gv : kGauss) {
      const double pu = u + half_width * gu.x, pv = v + half_width * gv.x;
      const double s = 1 + pu * pu + pv * pv;
      sum += gu.weight * gv.weight / (s * std::sqrt(s));
    }
  }
  return sum * half_width * half_width;
}

}  // namespace

Vec3 cube_direction(const CubePoint& point) {
  const double u = point.u, v = point.v;
  Vec3 d;
  switch (point.face) {
    case 0:
      d = {1, -v, -u};
      break;
    case 1:
      d = {-1, -v, u};
      break;
    case 2:
      d = {u, 1, v};
      break;
    case 3:
      d = {u, -1, -v};
      break;
    case 4:
      d = {u, -v, 1};
      break;
    default:
      d = {-u, -v, -1};
      break;
  }
  return normalize(d);
}

CubePoint cube_point(const Vec3& direction) {
  const double ax = std::abs(direction.x), ay = std::abs(direction.y), az = std::abs(direction.z);
  CubePoint p;
  if (ax >= ay && ax >= az) {
    p.face = direction.x > 0 ? 0 : 1;
    p.u = (direction.x > 0 ? -direction.z : direction.z) / ax;
    p.v = -direction.y / ax;
  } else if (ay >= az) {
    p.face = direction.y > 0 ? 2 : 3;
    p.u = direction.x / ay;
    p.v = (direction.y > 0 ? direction.z : -direction.z) / ay;
  } else {
    p.face = direction.z > 0 ? 4 : 5;
    p.u = (direction.z > 0 ? direction.x : -direction.x) / az;
    p.v = -direction.y / az;
  }
  p.u = std::clamp(p.u, -1.0, 1.0);
  p.v = std::clamp(p.v, -1.0, 1.0);
  return p;
}

int cube_texel(double coordinate, int n) {
  return std::clamp(static_cast<int>(std::floor((coordinate + 1) * 0.5 * n)), 0, n - 1);
}

Vec3 cube_texel_center(int face, int x, int y, int n) {
  return cube_direction({face, (2 * x + 1.0) / n - 1, (2 * y + 1.0) / n - 1});
}

double cube_texel_solid_angle(int x, int y, int n) {
  // Mirrored and transposed texels are the same shape and get the same bits.
  int far = std::max(x, n - 1 - x), near = std::max(y, n - 1 - y);
  if (far < near) std::swap(far, near);

  const int squares = std::max(1, kLeastSquares / n);
  const double half_width = 1.0 / n / squares;
  double sum = 0;
  for (int j = 0; j < squares; ++j) {
    for (int i = 0; i < squares; ++i) {
      sum += square_solid_angle((2.0 * (far * squares + i) + 1) * half_width - 1,
                                (2.0 * (near * squares + j) + 1) * half_width - 1, half_width);
    }
  }
  return sum;
}

std::vector<double> cube_solid_angles(int n) {
  std::vector<double> result;
  result.reserve(static_cast<std::size_t>(n) * static_cast<std::size_t>(n));
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) result.push_back(cube_texel_solid_angle(x, y, n));
  }
  return result;
}

}  // namespace haarlight
