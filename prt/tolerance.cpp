// Measuring the error of compression, and choosing thresholds before compressing.

#include "prt/tolerance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "core/error.h"
#include "core/simd.h"
#include "prt/prior_lighting.h"
#include "prt/tile_record.h"

namespace haarlight {
namespace {

constexpr auto kRows = static_cast<std::size_t>(kTileRows);
constexpr auto kBlock = static_cast<std::size_t>(kBlockRows);

// Candidate thresholds: steps of 2^(1/4), spanning what a transport's entries span.
constexpr std::size_t kLevels = 128;
constexpr double kStepsAnOctave = 4;
constexpr double kSmallestThreshold = 1e-9;
constexpr std::size_t kLights = 8;  // of the built-in lightings, side by side

constexpr double kDeviations = 2;  // that measured tiles may lie above the pilots
constexpr double kAim = 0.95;      // of the error asked for

int level_of(double rms) {
  if (!(rms > kSmallestThreshold)) return 0;
  return std::min(static_cast<int>(kLevels) - 1,
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

HAARLIGHT_MULTIVERSION void add_squares(const float* row, std::size_t size, float* sum) {
  for (std::size_t j = 0; j < size; ++j) sum[j] += row[j] * row[j];
}

// whole[l] += the row under light l; kept[level][l] += the rounded row's entries of a level.
HAARLIGHT_MULTIVERSION void add_levels(const float* row, const float* rounded,
                                       const std::uint8_t* level, const float* light,
                                       std::size_t size, double* whole, double* kept) {
  double sum[kLights] = {};
  for (std::size_t j = 0; j < size; ++j) {
    const auto exact = static_cast<double>(row[j]), stored = static_cast<double>(rounded[j]);
    const float* of = light + j * kLights;
    double* to = kept + level[j] * kLights;
    for (std::size_t l = 0; l < kLights; ++l) {
      const auto radiance = static_cast<double>(of[l]);
      sum[l] += exact * radiance;
      to[l] += stored * radiance;
    }
  }
  for (std::size_t l = 0; l < kLights; ++l) whole[l] += sum[l];
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
  State(const HaarLayout& l, double e) : layout(l), error(e), lightings(prior_lightings(l).size()) {
    const auto size = static_cast<std::size_t>(l.size());
    light.assign(size * kLights, 0.0f);
    for (std::size_t i = 0; i < std::min(lightings, kLights); ++i) {
      for (std::size_t j = 0; j < size; ++j) light[j * kLights + i] = prior_lightings(l)[i][j];
    }
  }
  HaarLayout layout;
  double error;
  std::size_t lightings;
  std::vector<float> light;  // [coefficient][kLights]
  std::vector<Pilot> pilots;
  double bound(std::size_t level, int tiles, int of) const;
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

// What is left of a row's picture is exact - kept. With every block rounded, kept is a sum over the
// levels that are not dropped, which one pass over the row finds for all of them.
ToleranceTuner::Pilot ToleranceTuner::measure(const TileRows& tile) const {
  const State& s = *state_;
  const auto size = static_cast<std::size_t>(s.layout.size());
  Pilot pilot;
  pilot.error.assign(s.lightings * kLevels, 0.0);
  pilot.energy.assign(s.lightings, 0.0);
  pilot.scales.assign(kLevels, 0.0);
  std::vector<float> rounded;
  decompress_tile(
      s.layout,
      compress_tile(s.layout, tile,
                    std::vector<float>(static_cast<std::size_t>(s.layout.band_count()))),
      rounded);
  std::vector<std::uint8_t> level(size);
  std::vector<float> energy(size);
  for (std::size_t block = 0; block < kTileBlocks; ++block) {
    const std::size_t channels = tile.rgb_blocks >> block & 1 ? 3 : 1;
    const auto row_at = [&](std::size_t ch, std::size_t r) {
      return (ch * kRows + block * kBlock + r) * size;
    };
    std::fill(energy.begin(), energy.end(), 0.0f);
    for (std::size_t ch = 0; ch < channels; ++ch) {
      for (std::size_t r = 0; r < kBlock; ++r) {
        add_squares(tile.values.data() + row_at(ch, r), size, energy.data());
      }
    }
    for (std::size_t j = 0; j < size; ++j) {
      level[j] = static_cast<std::uint8_t>(level_of(
          std::sqrt(static_cast<double>(energy[j]) / static_cast<double>(kBlock * channels))));
      if (energy[j] > 0) pilot.scales[level[j]] += static_cast<double>(channels);
    }
    for (std::size_t r = 0; r < kBlock; ++r) {
      const std::size_t row = block * kBlock + r;
      const double weight = row_weight(tile.rgb_blocks, tile.color[row], row);
      for (std::size_t ch = 0; ch < channels; ++ch) {
        double whole[kLights] = {}, kept[kLevels * kLights] = {};
        add_levels(tile.values.data() + row_at(ch, r), rounded.data() + row_at(ch, r), level.data(),
                   s.light.data(), size, whole, kept);
        for (std::size_t l = 0; l < s.lightings; ++l) {
          double left = 0;
          for (std::size_t i = kLevels; i-- > 0;) {
            const double off = whole[l] - left;
            pilot.error[l * kLevels + i] += weight * off * off;
            left += kept[i * kLights + l];
          }
          pilot.energy[l] += weight * whole[l] * whole[l];
        }
      }
    }
  }
  return pilot;
}

void ToleranceTuner::add(Pilot pilot) { state_->pilots.push_back(std::move(pilot)); }

// The worst lighting's error if everything up to `level` is dropped, and how far the tiles that are
// measured may lie above the pilots: errors are ratios of sums over tiles, whose variance is that
// of the deviations from the ratio (Cochran 1977, section 6.4).
double ToleranceTuner::State::bound(std::size_t level, int tiles, int of) const {
  const auto n = static_cast<double>(pilots.size());
  double worst = 0;
  for (std::size_t l = 0; l < lightings; ++l) {
    double error_sum = 0, energy_sum = 0;
    for (const Pilot& p : pilots) {
      error_sum += p.error[l * kLevels + level], energy_sum += p.energy[l];
    }
    if (!(energy_sum > 0)) continue;
    const double ratio = error_sum / energy_sum;
    double square = 0;
    for (const Pilot& p : pilots) {
      const double off = p.error[l * kLevels + level] - ratio * p.energy[l];
      square += off * off;
    }
    // m pilots and the measured tiles lie about the mean of all, those that are both not at all.
    const double m = of > 0 ? of : n,
                 others = tiles > 0 ? static_cast<double>(tiles) / kMeasureEvery : m;
    const double outside = tiles > 0 ? std::max(0.0, 1 - m / tiles) : 1;
    const double mean = energy_sum / n;
    const double variance =
        n > 1 ? square / (n - 1) / (mean * mean) * (1 / m + 1 / others) * outside : 0;
    worst = std::max(worst, std::sqrt(ratio + kDeviations * std::sqrt(variance)));
  }
  return worst;
}

std::vector<float> ToleranceTuner::thresholds(int tiles, int of) const {
  const State& s = *state_;
  // Users' lights are none of ours: aim a little lower.
  const double aim = kAim * s.error;
  std::size_t level = 0;  // everything below this one may go
  const bool anything = std::any_of(s.pilots.begin(), s.pilots.end(), [](const Pilot& p) {
    return std::any_of(p.energy.begin(), p.energy.end(), [](double e) { return e > 0; });
  });
  if (anything && s.error > 0) {
    while (level + 1 < kLevels && s.bound(level, tiles, of) <= aim) ++level;
  }
  // The upper border of the last bin that goes.
  const double threshold = level > 0 ? threshold_of(static_cast<int>(level) - 1) : 0.0;
  return std::vector<float>(static_cast<std::size_t>(s.layout.band_count()),
                            static_cast<float>(threshold));
}

double ToleranceTuner::tile_bytes(float threshold) const {
  const State& s = *state_;
  if (s.pilots.empty()) return 0;
  double scales = 0;
  for (std::size_t i = 0; i < kLevels; ++i) {
    if (threshold_of(static_cast<int>(i)) <= static_cast<double>(threshold)) continue;
    for (const Pilot& p : s.pilots) scales += p.scales[i];
  }
  scales /= static_cast<double>(s.pilots.size());
  // 18 bytes a scale with its values; 32 and some padding a column, which the tiles of a chunk
  // share.
  const double columns = std::min(scales, static_cast<double>(s.layout.size()) * 40 / 64);
  return 18 * scales + columns;
}

std::vector<float> ToleranceTuner::thresholds_for_size(double tile_bytes_wanted, int tiles) const {
  std::vector<float> found = thresholds(tiles);
  float threshold = found.front();
  for (int i = 0; i < static_cast<int>(kLevels) && tile_bytes(threshold) > tile_bytes_wanted; ++i) {
    threshold = std::max(threshold, static_cast<float>(threshold_of(i)));
  }
  std::fill(found.begin(), found.end(), threshold);
  return found;
}

}  // namespace haarlight
