// Chooses directions by what they bring.

#pragma once

#include <cstddef>
#include <vector>

#include "core/vec.h"

namespace haarlight {

/// Chances of the cells of a grid over the sphere, sphere_cells.h. An immutable value.
class SphereTable {
 public:
  static constexpr int kBands = 96, kColumns = 192;
  static constexpr std::size_t kCells = std::size_t{kBands} * kColumns;

  SphereTable() = default;
  /// In proportion to `weight`, kCells of them, >= 0; a share `even` of all samples anywhere.
  SphereTable(const std::vector<double>& weight, double even);

  struct Sample {
    Vec3 from;       ///< unit
    double pdf = 0;  ///< per solid angle, > 0
  };
  /// By two numbers in [0, 1): height by the first, turn by the second, so that numbers that lie
  /// evenly in a square choose directions that do.
  Sample sample(double u, double v) const;
  /// The density with which sample() chooses a unit direction.
  double pdf(const Vec3& from) const;

 private:
  std::vector<double> chance_;    // of a cell
  std::vector<double> sum_;       // of chances within a band, up to and with each cell
  std::vector<double> band_sum_;  // of bands
};

}  // namespace haarlight
