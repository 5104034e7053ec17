// What makes one wavelet more worth an update than another.

#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "prt/transport.h"

namespace haarlight {

/// What makes one wavelet more worth an update than another, beside the size of its change.
enum class WaveletWeight {
  none,       ///< nothing: the orthonormal coefficient itself
  area,       ///< area_weights(): area of the wavelet times its unnormalised coefficient (Ng 2003)
  transport,  ///< Transport::column_norms(): the change of the picture
};

std::optional<WaveletWeight> wavelet_weight_from_name(std::string_view name);
std::string wavelet_weight_name(WaveletWeight weight);

/// LightingOptions::weights for a choice; layout.size() of them.
std::vector<float> wavelet_weights(WaveletWeight weight, const Transport& transport);

}  // namespace haarlight
