// Lobes and coats at many directions at once, in single precision.
//
// What bsdf.h and ggx.h say of one direction in double, as plain loops that the compiler turns into
// vector code. Directions rounded to 2^-24 move a lobe of half width a by 2^-24 / a of itself: less
// than 1e-5 for those wide enough to be summed over directions (see GlossyLobe). All counts are
// multiples of eight.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/bsdf.h"

namespace haarlight {

/// What coats let through at any cosine. Every coat is tabulated once.
class CoatTables {
 public:
  static constexpr std::int32_t kNone = 0;  ///< no coat: all passes

  CoatTables() { clear(); }
  void clear();
  /// The number of `bsdf`'s coat; equal coats have one number.
  std::int32_t add(const Bsdf& bsdf);
  /// Of different coats, kNone included.
  std::size_t size() const { return coats_.size(); }

  /// out[i] = 1 - C(cosine[i]) of coat number coat[i], C as in coat_albedo(). Cosines above 1 count
  /// as 1, below 0 as 0. `out` may be `cosine`.
  void passing(const std::int32_t* coat, const float* cosine, std::size_t count, float* out) const;
  /// The same with one coat for all.
  void passing(std::int32_t coat, const float* cosine, std::size_t count, float* out) const;

 private:
  struct Coat {
    double f0, alpha;
  };
  std::vector<Coat> coats_;
  std::vector<float> nodes_;  // [coat][node]: both parts of the albedo in turn
  std::vector<float> f0_;     // [coat]
};

/// Lobes of many surfaces, a lane each. Eight lanes are a packet; those past size() have no lobe.
class LobeLanes {
 public:
  void clear();
  /// Appends the lobe of `bsdf`, or none.
  void add(const Bsdf& bsdf, bool wanted);
  std::size_t size() const { return size_; }
  bool any() const { return ggx_ || phong_; }

  /// Bsdf::lobe_values of lane begin + i for light from the unit (x, y, z)[i]; 0 without a lobe.
  void values(std::size_t begin, std::size_t count, const float* x, const float* y, const float* z,
              float* first, float* second) const;

 private:
  // Normal, direction to the viewer (Phong: mirror direction), n.o, Smith's root of it and alpha
  // (GGX; 0: none), exponent (Phong; below 0: none).
  static constexpr std::size_t kNumbers = 10;
  std::array<std::vector<float>, kNumbers> of_;
  std::size_t size_ = 0;
  bool ggx_ = false, phong_ = false;
};

/// Bsdf::lobe_values of one lobe for light from the unit (x, y, z)[i].
void lobe_values(const Bsdf& bsdf, std::size_t count, const float* x, const float* y,
                 const float* z, float* first, float* second);

}  // namespace haarlight
