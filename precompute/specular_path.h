// Follows light backwards through mirrors and glass until it meets something else.

#pragma once

#include <cstdint>
#include <optional>

#include "precompute/bsdf.h"
#include "precompute/random.h"
#include "precompute/scene.h"
#include "precompute/surface.h"
#include "precompute/visibility.h"

namespace haarlight {

/// Where a path through mirrors and glass comes out.
struct PathEnd {
  RgbD weight;                    ///< what they let through; 0: the path was given up
  Vec3 direction;                 ///< unit, of the last ray
  std::optional<SurfaceHit> hit;  ///< what it met, or nothing: it left the scene
  Bsdf bsdf;                      ///< of the hit, without single directions
};

/// What becomes of a path at a surface that both scatters and has single directions.
enum class AtMixed {
  pass,   ///< it takes a single direction, as if the rest were black
  choose  ///< it ends there or goes on at random, whichever keeps the mean
};

/// From `first`, a hit with the single directions `at_first`, along one of them after the other,
/// each chosen at random by its weight, until a surface that has none, or the open. A path
/// is given up below 1 % of its light, by Russian roulette that keeps the mean, and for good after
/// 64 interactions. Light inside thick glass is weakened by its extinction. Adds the rays traced to
/// `rays`.
PathEnd follow_specular(const Scene& scene, const Visibility& visibility, const SurfaceHit& first,
                        const SingleDirections& at_first, AtMixed mixed, PathRandom& random,
                        std::int64_t& rays);

inline PathEnd follow_specular(const Scene& scene, const Visibility& visibility,
                               const SurfaceHit& first, const Bsdf& at_first, AtMixed mixed,
                               PathRandom& random, std::int64_t& rays) {
  return follow_specular(scene, visibility, first, SingleDirections(at_first), mixed, random, rays);
}

/// What is left of `weight` after `distance` (local units) inside the glass of `material`.
RgbD weakened(const RgbD& weight, const Material& material, const Visibility& visibility,
              double distance);

/// Just off the surface on the side that `direction` goes to, local coordinates.
Vec3 leave_surface(const SurfaceHit& hit, const Vec3& direction);

}  // namespace haarlight
