// Cells of equal solid angle on the sphere: bands of equal height, columns of equal turn.

#pragma once

#include <algorithm>
#include <cmath>

#include "core/rgb.h"
#include "core/vec.h"

namespace haarlight {

/// Height and turn in [0, 1]; a turn of 0 is +Z, of 1/4 +X.
inline Vec3 cell_direction(double height, double turn) {
  const double y = 2 * height - 1, ring = std::sqrt(std::max(1 - y * y, 0.0));
  return {ring * std::sin(2 * kPi * turn), y, ring * std::cos(2 * kPi * turn)};
}

/// `look(direction, share)` for places of a cell, `looks` along its turn and as close along its
/// arc, which is long at the poles; `share`: of the cell's solid angle.
template <typename Look>
void for_looks(int cell, int bands, int columns, int looks, const Look& look) {
  const int band = cell / columns, column = cell % columns;
  const auto polar = [&](int n) { return std::acos(std::clamp(2.0 * n / bands - 1, -1.0, 1.0)); };
  const double low = polar(band), arc = polar(band + 1) - low;
  const int steps =
      std::max(static_cast<int>(std::ceil(looks * std::abs(arc) * columns / (2 * kPi))), looks);
  for (int i = 0; i < steps; ++i) {
    const double begin = std::cos(low + arc * i / steps),
                 end = std::cos(low + arc * (i + 1) / steps);
    const double share = (end - begin) * bands / 2 / looks;
    const double height = (std::cos(low + arc * (i + 0.5) / steps) + 1) / 2;
    for (int j = 0; j < looks; ++j) {
      look(cell_direction(height, (column + (j + 0.5) / looks) / columns), share);
    }
  }
}

}  // namespace haarlight
