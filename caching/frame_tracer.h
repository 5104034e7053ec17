// Light in one frame of a scene that moves: direct light and paths.

#pragma once

#include <array>
#include <optional>
#include <vector>

#include "caching/animated_scene.h"
#include "caching/body_place.h"
#include "caching/bright_surfaces.h"
#include "precompute/bsdf.h"
#include "precompute/chances.h"
#include "precompute/random.h"
#include "precompute/surface.h"
#include "precompute/visibility.h"

namespace haarlight {

/// A frame, ready for rays. Immutable; safe to use from any number of threads. `frame` must outlive
/// it. Places are local coordinates of visibility().
class FrameTracer {
 public:
  /// Throws as Visibility.
  explicit FrameTracer(const AnimatedFrame& frame);

  const Visibility& visibility() const { return visibility_; }
  const AnimatedFrame& frame() const { return frame_; }

  /// What a surface sends to its viewer by itself: its emission, if its lit side is seen.
  RgbD emitted(const SurfaceHit& surface) const;

  /// What lamps alone send by way of a surface to its viewer, without noise.
  struct LampShare {
    RgbD radiance;
    std::uint64_t hidden = 0;  ///< bit i: lamp i is not seen; of the first 64
  };

  /// An unbiased estimate of the light of lamps and shining triangles that a surface sends to its
  /// viewer after one reflection; shining triangles by one sample. Where `mis` is set, samples are
  /// weighted by the power heuristic, the rest being found by sampling the BSDF (Veach 1997,
  /// section 9.2). Lamps behind glass do not shine through it: shadow rays stop at it.
  /// `lamps`, if wanted, gets the lamps' part.
  RgbD direct(const SurfaceHit& surface, const Bsdf& bsdf, PathRandom& random, bool mis,
              LampShare* lamps = nullptr) const;

  /// An unbiased estimate of the light of the environment's picture that a surface sends to its
  /// viewer after one reflection, by one sample of the picture; `mis` as above. None without a
  /// picture: a background that is the same all round is best found by the BSDF.
  RgbD environment_light(const SurfaceHit& surface, const Bsdf& bsdf, PathRandom& random,
                         bool mis) const;

  /// The surfaces that lamps light most: paths look for them as they do for shining triangles.
  const BrightSurfaces& bright() const { return bright_; }

  /// One look from a place at them, by three random numbers.
  struct BrightLook {
    Vec3 direction;       ///< unit
    double distance = 0;  ///< local units
    double pdf = 0;       ///< per solid angle; 0: nothing is seen
    LampShare by_lamps;   ///< what comes from there
    BodyPlace place;      ///< what is seen
  };
  BrightLook look_at_bright(const Vec3& position, const Vec3& geometric_normal,
                            PathRandom& random) const;
  /// The density per solid angle with which look_at_bright() chooses what a ray has hit.
  double chance_of_bright(std::uint32_t triangle, const Vec3& direction, double distance) const;

  /// An unbiased estimate of what a surface sends to its viewer by way of its lobe, of light that
  /// has been reflected before, and of the background.
  RgbD lobe_light(const SurfaceHit& surface, const Bsdf& bsdf, PathRandom& random,
                  int samples) const;

  /// Whether any triangle shines.
  bool has_shining() const { return !shining_.empty(); }

  /// An unbiased estimate of the radiance that comes from `direction` (unit) at `from`, all
  /// bounces. `first_emission`: whether what the first surface sends by itself counts. Russian
  /// roulette from the fourth bounce on; cut after 256 bounces.
  RgbD radiance(const Vec3& from, const Vec3& direction, PathRandom& random,
                bool first_emission = true) const;
  /// The same from a first hit that is known already. `lamps`, if wanted, gets the part of lamps
  /// that light the first surface.
  RgbD radiance(const std::optional<Visibility::Hit>& hit, const Vec3& from, const Vec3& direction,
                PathRandom& random, bool first_emission, LampShare* lamps = nullptr) const;

  /// A place just off a surface, on the side that `direction` goes to.
  static Vec3 off_surface(const Vec3& position, const Vec3& geometric_normal,
                          const Vec3& direction);

 private:
  struct Shining {
    std::uint32_t triangle;
    double area;  ///< local units squared
  };
  double chance_to_hit(std::uint32_t triangle, const Vec3& from, const Vec3& direction,
                       double distance) const;
  LampShare lamp_light(const SurfaceHit& surface, const Bsdf& bsdf) const;
  bool shines(std::uint32_t triangle, const Vec3& direction) const;

  const AnimatedFrame& frame_;
  Visibility visibility_;
  BrightSurfaces bright_;
  std::vector<Shining> shining_;
  Chances chances_;                   // of shining_, by power
  std::vector<std::int32_t> number_;  // in shining_ by triangle, or -1; empty: none shines
};

/// f_r times the cosine for light from `w` (unit) leaving towards the viewer, single directions
/// left out; 0 for `w` behind the surface.
RgbD reflected(const Bsdf& bsdf, const Vec3& w);

}  // namespace haarlight
