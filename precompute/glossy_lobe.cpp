// How much of a material's lobe falls into each sample of a texel.

#include "precompute/glossy_lobe.h"

#include <algorithm>
#include <cmath>

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

Bsdf::LobeValues GlossyLobe::whole(std::size_t texel, std::span<float> first,
                                   std::span<float> second) const {
  Bsdf::LobeValues sum;
  if (wide_) {
    const auto samples = static_cast<std::size_t>(table_.samples);
    double solid_angle = 0;
    for (std::size_t s = 0; s < samples; ++s) {
      solid_angle += static_cast<double>(table_.sample[texel * samples + s].solid_angle);
    }
    const DirectionTable::Sample& d = table_.sample[texel * samples];
    sum = bsdf_.lobe_values(
        {static_cast<double>(d.x), static_cast<double>(d.y), static_cast<double>(d.z)});
    sum.first *= solid_angle;
    sum.second *= solid_angle;
    return sum;
  }
  weights(texel, first, second);
  for (const float part : first) sum.first += static_cast<double>(part);
  for (const float part : second) sum.second += static_cast<double>(part);
  return sum;
}

}  // namespace haarlight
