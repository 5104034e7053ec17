// How far apart two pictures are.

#include "core/image_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"

namespace haarlight {

void check_finite(const Image& image, const std::string& which) {
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (!is_finite(image.at(x, y))) {
        throw Error(ErrorKind::invalid_argument,
                    fmt::format("{} is not finite at pixel ({}, {}), expected finite values only",
                                which, x, y));
      }
    }
  }
}

ImageDifference compare_images(const Image& image, const Image& reference) {
  if (image.width != reference.width || image.height != reference.height) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("picture is {}x{}, reference is {}x{}, expected equal sizes",
                            image.width, image.height, reference.width, reference.height));
  }
  if (image.pixels.empty()) {
    throw Error(ErrorKind::invalid_argument, "pictures have no pixels, expected at least one");
  }
  check_finite(image, "picture");
  check_finite(reference, "reference");

  ImageDifference result;
  double squared_difference = 0, squared_reference = 0, peak = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const RgbD wanted(reference.at(x, y));
      const RgbD d = RgbD(image.at(x, y)) - wanted;
      squared_difference += d.r * d.r + d.g * d.g + d.b * d.b;
      squared_reference += wanted.r * wanted.r + wanted.g * wanted.g + wanted.b * wanted.b;
      peak = std::max({peak, wanted.r, wanted.g, wanted.b});
      const double largest = std::max({std::abs(d.r), std::abs(d.g), std::abs(d.b)});
      if (largest > result.max_abs) {
        result.max_abs = largest;
        result.max_x = x;
        result.max_y = y;
      }
    }
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double count = 3.0 * static_cast<double>(image.pixels.size());
  result.rmse = std::sqrt(squared_difference / count);
  if (result.rmse > 0) {
    result.relative_rmse =
        squared_reference > 0 ? std::sqrt(squared_difference / squared_reference) : kInfinity;
    result.psnr = 20 * std::log10(peak / result.rmse);
  } else {
    result.psnr = kInfinity;
  }
  return result;
}

}  // namespace haarlight
