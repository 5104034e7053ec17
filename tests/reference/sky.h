// Distant light for the reference path tracer: looked up by direction, and aimed at.

#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/rgb.h"
#include "core/vec.h"
#include "wavelet/cubemap.h"

namespace haarlight::reference {

/// Radiance from every direction.
class Sky {
 public:
  /// Piecewise constant on the texels of a cube map, which can be aimed at in proportion to
  /// radiance (sum of the channels) times solid angle. Negative texels throw
  /// Error{invalid_argument}.
  explicit Sky(Cubemap light);
  /// Any radiance; never aimed at.
  explicit Sky(std::function<RgbD(const Vec3& direction)> light);

  RgbD radiance(const Vec3& direction) const;

  struct Sample {
    Vec3 direction;
    double density = 0;  ///< per solid angle, > 0
  };
  /// A direction by three numbers in [0, 1); nothing where it cannot be aimed at, or is black.
  std::optional<Sample> sample(double choice, double u, double v) const;
  /// The density of sample() in a direction.
  double density(const Vec3& direction) const;

 private:
  double density(std::size_t texel, double u, double v) const;

  Cubemap map_;
  std::function<RgbD(const Vec3&)> light_;
  std::vector<double> below_;  // sum of the shares of texels 0 to k
};

}  // namespace haarlight::reference
