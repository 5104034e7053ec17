// How noisy the picture of a tile, or of many, is.

#include "precompute/tile_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace haarlight {

void TileNoise::add(const TileNoise& other) {
  variance.resize(std::max(variance.size(), other.variance.size()), 0.0);
  energy.resize(variance.size(), 0.0);
  for (std::size_t l = 0; l < other.variance.size(); ++l) {
    variance[l] += other.variance[l];
    energy[l] += other.energy[l];
  }
  paths += other.paths;
}

double TileNoise::worst() const {
  double most = 0;
  for (std::size_t l = 0; l < variance.size(); ++l) {
    if (energy[l] > 0) most = std::max(most, variance[l] / energy[l]);
  }
  return std::sqrt(most);
}

}  // namespace haarlight
