// The picture layouts that distant light comes in, and which pixel of them is which direction.

#include "wavelet/projection.h"

#include <algorithm>
#include <cmath>

#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

/// Places this far outside a layout's edge (rounding of a computed edge) still belong to it.
constexpr double kEdge = 1e-9;

Vec3 latlong_direction(double u, double v) {
  const double azimuth = 2 * kPi * (u - 0.5);  // from -Z towards +X
  const double polar = kPi * v;                // from +Y
  return {std::sin(polar) * std::sin(azimuth), std::cos(polar),
          -std::sin(polar) * std::cos(azimuth)};
}

PicturePoint latlong_point(const Vec3& d) {
  return {0.5 + std::atan2(d.x, -d.z) / (2 * kPi), std::atan2(std::hypot(d.x, d.z), d.y) / kPi};
}

std::optional<Vec3> angular_direction(double u, double v) {
  const double x = 2 * u - 1, y = 1 - 2 * v;
  const double radius = std::hypot(x, y);
  if (radius > 1 + kEdge) return std::nullopt;
  if (radius == 0) return Vec3{0, 0, -1};
  const double angle = kPi * std::min(radius, 1.0);
  const double s = std::sin(angle) / radius;
  return Vec3{s * x, s * y, -std::cos(angle)};
}

PicturePoint angular_point(const Vec3& d) {
  const double side = std::hypot(d.x, d.y);
  const double radius = std::atan2(side, -d.z) / kPi;
  if (side == 0) return {0.5 + 0.5 * radius, 0.5};  // -Z, or any point of the rim for +Z
  return {0.5 + 0.5 * radius * (d.x / side), 0.5 - 0.5 * radius * (d.y / side)};
}

std::optional<Vec3> cross_direction(double u, double v) {
  const double x = 3 * u, y = 4 * v;
  int column = 1, row = 1;
  if (x >= 1 - kEdge && x <= 2 + kEdge && y >= -kEdge && y <= 4 + kEdge) {
    row = std::clamp(static_cast<int>(std::floor(y)), 0, 3);
  } else if (y >= 1 - kEdge && y <= 2 + kEdge && x >= -kEdge && x <= 3 + kEdge) {
    column = x < 1 ? 0 : 2;
  } else {
    return std::nullopt;
  }
  const double a = std::clamp(2 * (x - column) - 1, -1.0, 1.0);  // to the right in the face
  const double b = std::clamp(2 * (y - row) - 1, -1.0, 1.0);     // down in the face
  if (column == 0) return normalize(Vec3{-1, -b, -a});
  if (column == 2) return normalize(Vec3{1, -b, a});
  switch (row) {
    case 0:
      return normalize(Vec3{a, 1, -b});
    case 1:
      return normalize(Vec3{a, -b, -1});
    case 2:
      return normalize(Vec3{a, -1, b});
    default:
      return normalize(Vec3{a, b, 1});
  }
}

PicturePoint cross_point(const Vec3& direction) {
  const CubePoint p = cube_point(direction);
  // The cross shows faces from inside, the cube map stores them from outside: one axis of each is
  // mirrored, u in the row -X -Z +X, v in the column +Y -Y +Z.
  double a = p.u, b = -p.v;
  int column = 1, row = 1;
  switch (p.face) {
    case 0:
      column = 2, a = -p.u, b = p.v;
      break;
    case 1:
      column = 0, a = -p.u, b = p.v;
      break;
    case 2:
      row = 0;
      break;
    case 3:
      row = 2;
      break;
    case 4:
      row = 3;
      break;
    default:
      a = -p.u, b = p.v;
      break;
  }
  return {(column + 0.5 * (a + 1)) / 3, (row + 0.5 * (b + 1)) / 4};
}

}  // namespace

std::optional<Vec3> projection_direction(Projection projection, double u, double v) {
  switch (projection) {
    case Projection::latlong:
      return latlong_direction(u, v);
    case Projection::angular:
      return angular_direction(u, v);
    case Projection::vertical_cross:
      return cross_direction(u, v);
  }
  return std::nullopt;
}

PicturePoint projection_point(Projection projection, const Vec3& direction) {
  switch (projection) {
    case Projection::latlong:
      return latlong_point(direction);
    case Projection::angular:
      return angular_point(direction);
    case Projection::vertical_cross:
      return cross_point(direction);
  }
  return {};
}

std::optional<Projection> projection_of_shape(int width, int height) {
  if (width < 1 || height < 1) return std::nullopt;
  const long long w = width, h = height;
  if (w == 2 * h) return Projection::latlong;
  if (w == h) return Projection::angular;
  if (4 * w == 3 * h) return Projection::vertical_cross;
  return std::nullopt;
}

std::optional<Projection> projection_from_name(std::string_view name) {
  for (const Projection p :
       {Projection::latlong, Projection::angular, Projection::vertical_cross}) {
    if (name == projection_name(p)) return p;
  }
  return std::nullopt;
}

std::string projection_name(Projection projection) {
  switch (projection) {
    case Projection::latlong:
      return "latlong";
    case Projection::angular:
      return "angular";
    case Projection::vertical_cross:
      return "vertical-cross";
  }
  return "unknown";
}

}  // namespace haarlight
