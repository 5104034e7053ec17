// How much light a smooth boundary between two dielectrics reflects.

#pragma once

#include <algorithm>
#include <cmath>

namespace haarlight {

/// Light that meets a boundary, as seen from the side of the ray.
struct Refraction {
  double reflectance = 1;    ///< share reflected, unpolarised, [0, 1]; 1: total reflection
  double cosine_beyond = 0;  ///< of the refracted ray with the normal on its own side, [0, 1]
};

/// Snell's and Fresnel's laws for a ray that makes `cosine` (clamped to [0, 1]) with the normal;
/// `eta` = n_here / n_beyond > 0 (Born and Wolf, Principles of Optics, 1.5.2).
inline Refraction refraction(double cosine, double eta) {
  const double here = std::clamp(cosine, 0.0, 1.0);
  const double sine_squared = eta * eta * (1 - here * here);
  if (sine_squared >= 1) return eta == 1 ? Refraction{0, here} : Refraction{1, 0};
  const double beyond = std::sqrt(1 - sine_squared);
  // Neither sum is 0: `beyond` is not.
  const double across = (eta * here - beyond) / (eta * here + beyond);
  const double along = (eta * beyond - here) / (eta * beyond + here);
  return {0.5 * (across * across + along * along), beyond};
}

/// Schlick's share s = (1 - cosine)^5 of F = F0 (1 - s) + s.
inline double schlick(double cosine) {
  const double c = 1 - std::clamp(cosine, 0.0, 1.0), c2 = c * c;
  return c2 * c2 * c;
}

}  // namespace haarlight
