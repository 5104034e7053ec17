// A picture of distant light behind a scene that moves.

#include "caching/environment_light.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace haarlight {
namespace {

// Cells of equal solid angle: bands of equal height on the unit sphere, columns of equal turn.
constexpr int kBands = 96, kColumns = 192;
constexpr std::size_t kCells = std::size_t{kBands} * kColumns;
constexpr double kEven = 0.1;  // share of samples that go anywhere

Vec3 direction(double height, double turn) {
  const double y = 2 * height - 1, ring = std::sqrt(std::max(1 - y * y, 0.0));
  return {ring * std::sin(2 * kPi * turn), y, ring * std::cos(2 * kPi * turn)};
}

}  // namespace

EnvironmentLight::EnvironmentLight(Environment environment) : environment_(std::move(environment)) {
  // So many looks at a cell that no pixel falls between them.
  const int looks = std::clamp(2 * environment_.picture().width / kColumns, 4, 32);
  std::vector<double> light(kCells);
  double all = 0;
  for (int band = 0; band < kBands; ++band) {
    for (int column = 0; column < kColumns; ++column) {
      double sum = 0;
      for (int i = 0; i < looks; ++i) {
        for (int j = 0; j < looks; ++j) {
          sum += luminance(radiance(direction((band + (i + 0.5) / looks) / kBands,
                                              (column + (j + 0.5) / looks) / kColumns)));
        }
      }
      light[static_cast<std::size_t>(band) * kColumns + static_cast<std::size_t>(column)] = sum;
      all += sum;
    }
  }
  double sum = 0;
  for (const double l : light) {
    const double even = 1.0 / static_cast<double>(kCells);
    chance_.push_back(all > 0 ? (1 - kEven) * l / all + kEven * even : even);
    sum += chance_.back();
    sum_.push_back(sum);
  }
}

std::size_t EnvironmentLight::cell(double height, double turn) const {
  const int band = std::clamp(static_cast<int>(height * kBands), 0, kBands - 1);
  const int column = std::clamp(static_cast<int>(turn * kColumns), 0, kColumns - 1);
  return static_cast<std::size_t>(band) * kColumns + static_cast<std::size_t>(column);
}

EnvironmentLight::Sample EnvironmentLight::sample(double u, double v) const {
  const double at = u * sum_.back();
  const auto found = std::upper_bound(sum_.begin(), sum_.end(), at) - sum_.begin();
  const auto i = std::min(static_cast<std::size_t>(found), kCells - 1);
  // What is left of u says where in the cell.
  const double before = i > 0 ? sum_[i - 1] : 0;
  const double rest = std::clamp((at - before) / (sum_[i] - before), 0.0, 1 - 1e-12);
  const double height = (static_cast<double>(i / kColumns) + v) / kBands;
  const double turn = (static_cast<double>(i % kColumns) + rest) / kColumns;
  return {direction(height, turn), chance_[i] * static_cast<double>(kCells) / (4 * kPi)};
}

double EnvironmentLight::pdf(const Vec3& from) const {
  double turn = std::atan2(from.x, from.z) / (2 * kPi);
  if (turn < 0) turn += 1;
  return chance_[cell((from.y + 1) / 2, turn)] * static_cast<double>(kCells) / (4 * kPi);
}

}  // namespace haarlight
