// Tables of lobes in hemispherical harmonics.

#include "caching/lobe_harmonics.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace haarlight {
namespace {

constexpr int kViews = 32;
constexpr std::int32_t kPhong = 1 << 20;

Bsdf lobe_of(std::int32_t key) {
  Bsdf bsdf;
  bsdf.normal = bsdf.geometric_normal = {0, 0, 1};
  bsdf.gloss_first = {1, 1, 1};
  bsdf.lobe = key >= kPhong ? Bsdf::Lobe::phong : Bsdf::Lobe::ggx;
  bsdf.width = key >= kPhong ? std::exp2((key - kPhong) / 64.0) : std::max(key, 1) / 64.0;
  return bsdf;
}

// Midpoint sums over cos theta and phi, half of it by symmetry: steps of 1/96 are a tenth of the
// narrowest lobe that is asked for, and of the basis' shortest wave.
LobeHarmonics::Pair project(std::int32_t key, double cosine) {
  constexpr int kHeights = 96, kTurns = 96;
  Bsdf bsdf = lobe_of(key);
  const double sine = std::sqrt(std::max(1 - cosine * cosine, 0.0));
  bsdf.to_viewer = {sine, 0, cosine};
  std::array<double, kHarmonics> first{}, second{};
  const double share = 1.0 / kHeights * 2 * kPi / kTurns;
  for (int j = 0; j < kHeights; ++j) {
    const double z = (j + 0.5) / kHeights, flat = std::sqrt(1 - z * z);
    for (int k = 0; k < kTurns / 2; ++k) {
      const double phi = 2 * kPi * (k + 0.5) / kTurns;
      const Vec3 w{flat * std::cos(phi), flat * std::sin(phi), z};
      const Bsdf::LobeValues value = bsdf.lobe_values(w);
      if (value.first == 0 && value.second == 0) continue;
      const Harmonics h = hemispherical_harmonics(w);
      for (std::size_t l = 0; l < static_cast<std::size_t>(kHarmonicBands); ++l) {
        for (std::size_t i = l * (l + 1); i < (l + 1) * (l + 1); ++i) {  // m >= 0
          const double f = 2 * share * static_cast<double>(h[i]);
          first[i] += f * value.first, second[i] += f * value.second;
        }
      }
    }
  }
  LobeHarmonics::Pair out{};
  for (std::size_t i = 0; i < kHarmonics; ++i) {
    out.first[i] = static_cast<float>(first[i]), out.second[i] = static_cast<float>(second[i]);
  }
  return out;
}

}  // namespace

std::int32_t lobe_table_key(const Bsdf& bsdf) {
  const double at = bsdf.lobe == Bsdf::Lobe::phong ? 64 * std::log2(std::max(bsdf.width, 1.0))
                                                   : 64 * std::clamp(bsdf.width, 0.0, 1.0);
  return static_cast<std::int32_t>(std::lround(at)) + (bsdf.lobe == Bsdf::Lobe::phong ? kPhong : 0);
}

void LobeHarmonics::make(const std::vector<std::int32_t>& keys) {
  for (const std::int32_t key : keys) {
    auto& table = table_[key];
    if (!table.empty()) continue;
    table.resize(kViews + 1);
    parallel_for(kViews + 1, [&](int v) {
      table[static_cast<std::size_t>(v)] = project(key, std::max(v, 1) / double{kViews});
    });
  }
}

LobeHarmonics::Pair LobeHarmonics::at(std::int32_t key, const Vec3& o) const {
  const auto& table = table_.at(key);
  const double x = std::clamp(o.z, 0.0, 1.0) * kViews;
  const auto low = static_cast<std::size_t>(std::min(static_cast<int>(x), kViews - 1));
  const auto part = static_cast<float>(x - static_cast<double>(low));
  Pair between{};
  for (std::size_t i = 0; i < kHarmonics; ++i) {
    const Pair &a = table[low], &b = table[low + 1];
    between.first[i] = a.first[i] + part * (b.first[i] - a.first[i]);
    between.second[i] = a.second[i] + part * (b.second[i] - a.second[i]);
  }
  const double flat = std::hypot(o.x, o.y);
  const double c = flat > 0 ? o.x / flat : 1, s = flat > 0 ? o.y / flat : 0;
  return {turned_about_z(between.first, c, s), turned_about_z(between.second, c, s)};
}

}  // namespace haarlight
