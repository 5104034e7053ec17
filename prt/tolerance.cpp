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
double row_weight(unsigned rgb_blocks, const Rgb& color, std::size_t row) {
  if (rgb_blocks >> (row / kBlock) & 1) return 1;
  const RgbD c(color);
  return c.r * c.r + c.g * c.g + c.b * c.b;
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

std::vector<double> tile_pictures(const HaarLayout& layout, std::span<const float> values,
                                  unsigned rgb_blocks,
                                  std::span<const std::vector<float>> lightings) {
  const auto size = static_cast<std::size_t>(layout.size());
  const std::size_t channels = rgb_blocks == 0 ? 1 : 3;
  std::vector<double> pictures(lightings.size() * channels * kRows);
  for (std::size_t ch = 0; ch < channels; ++ch) {
    for (std::size_t row = 0; row < kRows; ++row) {
      if (ch > 0 && !(rgb_blocks >> (row / kBlock) & 1)) continue;
      const float* entries = values.data() + (ch * kRows + row) * size;
      for (std::size_t l = 0; l < lightings.size(); ++l) {
        pictures[(l * channels + ch) * kRows + row] =
            dot_product(entries, lightings[l].data(), size);
      }
    }
  }
  return pictures;
}

PictureError tile_error(const HaarLayout& layout, std::span<const double> exact,
                        const CompressedTile& compressed, std::span<const Rgb> color,
                        std::span<const std::vector<float>> lightings) {
  std::vector<float> values;
  decompress_tile(layout, compressed, values);
  const std::vector<double> kept = tile_pictures(layout, values, compressed.rgb_blocks, lightings);
  const std::size_t channels = compressed.rgb_blocks == 0 ? 1 : 3;
  PictureError sum;
  sum.error.resize(lightings.size());
  sum.energy.resize(lightings.size());
  for (std::size_t row = 0; row < kRows; ++row) {
    const double weight = row_weight(compressed.rgb_blocks, color[row], row);
    for (std::size_t ch = 0; ch < channels; ++ch) {  // channels not in use are zero in both
      for (std::size_t l = 0; l < lightings.size(); ++l) {
        const std::size_t at = (l * channels + ch) * kRows + row;
        const double difference = exact[at] - kept[at];
        sum.error[l] += weight * difference * difference;
        sum.energy[l] += weight * exact[at] * exact[at];
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
  // Scales that are stored at each level, and columns' heads shared out over the tiles of a chunk.
  std::array<double, kLevels> scales{};
  int tiles = 0;
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
  ++s.tiles;
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
      if (energy > 0) s.scales[level[j]] += static_cast<double>(channels);
    }
    for (std::size_t r = 0; r < kBlock; ++r) {
      const std::size_t row = block * kBlock + r;
      const double weight = row_weight(tile.rgb_blocks, tile.color[row], row);
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

double ToleranceTuner::tile_bytes(float threshold) const {
  const State& s = *state_;
  if (s.tiles == 0) return 0;
  double scales = 0;
  for (int i = 0; i < kLevels; ++i) {
    if (threshold_of(i) > static_cast<double>(threshold)) {
      scales += s.scales[static_cast<std::size_t>(i)];
    }
  }
  scales /= s.tiles;
  // 18 bytes a scale with its values; 32 and some padding a column, which the tiles of a chunk
  // share.
  const double columns = std::min(scales, static_cast<double>(s.layout.size()) * 40 / 64);
  return 18 * scales + columns;
}

std::vector<float> ToleranceTuner::thresholds_for_size(double tile_bytes_wanted) const {
  std::vector<float> found = thresholds();
  float threshold = found.front();
  for (int i = 0; i < kLevels && tile_bytes(threshold) > tile_bytes_wanted; ++i) {
    threshold = std::max(threshold, static_cast<float>(threshold_of(i)));
  }
  std::fill(found.begin(), found.end(), threshold);
  return found;
}

}  // namespace haarlight
