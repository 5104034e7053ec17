// Whether a row of three channels is one grey row times a colour.

#pragma once

#include <cstddef>

#include "core/rgb.h"

namespace haarlight {

/// How many times `base` a colour is, in the least squares sense; 0 for a black base.
double multiple_of(const RgbD& color, const RgbD& base);

/// Whether it is, to 1 % of base's largest channel.
bool is_multiple(const RgbD& color, const RgbD& base);

/// The colour that fits a row best, and what it leaves out.
struct ColorFit {
  RgbD color;           ///< largest channel 1; black for an empty row
  double residual = 0;  ///< L2 norm of what is not a multiple of it, relative to the row's
};

/// By the largest eigenvector of the channels' products. Rows are `size` entries each.
ColorFit fit_color(const float* r, const float* g, const float* b, std::size_t size);

/// Replaces `r` by the grey row that times `color` is nearest to all three channels.
void to_grey(const RgbD& color, float* r, const float* g, const float* b, std::size_t size);

}  // namespace haarlight
