// Looking up textures between their pixels.

#pragma once

#include <vector>

#include "core/image.h"
#include "core/rgb.h"

namespace haarlight {

/// A texture's colour at (u, v), v up, repeating, bilinear between the middles of its pixels.
Rgb sample_texture(const Image& texture, double u, double v);

/// The same for one value a pixel, row-major from the top left, `width` * `height` of them.
float sample_texture(const std::vector<float>& values, int width, int height, double u, double v);

}  // namespace haarlight
