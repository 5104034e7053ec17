// Scrambled Halton points: even in many dimensions, each point a function of its number.

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "core/hash_bits.h"

namespace haarlight {

/// Halton's sequence with the digits of each base permuted at random (one permutation a
/// dimension): any first so many points fill the cube evenly. Immutable.
class Halton {
 public:
  static constexpr int kDimensions = 24;

  explicit Halton(std::uint64_t seed) : seed_(seed) {
    for (std::size_t d = 0; d < kDimensions; ++d) {
      auto& digit = digit_[d];
      digit.resize(kBase[d]);
      std::iota(digit.begin(), digit.end(), 0u);
      for (std::size_t i = digit.size() - 1; i > 0; --i) {
        std::swap(digit[i], digit[mix_bits(mix_bits(seed, d), i) % (i + 1)]);
      }
    }
  }

  /// Coordinate `dimension` of point `i`, [0, 1).
  double at(int dimension, std::uint64_t i) const {
    const auto d = static_cast<std::size_t>(dimension);
    const std::uint64_t base = kBase[d];
    double x = 0, place = 1;
    // Zeros before the first digit are permuted too.
    while (place > 1e-12) {
      place /= static_cast<double>(base);
      x += digit_[d][i % base] * place;
      i /= base;
    }
    return std::min(x, 1 - 0x1p-53);
  }
  std::uint64_t seed() const { return seed_; }

 private:
  static constexpr std::array<std::uint32_t, kDimensions> kBase{
      2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89};
  std::uint64_t seed_;
  std::array<std::vector<std::uint32_t>, kDimensions> digit_;
};

}  // namespace haarlight
