// How much of a Phong lobe falls into each sample of a texel.

#include "precompute/phong_lobe.h"

#include <algorithm>
#include <cmath>

#include "wavelet/cubemap.h"

namespace haarlight {

PhongLobe::PhongLobe(const DirectionTable& table, const Vec3& mirror, const Vec3& normal,
                     double exponent)
    : table_(table),
      mirror_(mirror),
      normal_(normal),
      exponent_(exponent),
      scale_((exponent + 2) / (2 * kPi)) {
  // cos^e = 1e-9 at cos alpha = 1 - chord^2 / 2; never past the plane cos alpha = 0.
  const double lowest = exponent > 0 ? std::exp(std::log(1e-9) / exponent) : 0;
  widest_chord_ = std::sqrt(2 * (1 - lowest));

  // Near its peak the lobe is a Gaussian of width 1 / sqrt(e). Sampled one width apart, the error
  // of a sum over a Gaussian is 2 exp(-2 pi^2) = 5e-9 of it; half a width also gets single texels
  // right to about 1 %. A texel is at most 2 / n wide.
  const double texel = 2.0 / table.n;
  const double own_spacing = texel / std::sqrt(static_cast<double>(table.samples));
  const double width = exponent > 0 ? 1 / std::sqrt(exponent) : 1e9;
  if (own_spacing > 0.5 * width) {
    fine_ = static_cast<int>(std::ceil(2 * texel / width));
    const std::vector<TexelPlace> places = texel_places(table.samples);
    owner_.resize(static_cast<std::size_t>(fine_) * static_cast<std::size_t>(fine_));
    for (int y = 0; y < fine_; ++y) {
      for (int x = 0; x < fine_; ++x) {
        const double u = (x + 0.5) / fine_, v = (y + 0.5) / fine_;
        const auto off = [&](const TexelPlace& p) {
          return (p.u - u) * (p.u - u) + (p.v - v) * (p.v - v);
        };
        const auto nearest =
            std::min_element(places.begin(), places.end(),
                             [&](const auto& a, const auto& b) { return off(a) < off(b); });
        owner_[static_cast<std::size_t>(y) * static_cast<std::size_t>(fine_) +
               static_cast<std::size_t>(x)] = static_cast<int>(nearest - places.begin());
      }
    }
  }
}

double PhongLobe::value(const Vec3& direction) const {
  const double cosine = dot(normal_, direction);
  if (cosine <= 0) return 0;
  // cos^e as exp(e log cos) with cos = 1 - chord^2 / 2: exact where the power is steep.
  const Vec3 chord = direction - mirror_;
  const double below = 0.5 * dot(chord, chord);
  if (below >= 1) return 0;
  return scale_ * std::exp(exponent_ * std::log1p(-below)) * cosine;
}

bool PhongLobe::reaches(std::size_t texel) const {
  const DirectionTable::Sample& s = table_.sample[texel * static_cast<std::size_t>(table_.samples)];
  const Vec3 d{static_cast<double>(s.x), static_cast<double>(s.y), static_cast<double>(s.z)};
  // From a sample to any place of its texel it is at most the texel's diagonal.
  return length(d - mirror_) <= widest_chord_ + 2.0 * std::sqrt(2.0) / table_.n;
}

void PhongLobe::weights(std::size_t texel, std::span<float> weights) const {
  const auto per_texel = static_cast<std::size_t>(table_.samples);
  if (fine_ == 0) {
    for (std::size_t s = 0; s < per_texel; ++s) {
      const DirectionTable::Sample& p = table_.sample[texel * per_texel + s];
      weights[s] = static_cast<float>(
          value({static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z)}) *
          static_cast<double>(p.solid_angle));
    }
    return;
  }
  double solid_angle = 0;
  for (std::size_t s = 0; s < per_texel; ++s) {
    solid_angle += static_cast<double>(table_.sample[texel * per_texel + s].solid_angle);
  }
  const auto n = static_cast<std::size_t>(table_.n);
  const auto face = static_cast<int>(texel / (n * n));
  const double row = static_cast<double>(texel / n % n), column = static_cast<double>(texel % n);
  std::vector<double> sum(per_texel, 0.0);
  double total = 0;
  for (int y = 0; y < fine_; ++y) {
    for (int x = 0; x < fine_; ++x) {
      const double u = 2 * (column + (x + 0.5) / fine_) / table_.n - 1;
      const double v = 2 * (row + (y + 0.5) / fine_) / table_.n - 1;
      const double density = std::pow(1 + u * u + v * v, -1.5);
      total += density;
      const int owner = owner_[static_cast<std::size_t>(y) * static_cast<std::size_t>(fine_) +
                               static_cast<std::size_t>(x)];
      sum[static_cast<std::size_t>(owner)] += density * value(cube_direction({face, u, v}));
    }
  }
  for (std::size_t s = 0; s < per_texel; ++s) {
    weights[s] = static_cast<float>(sum[s] * solid_angle / total);
  }
}

}  // namespace haarlight
