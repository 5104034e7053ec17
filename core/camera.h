// A pinhole camera.

#pragma once

#include "core/vec.h"

namespace haarlight {

/// Looks along -Z of its own frame with +X right and +Y up, as glTF's cameras do. `orientation`
/// takes directions of that frame to the world.
struct Camera {
  Vec3 position;                  ///< metres
  Rotation orientation;           ///< columns are right, up, backwards in the world
  double vertical_fov = 0.7;      ///< radians, in (0, pi)
  int width = 512, height = 512;  ///< pixels

  bool operator==(const Camera&) const = default;

  /// Unit direction through a place in the picture: (x, y) in pixels, the middle of the top left
  /// pixel is (0.5, 0.5), y down. Pixels are square.
  Vec3 direction(double x, double y) const {
    const double half = std::tan(0.5 * vertical_fov);
    const double px = (2.0 * x - width) / height * half;
    const double py = (height - 2.0 * y) / height * half;
    return normalize(orientation * Vec3{px, py, -1.0});
  }
};

/// A camera at `position` looking at `target`, upright about +Y (or about +Z when looking straight
/// up or down). Requires position != target.
inline Camera look_at(const Vec3& position, const Vec3& target, double vertical_fov, int width,
                      int height) {
  const Vec3 back = normalize(position - target);
  const Vec3 up_hint =
      std::abs(back.y) > 0.9999 ? Vec3{0, 0, back.y > 0 ? -1.0 : 1.0} : Vec3{0, 1, 0};
  const Vec3 right = normalize(cross(up_hint, back));
  const Vec3 up = cross(back, right);
  Camera camera;
  camera.position = position;
  camera.orientation = Rotation{
      {Vec3{right.x, up.x, back.x}, Vec3{right.y, up.y, back.y}, Vec3{right.z, up.z, back.z}}};
  camera.vertical_fov = vertical_fov;
  camera.width = width;
  camera.height = height;
  return camera;
}

/// `camera` carried round the vertical axis through `center` by `radians`, right-handed about +Y,
/// keeping `center` where it is in the picture. By 0 it is the same bits.
inline Camera turned_about(Camera camera, const Vec3& center, double radians) {
  if (radians == 0) return camera;
  const Rotation turn = rotation_y(radians);
  camera.position = center + turn * (camera.position - center);
  camera.orientation = turn * camera.orientation;
  return camera;
}

}  // namespace haarlight
