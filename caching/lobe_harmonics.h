// Lobes in hemispherical harmonics, by roughness and view: Krivanek and others 2005, section 4.

#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "caching/hemispherical_harmonics.h"
#include "precompute/bsdf.h"

namespace haarlight {

/// Which table a lobe has: lobes of a kind whose widths differ by less than 1/64 (GGX alpha), or
/// 1/64 of an octave (Phong exponents), share one.
std::int32_t lobe_table_key(const Bsdf& bsdf);

/// Tables of all lobes of a frame. Making them is not safe beside anything else, reading them is.
class LobeHarmonics {
 public:
  /// Makes the tables that are missing; in parallel.
  void make(const std::vector<std::int32_t>& keys);

  /// Coefficients of lobe_values().first and .second (cosine included) of a lobe seen from `o`
  /// (unit, in a frame whose z is the normal), about in the widths and views of the table.
  struct Pair {
    Harmonics first, second;
  };
  Pair at(std::int32_t key, const Vec3& o) const;

 private:
  std::map<std::int32_t, std::vector<Pair>> table_;  // by cosine of the view
};

}  // namespace haarlight
