// How long a record may be used: Gautron and others 2007, sections 4.4 and 4.6.

#pragma once

#include "core/rgb.h"

namespace haarlight {

/// How much records may age.
struct TemporalAccuracy {
  double accuracy = 0.05;  ///< a^t: relative change of light that is let pass, > 0
  int longest = 20;        ///< delta t_max, frames, >= 1; 1: a new record every frame
};

/// The temporal irradiance ratio tau of light that is `now` and will be `next` (equation 7), so
/// that it is at least 1 whether light grows or fades: max(tau, 1 / tau), the largest of the
/// channels. Channels below a hundredth of the largest are noise, and compared with that floor; 1
/// where both are dark, at most kMostRatio, also for numbers that are none.
inline constexpr double kMostRatio = 1e6;
double temporal_ratio(const RgbD& now, const RgbD& next);

/// 1 / ((ratio - 1) age) for a record that is `age` frames old (equation 9), capped at
/// kMostWeight, which it has at age 0 and where nothing changes. Requires ratio >= 1, age >= 0.
inline constexpr double kMostWeight = 1e6;
double temporal_weight(double ratio, int age);

/// For how many frames, the one it is made in included, a record may be used: while its weight is
/// at least 1 / a^t and its age below the longest (equations 10 and 11). In [1, longest].
int lifespan(double ratio, const TemporalAccuracy& accuracy);

}  // namespace haarlight
