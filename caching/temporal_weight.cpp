// Lifespans of records.

#include "caching/temporal_weight.h"

#include <algorithm>
#include <cmath>

namespace haarlight {
namespace {

double ratio_of(double now, double next, double floor) {
  const double a = std::max(now, floor), b = std::max(next, floor);
  if (a == b) return 1;
  const double ratio = std::max(a, b) / std::min(a, b);
  return ratio < kMostRatio ? ratio : kMostRatio;  // infinite and not a number, too
}

}  // namespace

double temporal_ratio(const RgbD& now, const RgbD& next) {
  constexpr double kFloor = 0.01;
  const double largest = std::max({now.r, now.g, now.b, next.r, next.g, next.b, 0.0});
  const double floor = kFloor * std::max({next.r, next.g, next.b, 0.0});
  if (!is_finite(now) || !is_finite(next)) return kMostRatio;
  if (largest == 0) return 1;
  const double base = std::max(floor, kFloor * std::max({now.r, now.g, now.b, 0.0}));
  return std::max({ratio_of(now.r, next.r, base), ratio_of(now.g, next.g, base),
                   ratio_of(now.b, next.b, base)});
}

double temporal_weight(double ratio, int age) {
  const double change = (ratio - 1) * age;
  return change * kMostWeight > 1 ? 1 / change : kMostWeight;
}

int lifespan(double ratio, const TemporalAccuracy& accuracy) {
  int life = 1;
  while (life < accuracy.longest && temporal_weight(ratio, life) >= 1 / accuracy.accuracy) ++life;
  return life;
}

}  // namespace haarlight
