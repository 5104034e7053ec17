// How much of a Phong lobe falls into each sample of a texel.

#pragma once

#include <span>
#include <vector>

#include "core/vec.h"
#include "precompute/direction_table.h"

namespace haarlight {

/// The lobe (e + 2) / (2 pi) max(0, cos alpha)^e max(0, n.w) of one shading point, integrated over
/// texels. A lobe much wider than a texel is evaluated at the texel's own samples; a narrow one is
/// integrated on a finer grid, each part going to the nearest sample, so that no energy is gained
/// or lost however the lobe lies to the texels.
class PhongLobe {
 public:
  /// `mirror` and `normal` are unit; `exponent` is e >= 0.
  PhongLobe(const DirectionTable& table, const Vec3& mirror, const Vec3& normal, double exponent);

  /// Whether the texel can hold more than 1e-9 of the peak of the lobe.
  bool reaches(std::size_t texel) const;

  /// Integral over each sample's part of the texel; `weights` has table.samples entries.
  void weights(std::size_t texel, std::span<float> weights) const;

 private:
  double value(const Vec3& direction) const;

  const DirectionTable& table_;
  Vec3 mirror_, normal_;
  double exponent_, scale_;
  double widest_chord_;  // beyond this from the mirror direction the lobe is nothing
  int fine_ = 0;         // grid points an axis; 0: the table's samples are fine enough
  std::vector<int> owner_;
};

}  // namespace haarlight
