// NWA, BI and PBI: which wavelets change in a frame.

#include "prt/lighting_tracker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/error.h"
#include "core/simd.h"

namespace haarlight {
namespace {

constexpr int kMostExpected = 4096;  // for exhaustive band choice under a limit
// Of a texel (see wavelet/environment.h); a scaling function sums n^2 of them over n.
constexpr float kLargestRadiance = 1.8e18f;
// What is less is taken as zero: 2^-100. Floats from there on are multiples of 2^-123, so that
// their differences are no denormals, which are slow, and no two of them differ without a
// difference.
constexpr float kLeastCoefficient = 0x1p-100f;

// Copies `count` values, less than kLeastCoefficient as 0; whether all are at most `largest`, which
// NaN and infinity are not.
HAARLIGHT_MULTIVERSION bool take_values(const float* in, float* out, std::size_t count,
                                        float largest) {
  unsigned wrong = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const float size = std::abs(in[i]);
    wrong |= static_cast<unsigned>(!(size <= largest));
    out[i] = size < kLeastCoefficient ? 0.0f : in[i];
  }
  return wrong == 0;
}

constexpr std::pair<LightingMethod, const char*> kMethodNames[] = {
    {LightingMethod::nwa, "nwa"},
    {LightingMethod::bi, "bi"},
    {LightingMethod::pbi, "pbi"},
    {LightingMethod::reference, "reference"}};

void check_options(const HaarLayout& layout, const LightingOptions& options) {
  if (options.wavelets < 1) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("wavelets is {}, expected at least 1", options.wavelets));
  }
  if (options.weights.empty()) return;
  if (options.weights.size() != static_cast<std::size_t>(layout.size())) {
    throw Error(
        ErrorKind::invalid_argument,
        fmt::format("weights has {} entries, expected {} (6*{}*{}) or none", options.weights.size(),
                    layout.size(), layout.face_size(), layout.face_size()));
  }
  for (std::size_t i = 0; i < options.weights.size(); ++i) {
    if (!(options.weights[i] >= 0) || !std::isfinite(options.weights[i])) {
      throw Error(
          ErrorKind::invalid_argument,
          fmt::format("weights[{}] is {}, expected a finite number >= 0", i, options.weights[i]));
    }
  }
}

RgbD difference(const Rgb& to, const Rgb& from) { return RgbD(to) - RgbD(from); }

}  // namespace

std::optional<LightingMethod> lighting_method_from_name(std::string_view name) {
  for (const auto& [method, text] : kMethodNames) {
    if (name == text) return method;
  }
  return std::nullopt;
}

std::string lighting_method_name(LightingMethod method) {
  for (const auto& [known, text] : kMethodNames) {
    if (known == method) return text;
  }
  return "unknown";
}

std::vector<float> area_weights(const HaarLayout& layout) {
  std::vector<float> weights(static_cast<std::size_t>(layout.size()));
  for (int b = 0; b < layout.band_count(); ++b) {
    const IndexRange range = layout.band(b);
    // Areas are powers of four, so the root is exact.
    std::fill(weights.begin() + range.begin, weights.begin() + range.end,
              std::sqrt(static_cast<float>(layout.area(b))));
  }
  return weights;
}

LightingTracker::LightingTracker(const HaarLayout& layout, LightingOptions options)
    : layout_(layout) {
  set_options(std::move(options));
  const auto size = static_cast<std::size_t>(layout.size());
  target_.resize(size);
  shown_.resize(size);
  emitted_.resize(size);
  keep_key_.resize(size);
  reset_key_.resize(size);
  key_.resize(size);
  sorted_keys_.resize(2 * static_cast<std::size_t>(layout.band_count()));
}

void LightingTracker::set_options(LightingOptions options) {
  check_options(layout_, options);
  weights_ = options.weights.empty() ? area_weights(layout_) : options.weights;
  options_ = std::move(options);
}

std::span<const Rgb> LightingTracker::take_in(std::span<const Rgb> target) {
  if (target.size() != static_cast<std::size_t>(layout_.size())) {
    throw Error(
        ErrorKind::invalid_argument,
        fmt::format("target lighting has {} coefficients, expected {} (6*{}*{})", target.size(),
                    layout_.size(), layout_.face_size(), layout_.face_size()));
  }
  const float largest = kLargestRadiance * static_cast<float>(layout_.face_size());
  static_assert(sizeof(Rgb) == 3 * sizeof(float));
  if (!take_values(&target[0].r, &target_[0].r, 3 * target.size(), largest)) {
    const auto wrong = std::find_if(target.begin(), target.end(), [&](const Rgb& c) {
      return !(std::abs(c.r) <= largest && std::abs(c.g) <= largest && std::abs(c.b) <= largest);
    });
    throw Error(ErrorKind::invalid_argument,
                fmt::format("target lighting coefficient {} is ({}, {}, {}), expected finite "
                            "values up to {}",
                            wrong - target.begin(), wrong->r, wrong->g, wrong->b, largest));
  }
  return target_;
}

// Keys and band norms of keeping and of resetting, in one pass over the lighting.
void LightingTracker::rank(std::span<const Rgb> target) {
  for (int b = 0; b < layout_.band_count(); ++b) {
    const IndexRange range = layout_.band(b);
    double keep = 0, reset = 0, shown = 0;
    for (int i = range.begin; i < range.end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      // Float differences are nonzero exactly when the values differ, which is all that ranking
      // and convergence need; the deltas themselves are taken in double.
      keep_key_[k] = weights_[k] * l1_norm(target[k] - shown_[k]);
      reset_key_[k] = weights_[k] * l1_norm(target[k]);
      keep += static_cast<double>(keep_key_[k]);
      reset += static_cast<double>(reset_key_[k]);
      shown += static_cast<double>(l1_norm(shown_[k]));
    }
    const auto band = static_cast<std::size_t>(b);
    keep_norm_[band] = keep;
    reset_norm_[band] = reset;
    shown_norm_[band] = shown;
  }
}

// Overbeck 2006, 5.2.2: incremental if || L_new - L_shown ||_1 < || L_new ||_1.
BandMask LightingTracker::choose_bands_simply() const {
  BandMask reset;
  for (std::size_t b = 0; b < static_cast<std::size_t>(layout_.band_count()); ++b) {
    reset[b] = shown_norm_[b] > 0 && !(keep_norm_[b] < reset_norm_[b]);
  }
  return reset;
}

// Overbeck 2006, 5.2.1: the error left by a combination is the sum of all keys less the largest
// `wavelets` of them; every band and choice is sorted once, every combination merges.
BandMask LightingTracker::choose_bands_exhaustively(int wavelets) {
  const auto bands = static_cast<std::size_t>(layout_.band_count());
  unsigned resettable = 0;
  for (std::size_t b = 0; b < bands; ++b) {
    const IndexRange range = layout_.band(static_cast<int>(b));
    for (std::size_t choice = 0; choice < 2; ++choice) {
      const std::vector<float>& keys = choice ? reset_key_ : keep_key_;
      const std::span<const float> band_keys(keys.data() + range.begin,
                                             static_cast<std::size_t>(range.size()));
      top_k_.select(band_keys, wavelets, band_chosen_);
      std::vector<float>& sorted = sorted_keys_[2 * b + choice];
      sorted.clear();
      for (int i : band_chosen_) sorted.push_back(band_keys[static_cast<std::size_t>(i)]);
      std::sort(sorted.begin(), sorted.end(), std::greater<>());
    }
    if (shown_norm_[b] > 0) resettable |= 1u << b;
  }
  unsigned best = 0;
  double least = 0;
  for (unsigned mask = 0; mask < (1u << bands); ++mask) {
    if (mask & ~resettable) continue;
    double error = 0;
    std::array<std::size_t, HaarLayout::kMaxBands> next{};
    for (std::size_t b = 0; b < bands; ++b) error += mask >> b & 1 ? reset_norm_[b] : keep_norm_[b];
    for (int taken = 0; taken < wavelets; ++taken) {
      float largest = 0;
      std::size_t from = bands;
      for (std::size_t b = 0; b < bands; ++b) {
        const std::vector<float>& sorted = sorted_keys_[2 * b + (mask >> b & 1)];
        if (next[b] < sorted.size() && sorted[next[b]] > largest) {
          largest = sorted[next[b]];
          from = b;
        }
      }
      if (from == bands) break;
      ++next[from];
      error -= static_cast<double>(largest);
    }
    if (mask == 0 || error < least) {
      least = error;
      best = mask;
    }
  }
  return BandMask(best);
}

// The next of the ranking, for as long as the limit takes them.
void LightingTracker::take_ranked(std::span<const Rgb> target, UpdateLimit& limit) {
  chosen_.clear();
  for (; next_ranked_ >= 0; next_ranked_ = ranked_.next()) {
    const auto k = static_cast<std::size_t>(next_ranked_);
    if (!limit.take(next_ranked_, target[k] - shown_[k])) break;
    chosen_.push_back(next_ranked_);
  }
  std::sort(chosen_.begin(), chosen_.end());
}

void LightingTracker::show(std::span<const Rgb> target, int index, LightingUpdate& update) {
  const auto k = static_cast<std::size_t>(index);
  // Against what was really handed out, so that a rounded delta (a coefficient that fell by more
  // than 2^29) is made good by the next one instead of staying for ever.
  const RgbD delta = RgbD(target[k]) - emitted_[k];
  update.deltas.push_back({index, delta});
  emitted_[k] += delta;
  shown_[k] = target[k];
}

const LightingUpdate& LightingTracker::advance(std::span<const Rgb> target) {
  return advance(target, nullptr);
}

const LightingUpdate& LightingTracker::advance(std::span<const Rgb> target, UpdateLimit& limit) {
  return advance(target, &limit);
}

const LightingUpdate& LightingTracker::advance(std::span<const Rgb> wanted, UpdateLimit* limit) {
  const std::span<const Rgb> target = take_in(wanted);
  // How many the limit will take is not known yet: about as many as it took before.
  const int expected = limit ? std::clamp(static_cast<int>(update_.deltas.size()), 1, kMostExpected)
                             : options_.wavelets;
  update_.reset.reset();
  update_.deltas.clear();
  next_ranked_ = -1;

  if (options_.method == LightingMethod::reference) {
    for (int i = 0; i < layout_.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (!(target[k] == shown_[k])) show(target, i, update_);
    }
    return update_;
  }

  // Decide band by band: keep what is shown, or start the band anew (Figure 6, lines 1-4).
  rank(target);
  const auto bands = static_cast<std::size_t>(layout_.band_count());
  if (options_.method == LightingMethod::nwa) {
    for (std::size_t b = 0; b < bands; ++b) update_.reset[b] = true;
  } else if (options_.method == LightingMethod::pbi) {
    update_.reset = options_.band_choice == BandChoice::simple
                        ? choose_bands_simply()
                        : choose_bands_exhaustively(expected);
    if (limit && update_.reset.any()) {
      std::array<double, HaarLayout::kMaxBands> gain{};
      for (std::size_t b = 0; b < bands; ++b) gain[b] = keep_norm_[b] - reset_norm_[b];
      update_.reset &= limit->allow(update_.reset, gain);
    }
  }

  // Forget the reset bands (line 14) and pick wavelets over all bands together (line 3).
  for (std::size_t b = 0; b < bands; ++b) {
    const IndexRange range = layout_.band(static_cast<int>(b));
    const std::vector<float>& from = update_.reset[b] ? reset_key_ : keep_key_;
    std::copy(from.begin() + range.begin, from.begin() + range.end, key_.begin() + range.begin);
    if (update_.reset[b]) {
      std::fill(shown_.begin() + range.begin, shown_.begin() + range.end, Rgb{});
      std::fill(emitted_.begin() + range.begin, emitted_.begin() + range.end, RgbD{});
    }
  }
  if (limit) {
    limit->begin(target, shown_, update_.reset);
    ranked_.start(key_);
    next_ranked_ = ranked_.next();
    take_ranked(target, *limit);
  } else {
    top_k_.select(key_, options_.wavelets, chosen_);
  }

  // Bring the chosen ones up to date (lines 8-11 and 15-18; Eqs. 5 and 6).
  for (int index : chosen_) show(target, index, update_);
  return update_;
}

const LightingUpdate& LightingTracker::extend(UpdateLimit& limit) {
  rest_.deltas.clear();
  take_ranked(target_, limit);
  for (int index : chosen_) show(target_, index, rest_);
  return rest_;
}

const LightingUpdate& LightingTracker::start_exact(std::span<const Rgb> wanted) {
  const std::span<const Rgb> target = take_in(wanted);
  update_.reset.reset();
  update_.deltas.clear();
  next_ranked_ = -1;
  for (int b = 0; b < layout_.band_count(); ++b) update_.reset[static_cast<std::size_t>(b)] = true;
  std::fill(shown_.begin(), shown_.end(), Rgb{});
  std::fill(emitted_.begin(), emitted_.end(), RgbD{});
  for (int i = 0; i < layout_.size(); ++i) {
    if (!(target[static_cast<std::size_t>(i)] == Rgb{})) show(target, i, update_);
  }
  return update_;
}

double lighting_error(const HaarLayout& layout, std::span<const Rgb> shown,
                      std::span<const Rgb> target) {
  double error = 0, norm = 0;
  for (int b = 0; b < layout.band_count(); ++b) {
    const IndexRange range = layout.band(b);
    double band_error = 0, band_norm = 0;
    for (int i = range.begin; i < range.end; ++i) {
      const auto k = static_cast<std::size_t>(i);
      band_error += l1_norm(difference(target[k], shown[k]));
      band_norm += static_cast<double>(l1_norm(target[k]));
    }
    const double weight = std::sqrt(layout.area(b));
    error += weight * band_error;
    norm += weight * band_norm;
  }
  if (norm > 0) return error / norm;
  return error > 0 ? 1.0 : 0.0;
}

}  // namespace haarlight
