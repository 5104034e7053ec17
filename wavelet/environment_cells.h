// Cutting an environment's picture into cells of nearly equal solid angle.

#pragma once

#include <vector>

#include "core/rgb.h"
#include "core/vec.h"
#include "wavelet/environment.h"

namespace haarlight {

/// A small piece of the sphere, seen as one direction from then on.
struct EnvironmentCell {
  Vec3 center;             ///< unit, mean direction over the cell
  RgbD energy;             ///< radiance x solid angle, W m^-2
  double solid_angle = 0;  ///< sr
};

/// Cells of about `solid_angle` sr that tile the sphere. A pixel bigger than that is cut; radiance
/// is bilinear between pixel centres, balanced so that each pixel's energy stays (lat-long: by the
/// shares of the rows; angular and cross: by scaling the pieces of each pixel). Smaller pixels are
/// merged in blocks. A block is left as single pixels if merging would displace light by more than
/// `blur` (W m^-2 rad: energy times distance), for the worst blocks up to a quarter more cells.
std::vector<EnvironmentCell> cut_into_cells(const Environment& environment, double solid_angle,
                                            double blur);

}  // namespace haarlight
