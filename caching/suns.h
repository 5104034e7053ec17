// Small bright suns of a picture: lights of their own.

#pragma once

#include <vector>

#include "core/rgb.h"
#include "core/vec.h"
#include "wavelet/environment.h"

namespace haarlight {

/// What is far brighter than the rest of a picture and small: at most kMost discs of kRadius, each
/// with a share of at least 1/100 of all light and most of what shines about it. Directions chosen
/// evenly miss it; as a light of one direction it casts a hard shadow. An immutable value.
class Suns {
 public:
  static constexpr int kMost = 8;
  static constexpr double kRadius = 0.035;  ///< radians: what is seen as one direction
  static constexpr double kBright = 16;     ///< times the mean radiance: what is above is a sun's

  struct Sun {
    Vec3 from;        ///< unit, towards it: the middle of its light
    RgbD irradiance;  ///< across that direction
  };

  Suns() = default;
  /// `cell_most`: by cell, in rows of `columns`, the most luminance there, as `looks`^2 looks at
  /// each cell find it; `mean`: the luminance of all directions. Cells are bands of equal height on
  /// the unit sphere, cut into columns of equal turn.
  Suns(const Environment& environment, const std::vector<float>& cell_most, int columns, int looks,
       double mean);

  const std::vector<Sun>& suns() const { return sun_; }
  /// Of a picture's `radiance` from a unit direction, what is not a sun's.
  RgbD without(const Vec3& from, const RgbD& radiance) const {
    for (const Vec3& axis : axis_) {
      if (dot(from, axis) > least_cosine_) return radiance - above(radiance);
    }
    return radiance;
  }

  /// Whether a luminance is more than suns leave.
  bool may_take(double l) const { return l > cap_; }

 private:
  RgbD above(const RgbD& radiance) const {
    const double l = luminance(radiance);
    return l > cap_ ? radiance * (1 - cap_ / l) : RgbD{};
  }
  std::vector<Sun> sun_;
  std::vector<Vec3> axis_;  // of their discs
  double cap_ = 0, least_cosine_ = 2;
};

}  // namespace haarlight
