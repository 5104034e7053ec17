// From radiance to something a display shows. Nothing before this clamps.

#pragma once

#include "core/image.h"

namespace haarlight {

enum class TonemapCurve {
  linear,    ///< exposure only, clamped
  reinhard,  ///< x / (1 + x) on luminance
  filmic,    ///< ACES-like curve (Narkowicz 2015 fit)
};

struct TonemapOptions {
  TonemapCurve curve = TonemapCurve::filmic;
  double exposure_ev = 0;  ///< stops; radiance is multiplied by 2^ev first
};

/// Display-referred picture: linear in [0, 1], not yet sRGB encoded (save_image does that for PNG).
/// Negative radiance, which a truncated lighting can give, becomes 0 here and only here.
Image tonemap(const Image& radiance, const TonemapOptions& options);

/// An exposure (stops) that brings the picture's mean log-luminance over pixels brighter than
/// nothing to mid grey (0.18): a sensible start for a scene seen for the first time.
double auto_exposure_ev(const Image& radiance);

}  // namespace haarlight
