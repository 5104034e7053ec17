// Means of random draws, and how sure they are.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "caching/frame_tracer.h"
#include "core/hash_bits.h"

namespace haarlight {

struct Estimate {
  double mean = 0, error = 0;  ///< error: standard, of the mean
};

/// Of `count` values draw(random), each with random numbers of its own.
template <typename Draw>
Estimate estimate(std::uint64_t seed, int count, const Draw& draw) {
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    PathRandom random(mix_bits(seed, static_cast<std::uint64_t>(i)));
    const double x = draw(random);
    sum += x, squares += x * x;
  }
  const double mean = sum / count;
  return {mean, std::sqrt(std::max(squares / count - mean * mean, 0.0) / count)};
}

}  // namespace haarlight
