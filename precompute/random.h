// Random numbers without state: each is a hash of what it is for, so that no result depends on
// threads, order or on what else is computed.

#pragma once

#include <cmath>
#include <cstdint>

#include "core/hash_bits.h"

namespace haarlight {

/// [0, 1).
inline double unit_number(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

/// The numbers of one path: a key says which path, next() walks along it.
class PathRandom {
 public:
  explicit PathRandom(std::uint64_t key) : key_(key) {}
  double next() { return unit_number(mix_bits(key_, counter_++)); }

 private:
  std::uint64_t key_, counter_ = 0;
};

/// Point `i` of a four-dimensional Kronecker sequence moved by `shift` (each [0, 1)): any run of it
/// fills the cube evenly, its last two coordinates best (the steps of Roberts' R2 sequence; the
/// others are roots), and with a random shift each point by itself is uniform.
struct EvenPoint {
  double value[4];
};
inline EvenPoint even_point(std::uint64_t i, const double (&shift)[4]) {
  constexpr double kStep[4] = {0.41421356237309505, 0.73205080756887729, 0.75487766624669276,
                               0.56984029099805327};
  EvenPoint p{};
  for (int d = 0; d < 4; ++d) {
    const double x = shift[d] + static_cast<double>(i) * kStep[d];
    p.value[d] = x - std::floor(x);
  }
  return p;
}

}  // namespace haarlight
