// Numbers that look random and depend on a seed and a place only, the same on every machine.

#pragma once

#include <cstdint>

namespace haarlight::data_gen {

/// SplitMix64's output function: a bijection of 64 bits that mixes well.
constexpr std::uint64_t mix_bits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// A stream of numbers. Copies go on independently from where they are; fork() gives a stream of
/// its own to each part of a scene, so that adding one part leaves the others as they were.
class Random {
 public:
  explicit constexpr Random(std::uint64_t seed) : state_(mix_bits(seed)) {}

  constexpr Random fork(std::uint64_t part) const { return Random(state_ ^ mix_bits(part + 1)); }

  /// Uniform in [0, 1), 53 bits.
  constexpr double uniform() {
    state_ += 0x9e3779b97f4a7c15ull;
    return static_cast<double>(mix_bits(state_) >> 11) * 0x1.0p-53;
  }
  constexpr double between(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform in 0 .. count - 1; count >= 1.
  constexpr int below(int count) { return static_cast<int>(uniform() * count); }

 private:
  std::uint64_t state_;
};

}  // namespace haarlight::data_gen
