// The lightings that a transport's accuracy is tuned and measured for, before any user's is known.

#pragma once

#include <vector>

#include "wavelet/haar.h"

namespace haarlight {

/// Haar coefficients of grey environments of the kinds people use: a high and a low sun under a
/// sky, a room with small lamps (two of them), windows, a dark room with one lamp, soft clouds,
/// leaves against a bright sky. Each is layout.size() long. Deterministic; made once
/// a face size and kept, so the reference stays good.
const std::vector<std::vector<float>>& prior_lightings(const HaarLayout& layout);

}  // namespace haarlight
