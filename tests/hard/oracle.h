// The slow, plainly right product T * light in long double, and running sums that are held against
// it by bound A of the hard cases: |B - T L~| <= (K + 2n) v S_p.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "prt/apply_kernel.h"
#include "prt/lighting_tracker.h"
#include "prt/row_sums.h"
#include "tests/prt/fixtures.h"

namespace haarlight::hard {

/// T * light and S = sum |T| |light|, [output * 3 + channel].
struct Product {
  std::vector<double> value, magnitude;
};

/// `t` is fixtures::dense(): [output * 3 + channel][coefficient].
inline Product multiply(const std::vector<double>& t, std::span<const Rgb> light) {
  const std::size_t size = light.size(), rows = t.size() / size;
  Product out{std::vector<double>(rows), std::vector<double>(rows)};
  for (std::size_t row = 0; row < rows; ++row) {
    long double sum = 0, magnitude = 0;
    for (std::size_t j = 0; j < size; ++j) {
      const float l = row % 3 == 0 ? light[j].r : row % 3 == 1 ? light[j].g : light[j].b;
      const long double term = static_cast<long double>(t[row * size + j]) * l;
      sum += term;
      magnitude += std::abs(term);
    }
    out.value[row] = static_cast<double>(sum);
    out.magnitude[row] = static_cast<double>(magnitude);
  }
  return out;
}

/// Totals with colours applied, as outputs.
inline std::vector<double> outputs(const RowSums& sums) {
  const Transport& t = sums.transport();
  std::vector<double> out(3 * t.info().output_count());
  for (std::size_t row = 0; row < t.row_output().size(); ++row) {
    if (t.row_output()[row] == kNoOutput) continue;
    const std::size_t block = row / kBlockRows, r = row % kBlockRows;
    const double* total = sums.totals().data() + block * kBlockTotals;
    const RgbD color(t.row_color()[row]);
    const std::size_t to = 3 * std::size_t{t.row_output()[row]};
    out[to] = color.r * total[r];
    out[to + 1] = color.g * total[kBlockRows + r];
    out[to + 2] = color.b * total[2 * kBlockRows + r];
  }
  return out;
}

/// A tracker and the sums that follow it, with all that bound A needs.
class Chain {
 public:
  Chain(const fixtures::SmallTransport& small, const LightingOptions& options)
      : Chain(build_transport(small.info, small.tiles, small.thresholds), fixtures::dense(small),
              options) {}
  Chain(const Transport& transport, std::vector<double> dense, const LightingOptions& options)
      : tracker(transport.layout(), options), sums(transport), dense_(std::move(dense)) {
    sums.expect_resets(options.method == LightingMethod::pbi);
    peak_.assign(3 * transport.info().output_count(), 0);
  }

  void start(std::span<const Rgb> target) { apply(tracker.start_exact(target)); }
  void advance(std::span<const Rgb> target) { apply(tracker.advance(target)); }
  void set(const LightingOptions& options) {
    tracker.set_options(options);
    sums.expect_resets(options.method == LightingMethod::pbi);
  }
  /// Every column streamed adds to each row once, a kept picture taken back once more.
  void apply(const LightingUpdate& update) {
    const ApplyStats stats = sums.apply(update);
    updates_ += stats.columns + tracker.layout().band_count();
  }

  struct Drift {
    double largest = 0;     ///< |B - T L~|
    double of_peak = 0;     ///< largest |B - T L~| / S_p
    double of_bound = 0;    ///< largest |B - T L~| over bound A
    double of_picture = 0;  ///< largest |B - T L~| over the largest |T L~|
  };
  /// Also raises S_p to the lighting shown: call it wherever the light was strong.
  Drift drift() {
    const Product right = multiply(dense_, tracker.shown());
    const std::vector<double> found = outputs(sums);
    Drift d;
    double picture = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      peak_[i] = std::max(peak_[i], right.magnitude[i]);
      const double error = std::abs(found[i] - right.value[i]);
      d.largest = std::max(d.largest, error);
      picture = std::max(picture, std::abs(right.value[i]));
      if (peak_[i] == 0) {
        if (error > 0) d.of_peak = d.of_bound = HUGE_VAL;
        continue;
      }
      d.of_peak = std::max(d.of_peak, error / peak_[i]);
      const double bound = (updates_ + 2.0 * tracker.layout().size()) * 0x1p-53 * peak_[i];
      d.of_bound = std::max(d.of_bound, error / bound);
    }
    d.of_picture = picture > 0 ? d.largest / picture : 0;
    return d;
  }

  LightingTracker tracker;
  RowSums sums;

 private:
  std::vector<double> dense_, peak_;
  double updates_ = 0;  // K
};

inline LightingOptions options_of(LightingMethod method, int wavelets) {
  LightingOptions options;
  options.method = method;
  options.wavelets = wavelets;
  return options;
}

inline const LightingMethod kMethods[] = {LightingMethod::nwa, LightingMethod::bi,
                                          LightingMethod::pbi, LightingMethod::reference};

/// A transport of 16x16 pixels, faces of 8x8, entries as random as can be.
inline fixtures::SmallTransport small_case(std::uint64_t seed) {
  return fixtures::small_transport(8, 16, 16, seed);
}

/// Coefficients of texels given one by one.
template <typename TexelValue>
std::vector<Rgb> lighting_of(const HaarLayout& layout, const TexelValue& value) {
  std::vector<Rgb> texels(static_cast<std::size_t>(layout.size())), out(texels.size());
  for (std::size_t k = 0; k < texels.size(); ++k) texels[k] = value(k);
  haar_forward(layout, std::span<const Rgb>(texels), out);
  return out;
}

}  // namespace haarlight::hard
