// How far apart two pictures are.

#pragma once

#include <string>

#include "core/image.h"

namespace haarlight {

/// Differences over all pixels and channels of two linear pictures.
struct ImageDifference {
  double rmse = 0;           ///< root of the mean squared difference
  double relative_rmse = 0;  ///< rmse / root mean square of the reference; 0 when both are black
  double psnr = 0;           ///< dB against the reference's largest value; infinity when equal
  double max_abs = 0;        ///< the largest difference in any channel
  int max_x = 0, max_y = 0;  ///< where that is (the first in raster order)
};

/// `reference` is the second. Throws Error{invalid_argument} if sizes differ or are zero, and if a
/// value is not finite (naming the picture and pixel). Sums are in double.
ImageDifference compare_images(const Image& image, const Image& reference);

/// Throws Error{invalid_argument} naming `which` and the pixel if a value is not finite; programs
/// ask before they write a picture that they have made.
void check_finite(const Image& image, const std::string& which);

}  // namespace haarlight
