// How noisy the picture of a tile, or of many, is.

#pragma once

#include <cstdint>
#include <vector>

namespace haarlight {

/// How noisy a tile's picture is under the built-in lightings; add up over tiles.
struct TileNoise {
  std::vector<double> variance;  ///< per lighting: of the picture, summed over rows and channels
  std::vector<double> energy;    ///< per lighting: the picture squared, summed likewise
  std::int64_t paths = 0;        ///< traced
  void add(const TileNoise& other);
  /// The largest relative noise, root of variance by energy, over the lightings; 0 without any.
  double worst() const;
};

}  // namespace haarlight
