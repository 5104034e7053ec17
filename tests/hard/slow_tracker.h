// The lighting tracker again, slow and plain: what an update must be, straight from its definition.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

#include "prt/lighting_tracker.h"

namespace haarlight::hard {

/// Overbeck 2006, Figure 6, by sorting all coefficients every time.
class SlowTracker {
 public:
  SlowTracker(const HaarLayout& layout, LightingOptions options)
      : layout_(layout),
        options_(std::move(options)),
        shown_(static_cast<std::size_t>(layout.size())),
        handed_out_(shown_.size()) {}

  void set_options(LightingOptions options) { options_ = std::move(options); }
  const std::vector<Rgb>& shown() const { return shown_; }

  /// `exhaustive` resets are the tracker's own choice, taken over here; see combination_error().
  LightingUpdate advance(std::vector<Rgb> target, const BandMask& exhaustive) {
    without_traces(target);
    LightingUpdate update;
    if (options_.method == LightingMethod::reference) {
      for (std::size_t i = 0; i < target.size(); ++i) {
        if (!(target[i] == shown_[i])) show(update, i, target[i]);
      }
      return update;
    }
    for (int b = 0; b < layout_.band_count(); ++b) {
      const auto band = static_cast<std::size_t>(b);
      if (options_.method == LightingMethod::nwa) update.reset[band] = true;
      if (options_.method == LightingMethod::pbi) {
        update.reset[band] = options_.band_choice == BandChoice::exhaustive
                                 ? exhaustive[band]
                                 : is_reset_nearer(target, b);
      }
    }
    for (std::size_t i = 0; i < target.size(); ++i) {
      if (!update.reset[static_cast<std::size_t>(layout_.band_of(static_cast<int>(i)))]) continue;
      shown_[i] = {};
      handed_out_[i] = {};
    }
    for (const std::size_t i : largest(target, shown_)) show(update, i, target[i]);
    std::sort(update.deltas.begin(), update.deltas.end(),
              [](const WaveletDelta& a, const WaveletDelta& b) { return a.index < b.index; });
    return update;
  }

  LightingUpdate start_exact(std::vector<Rgb> target) {
    without_traces(target);
    LightingUpdate update;
    for (int b = 0; b < layout_.band_count(); ++b) update.reset[static_cast<std::size_t>(b)] = true;
    std::fill(shown_.begin(), shown_.end(), Rgb{});
    std::fill(handed_out_.begin(), handed_out_.end(), RgbD{});
    for (std::size_t i = 0; i < target.size(); ++i) {
      if (!(target[i] == Rgb{})) show(update, i, target[i]);
    }
    return update;
  }

  /// Weighted error that an update with these resets would leave.
  double combination_error(std::vector<Rgb> target, const BandMask& reset) const {
    without_traces(target);
    std::vector<Rgb> kept = shown_;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      if (reset[static_cast<std::size_t>(layout_.band_of(static_cast<int>(i)))]) kept[i] = {};
    }
    for (const std::size_t i : largest(target, kept)) kept[i] = target[i];
    double error = 0;
    for (std::size_t i = 0; i < kept.size(); ++i) {
      error += static_cast<double>(weight(i) * l1_norm(target[i] - kept[i]));
    }
    return error;
  }

 private:
  static void without_traces(std::vector<Rgb>& light) {
    for (Rgb& c : light) {
      for (float* channel : {&c.r, &c.g, &c.b}) {
        if (std::abs(*channel) < 0x1p-100f) *channel = 0;
      }
    }
  }

  float weight(std::size_t i) const {
    if (!options_.weights.empty()) return options_.weights[i];
    return std::sqrt(static_cast<float>(layout_.area(layout_.band_of(static_cast<int>(i)))));
  }

  bool is_reset_nearer(const std::vector<Rgb>& target, int b) const {
    double keep = 0, reset = 0;
    bool lit = false;
    for (int j = layout_.band(b).begin; j < layout_.band(b).end; ++j) {
      const auto i = static_cast<std::size_t>(j);
      keep += static_cast<double>(weight(i) * l1_norm(target[i] - shown_[i]));
      reset += static_cast<double>(weight(i) * l1_norm(target[i]));
      lit |= !(shown_[i] == Rgb{});
    }
    return lit && !(keep < reset);
  }

  // The budget's worth of coefficients that are farthest from what is kept, ties to the smaller
  // index; none that is right.
  std::vector<std::size_t> largest(const std::vector<Rgb>& target,
                                   const std::vector<Rgb>& kept) const {
    std::vector<float> key(target.size());
    for (std::size_t i = 0; i < key.size(); ++i) key[i] = weight(i) * l1_norm(target[i] - kept[i]);
    std::vector<std::size_t> order(key.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return key[a] > key[b]; });
    std::vector<std::size_t> out;
    for (const std::size_t i : order) {
      if (static_cast<int>(out.size()) == options_.wavelets || !(key[i] > 0)) break;
      out.push_back(i);
    }
    return out;
  }

  void show(LightingUpdate& update, std::size_t i, const Rgb& value) {
    const RgbD delta = RgbD(value) - handed_out_[i];
    update.deltas.push_back({static_cast<int>(i), delta});
    handed_out_[i] += delta;
    shown_[i] = value;
  }

  HaarLayout layout_;
  LightingOptions options_;
  std::vector<Rgb> shown_;
  std::vector<RgbD> handed_out_;
};

}  // namespace haarlight::hard
