// A few rows of a scene at low resolution, as pictures under the built-in lightings.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/plan.h"

namespace haarlight {

/// The probe's rows lit by each built-in lighting, and by an even sky.
struct Pictures {
  int lightings = 0;
  std::vector<RgbD> value;  ///< [row][lighting], the even sky last

  /// Relative RMS difference of `other`, root mean square over the built-in lightings.
  double error(const Pictures& other) const;
  /// The difference of `a` from `b`, relative to this.
  double energy_error(const Pictures& a, const Pictures& b) const;
  /// Mean luminance under the even sky.
  double even_light() const;
};

class Probe {
 public:
  /// Up to 256 rows spread over `order`; `base` gives what does not depend on resolution.
  Probe(const SourceMaker& source, std::span<const std::uint32_t> order, const TraceOptions& base);

  /// With the same random numbers every time, so that differences are due to effects.
  Pictures pictures(const Effects& effects);

  std::int64_t rays() const { return rays_; }

 private:
  const SourceMaker& source_;
  TraceOptions trace_;
  std::vector<std::uint32_t> outputs_;  // whole tiles
  std::int64_t rays_ = 0;
};

}  // namespace haarlight
