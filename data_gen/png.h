// Small pictures with holes as PNG in memory, for textures inside scene files.

#pragma once

#include <string>
#include <vector>

#include "core/image.h"

namespace haarlight::data_gen {

/// The bytes of an 8-bit PNG of red, green, blue and alpha, stored without compression. Values are
/// clamped to [0, 1] and encoded as sRGB if `srgb`; `alpha` is linear, one a pixel or empty (all
/// 1). Source: PNG specification (ISO/IEC 15948), RFC 1950 and 1951 for the stored blocks.
std::string encode_png(const Image& image, const std::vector<float>& alpha, bool srgb);

}  // namespace haarlight::data_gen
