// Even bits from numbers: random numbers without state, the same whatever the order.

#pragma once

#include <cstdint>

namespace haarlight {

/// Hashes two numbers into 64 even bits (SplitMix64's finaliser).
inline std::uint64_t mix_bits(std::uint64_t a, std::uint64_t b) {
  std::uint64_t z = a * 0x9e3779b97f4a7c15u + b + 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

}  // namespace haarlight
