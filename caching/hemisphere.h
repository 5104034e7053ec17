// Light over the hemisphere of a place, in strata, and the irradiance and gradients it makes.

#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "caching/body_place.h"
#include "caching/frame_tracer.h"
#include "caching/irradiance_record.h"

namespace haarlight {

/// A hemisphere in rings x sectors strata, one direction each, of equal cosine-weighted solid angle
/// or, if even, of equal solid angle. Ring j lies between sin^2 theta (even: 1 - cos theta) of
/// j / rings and (j + 1) / rings, sector k between phi = 2 pi k / sectors and the next; stratum
/// (j, k) is number j * sectors + k.
struct Hemisphere {
  int rings = 0, sectors = 0;
  bool even = false;
  std::vector<Vec3> direction;   ///< unit, in the place's tangents and normal
  std::vector<RgbD> radiance;    ///< that arrives along them
  std::vector<double> distance;  ///< metres to what is seen; infinite for the background

  std::size_t number(int ring, int sector) const {
    return static_cast<std::size_t>(ring) * static_cast<std::size_t>(sectors) +
           static_cast<std::size_t>(sector);
  }
  /// Where a direction of the upper half is: ring in [0, rings], sector in [0, sectors], their
  /// whole parts the stratum it is in. Equal areas here are equal (cosine-weighted) solid angles.
  struct Coordinates {
    double ring, sector;
  };
  Coordinates coordinates_of(const Vec3& d) const;
  std::size_t stratum_of(const Vec3& d) const;
};

/// About `samples` strata, as wide as high; directions jittered by `key`. Light is still missing.
Hemisphere stratified_hemisphere(int samples, std::uint64_t key, bool even = false);

/// What one direction sees, for the frame after.
struct SeenPlace {
  static constexpr std::uint32_t kBackground = 0xffffffffu, kBelow = 0xfffffffeu;
  BodyPlace place;                  ///< its triangle is kBackground or, below the horizon, kBelow
  FrameTracer::LampShare by_lamps;  ///< of the radiance
  RgbD rest;                        ///< of the radiance
  // Of a look, which adds its radiance, all of it in by_lamps, to a stratum:
  std::size_t stratum = 0;
  Vec3 in_picture;  ///< at the background: unit, where in the environment's picture
};

/// Fills in the light that arrives at `at`, a place in the tracer's frame: what surfaces send after
/// at least one reflection, all further bounces by paths, and the background. What surfaces shine
/// by themselves is left out: that is direct light. Directions below the triangle see nothing, at
/// no distance that counts. Surfaces that lamps make bright are also looked at by themselves, 256
/// times, as is a picture behind everything where its light is, both weighted against the strata by
/// the balance heuristic (Veach 1997, section 9.2). `seen`, if wanted, gets one entry a stratum,
/// then one a look that found something.
void gather_hemisphere(const FrameTracer& tracer, const PlaceFrame& at, std::uint64_t key,
                       Hemisphere& hemisphere, std::vector<SeenPlace>* seen);

/// What strata see of the background in a direction (world, unit) of that cosine: a picture behind
/// it with the weight that looks at it leave.
RgbD background_by_strata(const AnimatedFrame& frame, const Hemisphere& hemisphere, double cosine,
                          const Vec3& direction);

/// Irradiance, its rotation gradient, and its translation gradient by how the strata's borders move
/// (Ward and Heckbert 1992, equations for stratified hemispheres). Requires strata that are not
/// even.
RecordValue record_value(const Hemisphere& hemisphere);

/// The harmonic mean of the distances; infinite if nothing is seen.
double harmonic_mean_distance(const Hemisphere& hemisphere);

/// The nearer of two strata's distances, metres; what touches the place must not make gradients
/// infinite.
inline double nearer_distance(double a, double b) { return std::max(std::min(a, b), 1e-9); }

}  // namespace haarlight
