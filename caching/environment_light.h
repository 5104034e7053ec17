// A picture of distant light behind a scene that moves, ready for sampling.

#pragma once

#include <vector>

#include "caching/sphere_table.h"
#include "caching/suns.h"
#include "core/rgb.h"
#include "core/vec.h"
#include "wavelet/environment.h"

namespace haarlight {

/// An environment and a table that chooses directions by what they bring. Immutable, safe to use
/// from any number of threads.
class EnvironmentLight {
 public:
  explicit EnvironmentLight(Environment environment);

  /// Radiance from a direction (any length), bilinear in the picture.
  RgbD radiance(const Vec3& from) const { return RgbD(environment_.radiance(from)); }

  /// Its small bright suns, and what it is without them: for those who look at few directions.
  const std::vector<Suns::Sun>& suns() const { return suns_.suns(); }
  RgbD radiance_without_suns(const Vec3& from) const { return suns_.without(from, radiance(from)); }

  using Sample = SphereTable::Sample;
  /// By two numbers in [0, 1): in proportion to the luminance of the cells of a lat-long table, a
  /// tenth of all samples evenly, so that no direction is left out (Pharr and others 2016, 14.2.4).
  Sample sample(double u, double v) const { return table_.sample(u, v); }
  /// The density with which sample() chooses a unit direction.
  double pdf(const Vec3& from) const { return table_.pdf(from); }
  /// The same without suns, half of all samples evenly: one brings at most twice what even ones do.
  Sample sample_without_suns(double u, double v) const { return without_suns_.sample(u, v); }

 private:
  Environment environment_;
  Suns suns_;
  SphereTable table_, without_suns_;
};

}  // namespace haarlight
