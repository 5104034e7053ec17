// Chooses directions by what they bring.

#include "caching/sphere_table.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "caching/sphere_cells.h"

namespace haarlight {

namespace {

// The first sum above u, and how far u is on the way to it from the one before.
struct Choice {
  std::size_t index = 0;
  double rest = 0;
};

Choice choose(std::span<const double> sum, double u) {
  const double at = u * sum.back();
  const auto found =
      static_cast<std::size_t>(std::upper_bound(sum.begin(), sum.end(), at) - sum.begin());
  const std::size_t i = std::min(found, sum.size() - 1);
  const double before = i > 0 ? sum[i - 1] : 0;
  return {i, std::clamp((at - before) / (sum[i] - before), 0.0, 1 - 1e-12)};
}

}  // namespace

SphereTable::SphereTable(const std::vector<double>& weight, double even) {
  double all = 0, bands = 0;
  for (const double w : weight) all += w;
  for (std::size_t cell = 0; cell < kCells; ++cell) {
    const double same = 1.0 / static_cast<double>(kCells);
    chance_.push_back(all > 0 ? (1 - even) * weight[cell] / all + even * same : same);
    sum_.push_back((cell % kColumns > 0 ? sum_.back() : 0) + chance_.back());
    if (cell % kColumns + 1 < kColumns) continue;
    bands += sum_.back();
    band_sum_.push_back(bands);
  }
}

SphereTable::Sample SphereTable::sample(double u, double v) const {
  const Choice band = choose(band_sum_, u);
  const Choice column = choose(std::span(sum_).subspan(band.index * kColumns, kColumns), v);
  const double height = (static_cast<double>(band.index) + band.rest) / kBands;
  const double turn = (static_cast<double>(column.index) + column.rest) / kColumns;
  return {cell_direction(height, turn),
          chance_[band.index * kColumns + column.index] * static_cast<double>(kCells) / (4 * kPi)};
}

double SphereTable::pdf(const Vec3& from) const {
  double turn = std::atan2(from.x, from.z) / (2 * kPi);
  if (turn < 0) turn += 1;
  const int band = std::clamp(static_cast<int>((from.y + 1) / 2 * kBands), 0, kBands - 1);
  const int column = std::clamp(static_cast<int>(turn * kColumns), 0, kColumns - 1);
  const auto cell = static_cast<std::size_t>(band) * kColumns + static_cast<std::size_t>(column);
  return chance_[cell] * static_cast<double>(kCells) / (4 * kPi);
}

}  // namespace haarlight
