// Eight numbers at a time, in functions that are built for several instruction sets.

#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

/// Marks a function that takes or gives Eight: it becomes part of its caller, in each version of it
/// (core/simd.h). Files that include this are built with -Wno-psabi: no Eight crosses a call.
#define HAARLIGHT_LANES [[gnu::always_inline]] inline

namespace haarlight::lanes {

typedef float Eight __attribute__((vector_size(32)));
typedef std::int32_t EightInts __attribute__((vector_size(32)));

HAARLIGHT_LANES Eight load(const float* from) {
  Eight v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
HAARLIGHT_LANES void store(float* to, Eight v) { std::memcpy(to, &v, sizeof v); }
HAARLIGHT_LANES Eight all(float x) { return Eight{} + x; }
HAARLIGHT_LANES Eight floats_of(EightInts v) { return __builtin_convertvector(v, Eight); }
HAARLIGHT_LANES EightInts whole(Eight v) { return __builtin_convertvector(v, EightInts); }
HAARLIGHT_LANES EightInts bits_of(Eight v) { return __builtin_bit_cast(EightInts, v); }
HAARLIGHT_LANES Eight floats_in(EightInts v) { return __builtin_bit_cast(Eight, v); }
HAARLIGHT_LANES Eight above_zero(Eight v) { return v > 0 ? v : all(0); }
HAARLIGHT_LANES Eight at_most_one(Eight v) { return v < 1 ? v : all(1); }
HAARLIGHT_LANES float sum_of(Eight v) {
  return ((v[0] + v[4]) + (v[1] + v[5])) + ((v[2] + v[6]) + (v[3] + v[7]));
}

/// Bit i: lane i of a comparison holds.
HAARLIGHT_LANES unsigned mask_of(EightInts compared) {
  constexpr EightInts kBit{1, 2, 4, 8, 16, 32, 64, 128};
  EightInts bits = compared & kBit;
  bits |= __builtin_shufflevector(bits, bits, 4, 5, 6, 7, 0, 1, 2, 3);
  bits |= __builtin_shufflevector(bits, bits, 2, 3, 0, 1, 6, 7, 4, 5);
  bits |= __builtin_shufflevector(bits, bits, 1, 0, 3, 2, 5, 4, 7, 6);
  return static_cast<unsigned>(bits[0]);
}
/// The way back: all ones where bit i is set.
HAARLIGHT_LANES EightInts lanes_of(unsigned mask) {
  constexpr EightInts kBit{1, 2, 4, 8, 16, 32, 64, 128};
  return (kBit & static_cast<std::int32_t>(mask)) != 0;
}

/// 1 / sqrt(v), v from 1e-30: an estimate by its bits, wrong by at most 3.5e-2, and three steps of
/// Newton: 2e-3, 5e-6, rounding.
HAARLIGHT_LANES Eight inverse_root(Eight v) {
  Eight r = floats_in(0x5f375a86 - (bits_of(v) >> 1));
  for (int step = 0; step < 3; ++step) r = r * (1.5f - 0.5f * v * r * r);
  return r;
}
HAARLIGHT_LANES Eight root(Eight v) {
  const Eight least = v > 1e-30f ? v : all(1e-30f);
  return least * inverse_root(least);
}

struct Vec8 {
  Eight x, y, z;
};
HAARLIGHT_LANES Vec8 load(const float* x, const float* y, const float* z) {
  return {load(x), load(y), load(z)};
}
HAARLIGHT_LANES Vec8 all(float x, float y, float z) { return {all(x), all(y), all(z)}; }
HAARLIGHT_LANES Eight dot(const Vec8& a, const Vec8& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

}  // namespace haarlight::lanes
