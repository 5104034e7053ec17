// Puts simple surfaces together into a scene: grids, quads, boxes, spheres, tubes, lathes.

#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "precompute/scene.h"

namespace haarlight::data_gen {

/// A point of a profile that a lathe turns about +Y.
struct ProfilePoint {
  double radius = 0, height = 0;
};

/// Every surface is added with outward normals and triangles counter-clockwise seen from outside.
class MeshBuilder {
 public:
  /// Returns the material's index, which the calls below take.
  std::uint32_t add_material(const std::string& name, const Rgb& albedo, const Rgb& specular = {},
                             float exponent = 32);
  std::uint32_t add_material(const Material& material);
  /// A picture for Material::texture; `alpha` is empty or one a pixel.
  int add_texture(const Image& picture, const std::vector<float>& alpha = {});

  /// A surface of columns x rows quads over (s, t) in [0, 1]^2, smooth normals from its own
  /// triangles. The outside is where d/ds x d/dt points; `close_s` joins s = 1 to s = 0 in the
  /// normals (not in the vertices), as for a tube.
  void add_grid(std::uint32_t material, int columns, int rows,
                const std::function<Vec3(double s, double t)>& surface, bool close_s = false);

  /// Flat quad a, b, c, d, counter-clockwise from outside. A texture is repeated so often from a to
  /// b (its u) and from b to c (its v).
  void add_quad(std::uint32_t material, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d,
                const std::array<float, 2>& repeats = {0, 0});
  /// Square on y = 0 from -half to half.
  void add_ground(std::uint32_t material, double half, float repeats = 0);
  /// Axis-aligned box turned about +Y by `radians` around the middle of its bottom, `base`.
  void add_box(std::uint32_t material, const Vec3& base, const Vec3& size, double radians = 0);
  /// Ellipsoid with the given half axes, `segments` around and half as many from pole to pole.
  void add_ellipsoid(std::uint32_t material, const Vec3& center, const Vec3& radii, int segments);
  /// Tube along `path` (at least two points) with a radius for each of them, open at the ends.
  void add_tube(std::uint32_t material, std::span<const Vec3> path, std::span<const double> radii,
                int sides);
  /// Turns a profile about the vertical line through `base`. Walk the profile with the outside on
  /// the right hand (up an outer wall). Each pair of points is a smooth ring with flat shading
  /// between the rings, so that rims stay crisp.
  void add_lathe(std::uint32_t material, const Vec3& base, std::span<const ProfilePoint> profile,
                 int segments);

  /// The scene, with `camera` in it. The builder is empty afterwards.
  Scene finish(const Camera& camera);

 private:
  std::uint32_t add_vertex(const Vec3& position, const Vec3& normal,
                           const std::array<float, 2>& uv = {0, 0});
  Scene scene_;
};

}  // namespace haarlight::data_gen
