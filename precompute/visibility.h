// Which rays are blocked: the triangles of a scene in Embree. The only place that touches Embree.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/vec.h"
#include "precompute/scene.h"

namespace haarlight {

/// The triangles of a scene, ready for rays. Immutable and safe to use from any number of threads.
/// Rays pass through the holes that alpha textures cut (Material::alpha_cutoff). The scene is not
/// needed afterwards.
///
/// Rays live in local coordinates: the scene moved to the middle of its bounding box and scaled by
/// a power of two so that its largest coordinate is in [1, 2). So single precision is spent on the
/// scene itself wherever it stands, no epsilon depends on the unit of length, and a scene scaled by
/// a power of two gives the same bits.
class Visibility {
 public:
  /// Which surfaces a ray sees.
  enum Surfaces : unsigned {
    kOpaque = 1,    ///< those that has_single_directions() denies
    kSpecular = 2,  ///< those that may have some: mirrors, glass, thin transmission
    kGlossy = 4,    ///< of the opaque ones those that may_have_narrow_lobe() names
    kAll = 3
  };

  /// Throws Error{missing} for a scene without triangles, Error{io} if Embree refuses.
  explicit Visibility(const Scene& scene);
  /// Where local coordinates lie: local = (world - center) * scale.
  struct LocalFrame {
    Vec3 center;
    double scale = 1;
  };
  /// The frame that the constructor above takes. Throws as it does.
  static LocalFrame local_frame(const Scene& scene);
  /// Some triangles of a scene in a frame that is given, largest coordinates below 2: what moves
  /// apart from what does not. Hits and corners() bear the numbers of the scene. Built fast, and
  /// without splitting triangles: whether a ray meets a triangle does not depend on the others, so
  /// that single rays through the parts of a scene find what they find in the whole, bit by bit.
  Visibility(const Scene& scene, const LocalFrame& frame, std::span<const std::uint32_t> triangles);
  ~Visibility();
  Visibility(const Visibility&) = delete;
  Visibility& operator=(const Visibility&) = delete;

  Vec3 to_local(const Vec3& world) const { return (world - center_) * scale_; }
  /// A local length in metres.
  double to_world_length(double local) const { return local / scale_; }

  /// How far a ray's origin is moved off the surface it starts on, local units. Rounding an origin
  /// to float moves it by at most 2 u sqrt(3) and Embree's plane distance is wrong by a few u of
  /// the distance to a corner (< 4 sqrt(3)); 64 u covers both with room, u = 2^-24.
  static constexpr double kSurfaceOffset = 64.0 / 16777216.0;

  struct Hit {
    std::uint32_t triangle = 0;
    double b1 = 0, b2 = 0;  ///< barycentric coordinates of the second and third corner
    double distance = 0;    ///< local units
  };
  /// The nearest triangle in front of `from` (local, however far off) along the unit `direction`.
  std::optional<Hit> first_hit(const Vec3& from, const Vec3& direction, Surfaces seen = kAll) const;

  /// Whether anything lies between `origin` (local) and origin + distance * direction. Both ends
  /// should be off the surfaces they belong to (kSurfaceOffset): what is met at an end blocks.
  bool occluded(const std::array<float, 3>& origin, const Vec3& direction, double distance,
                Surfaces seen = kAll) const;

  /// Which of 8 rays from one origin (local) are blocked at any distance: bit i for direction
  /// (x[i], y[i], z[i]). Only the lanes set in `lanes` are traced, the others read as not blocked.
  /// x, y and z are aligned to 32 bytes.
  unsigned occluded8(const std::array<float, 3>& origin, const float* x, const float* y,
                     const float* z, unsigned lanes, Surfaces seen = kAll) const;

  /// The same for segments from `origin` to origin + (x[i], y[i], z[i]), of any length. What is met
  /// at an end blocks: shorten or move what should not reach its own surface. A segment of no
  /// length is not blocked.
  unsigned occluded8_segments(const std::array<float, 3>& origin, const float* x, const float* y,
                              const float* z, unsigned lanes, Surfaces seen = kAll) const;

  /// Eight rays, each from its own origin (local, within 1e4 of the middle) as far as its length.
  struct Rays8 {
    alignas(32) std::array<std::array<float, 8>, 3> origin{};
    alignas(32) std::array<std::array<float, 8>, 3> direction{};  ///< unit
    alignas(32) std::array<float, 8> length{};
    unsigned lanes = 0;  ///< bit i: ray i is one

    void set(std::size_t i, const std::array<float, 3>& from, const Vec3& way, double size) {
      for (std::size_t a = 0; a < 3; ++a) origin[a][i] = from[a];
      direction[0][i] = static_cast<float>(way.x), direction[1][i] = static_cast<float>(way.y);
      direction[2][i] = static_cast<float>(way.z), length[i] = static_cast<float>(size);
    }
  };
  struct Hits8 {
    std::array<std::uint32_t, 8> triangle{};
    std::array<float, 8> b1{}, b2{};
    unsigned found = 0;  ///< bit i: ray i has met triangle[i] at its length

    Hit hit(std::size_t i, const Rays8& rays) const {
      return {triangle[i], static_cast<double>(b1[i]), static_cast<double>(b2[i]),
              static_cast<double>(rays.length[i])};
    }
  };
  /// Nearest triangles of eight rays: writes those that are found, ends the rays there, and leaves
  /// the others as they were, so that several parts of a scene can be asked in turn. Faster than
  /// first_hit() where the rays lie close together (`coherent`), but not always the same last bits.
  void first_hits8(Rays8& rays, Hits8& hits, bool coherent) const;

  std::size_t triangle_count() const { return triangle_count_; }
  /// Whether any triangle is seen by kSpecular rays; by kGlossy rays; has an alpha cutoff.
  bool has_specular() const { return has_specular_; }
  bool has_glossy() const { return has_glossy_; }
  bool has_holes() const { return has_holes_; }
  /// Corner 0, 1 or 2 of a triangle as Embree holds it, local.
  Vec3 corner(std::uint32_t triangle, int corner) const {
    return corners(triangle)[static_cast<std::size_t>(corner)];
  }
  std::array<Vec3, 3> corners(std::uint32_t triangle) const;

 private:
  struct Device;
  void build(const Scene& scene, const std::vector<std::uint32_t>* part);
  unsigned trace8(const std::array<float, 3>& origin, const float* x, const float* y,
                  const float* z, unsigned lanes, float distance, Surfaces seen) const;
  std::unique_ptr<Device> device_;
  Vec3 center_;
  double scale_ = 1;
  std::size_t triangle_count_ = 0;
  bool has_specular_ = false, has_glossy_ = false, has_holes_ = false;
};

}  // namespace haarlight
