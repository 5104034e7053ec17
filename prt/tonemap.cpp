// From radiance to something a display shows.

#include "prt/tonemap.h"

#include <fmt/format.h>

#include <algorithm>
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
