// A picture of distant light behind a scene that moves, ready for sampling.

#pragma once

#include <cstddef>
#include <vector>

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

  struct Sample {
    Vec3 from;       ///< unit, towards the light
    double pdf = 0;  ///< per solid angle, > 0
  };
  /// By two numbers in [0, 1): in proportion to the luminance of the cells of a lat-long table, a
  /// tenth of all samples evenly, so that no direction is left out (Pharr and others 2016, 14.2.4).
  Sample sample(double u, double v) const;
  /// The density with which sample() chooses a unit direction.
  double pdf(const Vec3& from) const;

 private:
  std::size_t cell(double height, double turn) const;

  Environment environment_;
  std::vector<double> sum_;     // of chances, up to and with each cell
  std::vector<double> chance_;  // of a cell
};

}  // namespace haarlight
