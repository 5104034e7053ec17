// The incoming factor of one term of a BRDF, as it is traced.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/vec.h"

namespace haarlight {

/// f_k(w) = profile(theta) cos(m phi), or sin(m phi) for order -m < 0, cosine included; w in the
/// coordinates of Frame(normal). Profiles as in ViewFactors. May be negative.
struct IncomingTerm {
  int order = 0;
  std::vector<float> profile;  ///< over t = sqrt(1 - cos theta), [0, 1]
  double importance = 0;       ///< integral of |f_k|: how much paths are worth to it

  /// The profile at t, linear between samples.
  float at(float t) const {
    const float place = std::min(t, 1.0f) * static_cast<float>(profile.size() - 1);
    const std::size_t i = std::min(static_cast<std::size_t>(place), profile.size() - 2);
    const float share = place - static_cast<float>(i);
    return profile[i] + share * (profile[i + 1] - profile[i]);
  }
  /// Of one direction, unit; 0 below the horizon.
  double value(const Vec3& local) const {
    if (!(local.z > 0)) return 0;
    const double phi = std::atan2(local.y, local.x);
    const double turn = order >= 0 ? std::cos(order * phi) : std::sin(-order * phi);
    const auto t = static_cast<float>(std::sqrt(std::max(0.0, 1 - local.z)));
    return static_cast<double>(at(t)) * turn;
  }
};

}  // namespace haarlight
