// A frame's change of lighting, as a plain value: all that the deciding half tells the applying
// half.

#pragma once

#include <bitset>
#include <vector>

#include "core/rgb.h"
#include "wavelet/haar.h"

namespace haarlight {

/// One change: coefficient `index` moves by `delta` (W m^-2 sr^-1, linear RGB; double, so that the
/// deltas of a coefficient add up to its value without rounding while float exponents differ by
/// at most 29).
struct WaveletDelta {
  int index = 0;
  RgbD delta;
  friend bool operator==(const WaveletDelta&, const WaveletDelta&) = default;
};

using BandMask = std::bitset<HaarLayout::kMaxBands>;

/// To apply it, a consumer
///   1. forgets what it holds of every band b with reset[b];
///   2. adds T[:, index] * delta for each delta.
/// `deltas` ascend by index without repeats. An empty update means the picture is already right.
struct LightingUpdate {
  BandMask reset;
  std::vector<WaveletDelta> deltas;

  bool empty() const { return reset.none() && deltas.empty(); }
  friend bool operator==(const LightingUpdate&, const LightingUpdate&) = default;
};

}  // namespace haarlight
