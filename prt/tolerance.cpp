// Measuring the error of compression, and choosing thresholds before compressing.

#include "prt/tolerance.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "core/error.h"
#include "core/simd.h"
#include "prt/prior_lighting.h"

namespace haarlight {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kTileRows);
constexpr auto kBlock = static_cast<std::size_t>(kBlockRows);

// Candidate thresholds: steps of 2^(1/4), spanning what a transport's entries span.
constexpr int kLevels = 128;
constexpr double kStepsAnOctave = 4;
constexpr double kSmallestThreshold = 1e-9;

int level_of(double rms) {
  if (!(rms > kSmallestThreshold)) return 0;
  return std::min(kLevels - 1,
                  1 + static_cast<int>(kStepsAnOctave * std::log2(rms / kSmallestThreshold)));
}

double threshold_of(int level) { return kSmallestThreshold * std::exp2(level / kStepsAnOctave); }

// What a squared error of a row weighs in the picture.
double row_weight(const TileRows& tile, std::size_t row) {
  if (tile.rgb_blocks >> (row / kBlock) & 1) return 1;
  const RgbD c(tile.color[row]);
  return c.r * c.r + c.g * c.g + c.b * c.b;
}

std::size_t row_channels(const TileRows& tile, std::size_t row) {
  return tile.rgb_blocks >> (row / kBlock) & 1 ? 3 : 1;
}

// Products and sums in double; eight lanes, so that the compiler may vectorise without reordering.
HAARLIGHT_MULTIVERSION double dot_product(const float* a, const float* b, std::size_t count) {
  double lane[8] = {};
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8) {
    for (std::size_t k = 0; k < 8; ++k) {
      lane[k] += static_cast<double>(a[i + k]) * static_cast<double>(b[i + k]);
    }
  }
  for (; i < count; ++i) lane[0] += static_cast<double>(a[i]) * static_cast<double>(b[i]);
  return ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]));
}

}  // namespace

void PictureError::add(const PictureError& other) {
  error.resize(std::max(error.size(), other.error.size()));
  energy.resize(error.size());
  for (std::size_t i = 0; i < other.error.size(); ++i) {
    error[i] += other.error[i];
    energy[i] += other.energy[i];
  }
}

double PictureError::worst() const {
  double worst = 0;
  for (std::size_t i = 0; i < error.size(); ++i) {
    if (energy[i] > 0) worst = std::max(worst, std::sqrt(error[i] / energy[i]));
  }
  return worst;
}

PictureError tile_error(const HaarLayout& layout, const TileRows& exact,
                        const CompressedTile& compressed,
                        std::span<const std::vector<float>> lightings) {
  const auto size = static_cast<std::size_t>(layout.size());
  PictureError sum;
  sum.error.resize(lightings.size());
  sum.energy.resize(lightings.size());
  std::vector<float> kept;
  decompress_tile(layout, compressed, kept);
  for (std::size_t row = 0; row < kRows; ++row) {
    const double weight = row_weight(exact, row);
    for (std::size_t ch = 0; ch < row_channels(exact, row); ++ch) {
      const float* e = exact.values.data() + (ch * kRows + row) * size;
      const float* k = kept.data() + (ch * kRows + row) * size;
      for (std::size_t l = 0; l < lightings.size(); ++l) {
        const double picture = dot_product(e, lightings[l].data(), size);
        const double difference = picture - dot_product(k, lightings[l].data(), size);
        sum.error[l] += weight * difference * difference;
        sum.energy[l] += weight * picture * picture;
      }
    }
  }
  return sum;
}

struct ToleranceTuner::State {
  State(const HaarLayout& l, double e) : layout(l), error(e), lightings(prior_lightings(l)) {
    errors.assign(lightings.size(), {});
    energies.assign(lightings.size(), 0.0);
  }
  HaarLayout layout;
  double error;
  const std::vector<std::vector<float>>& lightings;
  // Squared picture error if all blocks below each level were dropped.
  std::vector<std::array<double, kLevels>> errors;
  std::vector<double> energies;
};

ToleranceTuner::ToleranceTuner(const HaarLayout& layout, double error) {
  if (!(error >= 0 && error < 1)) {
    throw Error(
        ErrorKind::invalid_argument,
        fmt::format("error is {}, expected a share of the picture from 0 to below 1", error));
  }
  state_ = std::make_unique<State>(layout, error);
}
ToleranceTuner::~ToleranceTuner() = default;

void ToleranceTuner::add(const TileRows& tile) {
  State& s = *state_;
  const auto size = static_cast<std::size_t>(s.layout.size());
  std::vector<std::uint8_t> level(size);
  for (std::size_t block = 0; block < kTileBlocks; ++block) {
    const std::size_t channels = tile.rgb_blocks >> block & 1 ? 3 : 1;
    for (std::size_t j = 0; j < size; ++j) {
      double energy = 0;
      for (std::size_t ch = 0; ch < channels; ++ch) {
        for (std::size_t r = 0; r < kBlock; ++r) {
          const double v = tile.values[(ch * kRows + block * kBlock + r) * size + j];
          energy += v * v;
        }
      }
      level[j] = static_cast<std::uint8_t>(
          level_of(std::sqrt(energy / static_cast<double>(kBlock * channels))));
    }
    for (std::size_t r = 0; r < kBlock; ++r) {
      const std::size_t row = block * kBlock + r;
      const double weight = row_weight(tile, row);
      for (std::size_t ch = 0; ch < channels; ++ch) {
        const float* values = tile.values.data() + (ch * kRows + row) * size;
        for (std::size_t l = 0; l < s.lightings.size(); ++l) {
          const float* light = s.lightings[l].data();
          std::array<double, kLevels> dropped{};
          for (std::size_t j = 0; j < size; ++j) {
            dropped[level[j]] += static_cast<double>(values[j] * light[j]);
          }
          double sum = 0;
          for (std::size_t i = 0; i < kLevels; ++i) {
            sum += dropped[i];
            s.errors[l][i] += weight * sum * sum;
          }
          s.energies[l] += weight * sum * sum;
        }
      }
    }
  }
}

std::vector<float> ToleranceTuner::thresholds() const {
  const State& s = *state_;
  // Pilot tiles are a sample, users' lights are none of ours, and rounding comes on top: aim a
  // quarter lower.
  const double aim = 0.75 * s.error;
  int level = 0;
  for (int i = 0; i < kLevels - 1; ++i) {
    double worst = 0;
    for (std::size_t l = 0; l < s.lightings.size(); ++l) {
      if (s.energies[l] > 0) {
        worst =
            std::max(worst, std::sqrt(s.errors[l][static_cast<std::size_t>(i)] / s.energies[l]));
      }
    }
    if (worst > aim) break;
    level = i + 1;
  }
  const bool anything =
      std::any_of(s.energies.begin(), s.energies.end(), [](double e) { return e > 0; });
  // Everything up to bin level-1 may go: its upper border is threshold_of(level - 1).
  const double threshold = level > 0 && anything && s.error > 0 ? threshold_of(level - 1) : 0.0;
  return std::vector<float>(static_cast<std::size_t>(s.layout.band_count()),
                            static_cast<float>(threshold));
}

}  // namespace haarlight
