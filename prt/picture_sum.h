// What all pixels of a mesh's picture add up to under a light, without drawing it.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/rgb.h"
#include "prt/error_judge.h"
#include "prt/transport.h"

namespace haarlight {

/// A picture's sum, each pixel times the share c_p of it that the mesh covers, is linear in the
/// light: sum over vertices of share_v B_v, hence sum over coefficients of a_j L_j. Cauchy and
/// Schwarz make of it a least norm of the exact picture,
///   || P || >= | sum_p c_p P_p | / sqrt(sum_p c_p^2),   sum_p c_p^2 = sum_v share_v,
/// which holds however little of the light is shown.
class PictureSum {
 public:
  /// The transport must be of a mesh or of clusters.
  explicit PictureSum(const Transport& transport) : transport_(transport) {}

  /// Finds a for a view; streams all of T once. The same bits on any number of threads.
  void look(const PictureView& view);

  /// Least norm of the picture under `light`, layout.size() coefficients, as of the last look(), up
  /// to roundings of doubles; 0 where nothing is seen.
  double least_norm(std::span<const Rgb> light) const;

 private:
  void weigh_rows(const PictureView& view);

  Transport transport_;
  std::vector<double> row_weight_;  // [block][channel][row of block]
  std::vector<RgbD> sum_;           // a
  double shares_ = 0;
};

}  // namespace haarlight
