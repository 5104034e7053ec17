// From radiance to something a display shows.

#include "prt/tonemap.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"

namespace haarlight {
namespace {

/// Above this every curve has long reached 1; keeps infinity out of the quotients below.
constexpr double kWhite = 1e30;

constexpr double kMidGrey = 0.18;

/// Exposed radiance without what no display shows: negative values and NaN become 0.
double exposed(float radiance, double factor) {
  const double value = radiance * factor;
  return value > 0 ? std::min(value, kWhite) : 0.0;
}

/// Narkowicz 2015, "ACES Filmic Tone Mapping Curve".
double filmic(double x) { return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14); }

Rgb display(const RgbD& c) {
  return Rgb(RgbD(std::min(c.r, 1.0), std::min(c.g, 1.0), std::min(c.b, 1.0)));
}

}  // namespace

Image tonemap(const Image& radiance, const TonemapOptions& options) {
  if (!std::isfinite(options.exposure_ev)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("exposure is {} stops, expected a finite number", options.exposure_ev));
  }
  const double factor = std::exp2(options.exposure_ev);
  Image result(radiance.width, radiance.height);
  std::transform(
      radiance.pixels.begin(), radiance.pixels.end(), result.pixels.begin(), [&](const Rgb& pixel) {
        const RgbD c(exposed(pixel.r, factor), exposed(pixel.g, factor), exposed(pixel.b, factor));
        switch (options.curve) {
          case TonemapCurve::linear:
            break;
          case TonemapCurve::reinhard:
            return display(c * (1 / (1 + luminance(c))));
          case TonemapCurve::filmic:
            return display({filmic(c.r), filmic(c.g), filmic(c.b)});
        }
        return display(c);
      });
  return result;
}

// Mikhailov 2019, "Turbo, An Improved Rainbow Colormap for Visualization": the polynomial fit,
// which is of sRGB values.
Rgb false_colour_of(double stops) {
  const double x = std::clamp((stops + kFalseColourStops) / (2 * kFalseColourStops), 0.0, 1.0);
  const auto polynomial = [x](const std::array<double, 6>& c) {
    double sum = 0;
    for (std::size_t i = c.size(); i-- > 0;) sum = sum * x + c[i];
    const double encoded = std::clamp(sum, 0.0, 1.0);
    return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
  };
  return Rgb(RgbD(
      polynomial({0.13572138, 4.61539260, -42.66032258, 132.13108234, -152.94239396, 59.28637943}),
      polynomial({0.09140261, 2.19418839, 4.84296658, -14.18503333, 4.27729857, 2.82956604}),
      polynomial(
          {0.10667330, 12.64194608, -60.58204836, 110.36276771, -89.90310912, 27.34824973})));
}

Image false_colour(const Image& radiance, double exposure_ev) {
  if (!std::isfinite(exposure_ev)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("exposure is {} stops, expected a finite number", exposure_ev));
  }
  Image result(radiance.width, radiance.height);
  std::transform(radiance.pixels.begin(), radiance.pixels.end(), result.pixels.begin(),
                 [&](const Rgb& pixel) {
                   const double y = luminance(RgbD(pixel));
                   if (!(y > 0)) return Rgb{};
                   return false_colour_of(std::log2(std::min(y, kWhite) / kMidGrey) + exposure_ev);
                 });
  return result;
}

double auto_exposure_ev(const Image& radiance) {
  double sum = 0;
  std::size_t count = 0;
  for (const Rgb& pixel : radiance.pixels) {
    const double y = luminance(RgbD(pixel));
    if (!(y > 0) || !std::isfinite(y)) continue;
    sum += std::log2(y);
    ++count;
  }
  return count == 0 ? 0 : std::log2(kMidGrey) - sum / static_cast<double>(count);
}

}  // namespace haarlight
