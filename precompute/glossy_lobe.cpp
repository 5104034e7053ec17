// How much of a material's lobe falls into each sample of a texel.

#include "precompute/glossy_lobe.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "precompute/lobe_lanes.h"

namespace haarlight {

GlossyLobe::GlossyLobe(const DirectionTable& table, const Bsdf& bsdf) : table_(table), bsdf_(bsdf) {
  if (bsdf.lobe == Bsdf::Lobe::phong) {
    const Vec3 mirror = 2 * dot(bsdf.normal, bsdf.to_viewer) * bsdf.normal - bsdf.to_viewer;
    phong_.emplace(table, normalize(mirror), bsdf.normal, bsdf.width);
  } else {
    const double spacing = 2.0 / table.n / std::sqrt(static_cast<double>(table.samples));
    narrow_ = bsdf.lobe_half_width() < 2 * spacing;
    // Over a texel 2 / n wide the midpoint is wrong by (2 / n)^2 / 24 times the second derivative,
    // about one by the width squared: less than 0.1 % of the lobe from eight texels a width on.
    wide_ = bsdf.lobe_half_width() > 8 * 2.0 / table.n;
  }
}

bool GlossyLobe::reaches(std::size_t texel) const {
  return phong_ ? phong_->reaches(texel) : !narrow_;
}

void GlossyLobe::weights(std::size_t texel, std::span<float> first, std::span<float> second) const {
  if (phong_) {
    phong_->weights(texel, first);
    std::fill(second.begin(), second.end(), 0.0f);
    return;
  }
  const auto samples = static_cast<std::size_t>(table_.samples);
  for (std::size_t s = 0; s < samples; ++s) {
    const DirectionTable::Sample& d = table_.sample[texel * samples + s];
    const Bsdf::LobeValues v = bsdf_.lobe_values(
        {static_cast<double>(d.x), static_cast<double>(d.y), static_cast<double>(d.z)});
    first[s] = static_cast<float>(v.first) * d.solid_angle;
    second[s] = static_cast<float>(v.second) * d.solid_angle;
  }
}

void GlossyLobe::whole(std::size_t begin, std::size_t count, std::uint64_t wanted, float* first,
                       float* second, std::span<float> first_weights,
                       std::span<float> second_weights) const {
  if (phong_) {
    for (std::uint64_t bits = wanted; bits != 0; bits &= bits - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(bits));
      if (!reaches(begin + i)) continue;
      weights(begin + i, first_weights, second_weights);
      double sum = 0;
      for (const float part : first_weights) sum += static_cast<double>(part);
      first[i] = static_cast<float>(sum);
    }
    return;
  }
  if (narrow_) return;
  const std::size_t texels = table_.texels(),
                    samples = wide_ ? 1 : static_cast<std::size_t>(table_.samples);
  float sum_first[64] = {}, sum_second[64] = {}, solid_angle[64] = {}, a[64], b[64];
  for (std::size_t s = 0; s < static_cast<std::size_t>(table_.samples); ++s) {
    const float* angle = table_.plane_solid_angle.data() + s * texels + begin;
    for (std::size_t i = 0; i < count; ++i) solid_angle[i] += angle[i];
  }
  for (std::size_t s = 0; s < samples; ++s) {
    const std::size_t at = s * texels + begin;
    lobe_values(bsdf_, count, table_.plane_x.data() + at, table_.plane_y.data() + at,
                table_.plane_z.data() + at, a, b);
    const float* angle = wide_ ? solid_angle : table_.plane_solid_angle.data() + at;
    for (std::size_t i = 0; i < count; ++i) {
      sum_first[i] += a[i] * angle[i], sum_second[i] += b[i] * angle[i];
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    if ((wanted >> i & 1u) != 0) first[i] = sum_first[i], second[i] = sum_second[i];
  }
}

}  // namespace haarlight
