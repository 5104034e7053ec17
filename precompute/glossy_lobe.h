// How much of a material's lobe falls into each sample of a texel.

#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "precompute/bsdf.h"
#include "precompute/direction_table.h"
#include "precompute/phong_lobe.h"

namespace haarlight {

/// The lobe of one shading point integrated over texels, as the two grey factors of
/// Bsdf::lobe_values(): Phong by PhongLobe, GGX at the texel's own samples. A GGX lobe too narrow
/// for that is not summed over texels but drawn from (see is_narrow).
class GlossyLobe {
 public:
  /// Keeps references to both.
  GlossyLobe(const DirectionTable& table, const Bsdf& bsdf);

  /// GGX whose half width is below two distances between samples.
  bool is_narrow() const { return narrow_; }
  /// Whether the texel can hold anything worth adding. Never for narrow lobes.
  bool reaches(std::size_t texel) const;
  /// Integrals over each sample's part of the texel: `first` and `second` have table.samples
  /// entries.
  void weights(std::size_t texel, std::span<float> first, std::span<float> second) const;

  /// Integrals over whole texels [begin, begin + count), count a multiple of eight: into `first`
  /// and `second` where bit i of `wanted` is set, at most 64. The spans are working memory as for
  /// weights(). A GGX lobe many texels wide is evaluated once a texel.
  void whole(std::size_t begin, std::size_t count, std::uint64_t wanted, float* first,
             float* second, std::span<float> first_weights, std::span<float> second_weights) const;

 private:
  const DirectionTable& table_;
  const Bsdf& bsdf_;
  bool narrow_ = false, wide_ = false;
  std::optional<PhongLobe> phong_;
};

}  // namespace haarlight
