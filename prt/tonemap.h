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

/// Luminance as colour, for reading values off a picture: one colour per stop. `stops` are counted
/// from mid grey (0.18 after exposure); from -5 to 5 the colour runs from dark blue over green to
/// red along Google's Turbo map (Mikhailov 2019), and stays at its ends beyond. Display-referred
/// and linear, as tonemap()'s result. A pixel without light, or with less, is black.
Image false_colour(const Image& radiance, double exposure_ev);

/// The colour of so many stops above mid grey, for a legend; linear in [0, 1].
Rgb false_colour_of(double stops);

/// Half the range of false_colour, in stops.
inline constexpr double kFalseColourStops = 5;

/// An exposure (stops) that brings the picture's mean log-luminance over pixels brighter than
/// nothing to mid grey (0.18): a sensible start for a scene seen for the first time.
double auto_exposure_ev(const Image& radiance);

}  // namespace haarlight
