// What a virtual light does to a record, in four bytes.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/rgb.h"

namespace haarlight {

/// Three mantissas of 8 bits and one exponent (Ward, Real Pixels, Graphics Gems II), rounded to
/// nearest: off by at most 1/256 of the largest channel. Where all mantissas are zero the exponent
/// byte says why.
using PackedLight = std::uint32_t;

inline constexpr PackedLight kShadowed = 0;      ///< something is in between
inline constexpr PackedLight kUnlit = 1u << 24;  ///< faces away, too near, or sends nothing
inline constexpr PackedLight kFaint = 2u << 24;  ///< arrives, but less than can be written

/// Of light that arrives. Requires channels >= 0; beyond 2^126 it is cut off there.
inline PackedLight pack_light(const RgbD& c) {
  const double most = std::min(std::max({c.r, c.g, c.b}), 0x1p126);
  if (!(most >= 0x1p-120)) return kFaint;
  int exponent = 0;
  std::frexp(most, &exponent);  // most in [2^(e-1), 2^e)
  if (std::nearbyint(std::ldexp(most, 8 - exponent)) > 255) ++exponent;
  const auto mantissa = [&](double x) {
    return static_cast<std::uint32_t>(
        std::nearbyint(std::ldexp(std::clamp(x, 0.0, most), 8 - exponent)));
  };
  return mantissa(c.r) | mantissa(c.g) << 8 | mantissa(c.b) << 16 |
         static_cast<std::uint32_t>(exponent + 128) << 24;
}

inline RgbD unpack_light(PackedLight p) {
  const double unit = std::ldexp(1.0, static_cast<int>(p >> 24) - 136);
  return {(p & 255u) * unit, (p >> 8 & 255u) * unit, (p >> 16 & 255u) * unit};
}

}  // namespace haarlight
