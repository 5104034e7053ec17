// Which rays are blocked: the triangles of a scene in Embree. The only place that touches Embree.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/vec.h"
#include "precompute/scene.h"

namespace haarlight {

/// The triangles of a scene, ready for rays. Immutable and safe to use from any number of threads.
///
/// Rays live in local coordinates: the scene moved to the middle of its bounding box and scaled by
/// a power of two so that its largest coordinate is in [1, 2). So single precision is spent on the
/// scene itself wherever it stands, no epsilon depends on the unit of length, and a scene scaled by
/// a power of two gives the same bits.
class Visibility {
 public:
  /// Throws Error{missing} for a scene without triangles, Error{io} if Embree refuses.
  explicit Visibility(const Scene& scene);
  ~Visibility();
  Visibility(const Visibility&) = delete;
  Visibility& operator=(const Visibility&) = delete;

  Vec3 to_local(const Vec3& world) const { return (world - center_) * scale_; }

  /// How far a ray's origin is moved off the surface it starts on, local units. Rounding an origin
  /// to float moves it by at most 2 u sqrt(3) and Embree's plane distance is wrong by a few u of
  /// the distance to a corner (< 4 sqrt(3)); 64 u covers both with room, u = 2^-24.
  static constexpr double kSurfaceOffset = 64.0 / 16777216.0;

  struct Hit {
    std::uint32_t triangle = 0;
    double b1 = 0, b2 = 0;  ///< barycentric coordinates of the second and third corner
    double distance = 0;    ///< local units
  };
  /// The nearest triangle in front of `origin` (local) along the unit `direction`.
  std::optional<Hit> first_hit(const Vec3& origin, const Vec3& direction) const;

  /// Which of 8 rays from one origin (local) are blocked at any distance: bit i for direction
  /// (x[i], y[i], z[i]). Only the lanes set in `lanes` are traced, the others read as not blocked.
  /// x, y and z are aligned to 32 bytes.
  unsigned occluded8(const std::array<float, 3>& origin, const float* x, const float* y,
                     const float* z, unsigned lanes) const;

  std::size_t triangle_count() const { return triangle_count_; }
  /// Corner 0, 1 or 2 of a triangle as Embree holds it, local.
  Vec3 corner(std::uint32_t triangle, int corner) const;

 private:
  struct Device;
  std::unique_ptr<Device> device_;
  Vec3 center_;
  double scale_ = 1;
  std::size_t triangle_count_ = 0;
};

}  // namespace haarlight
