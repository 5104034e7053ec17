// Decides, applies, finishes, measures.

#include "prt/frame_relighter.h"

#include <chrono>
#include <utility>
#include <vector>

#include "core/image_metrics.h"

namespace haarlight {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

LightingOptions with_weights(LightingOptions lighting, WaveletWeight weight,
                             const Transport& transport) {
  lighting.weights = wavelet_weights(weight, transport);
  return lighting;
}

}  // namespace

FrameRelighter::FrameRelighter(const Transport& transport, LightingOptions lighting,
                               WaveletWeight weight, RelighterFactory make)
    : tracker_(transport.layout(), with_weights(std::move(lighting), weight, transport)),
      weight_(weight),
      make_(std::move(make)),
      relighter_(make_relighter(make_, transport)) {
  relighter_->expect_resets(tracker_.options().method == LightingMethod::pbi);
}

void FrameRelighter::set_options(const LightingOptions& lighting, WaveletWeight weight) {
  const LightingOptions& now = tracker_.options();
  if (lighting.method == now.method && lighting.wavelets == now.wavelets &&
      lighting.band_choice == now.band_choice && weight == weight_) {
    return;
  }
  if (weight == weight_) {
    LightingOptions options = now;
    options.method = lighting.method;
    options.wavelets = lighting.wavelets;
    options.band_choice = lighting.band_choice;
    tracker_.set_options(std::move(options));
  } else {
    tracker_.set_options(with_weights(lighting, weight, transport()));
    weight_ = weight;
  }
  relighter_->expect_resets(tracker_.options().method == LightingMethod::pbi);
}

void FrameRelighter::compare_with_reference(bool compare) {
  compare_ = compare;
  if (!compare || exact_) return;
  LightingOptions exact;
  exact.method = LightingMethod::reference;
  exact_.emplace(
      Exact{LightingTracker(transport().layout(), exact), make_relighter(make_, transport())});
  exact_->relighter->set_exact(true);
  exact_->relighter->expect_resets(false);
}

const Image* FrameRelighter::reference() const {
  return compare_ && exact_ ? &exact_->relighter->picture() : nullptr;
}

// A black target under the reference method takes everything back, and leaves sums of exactly 0.
void FrameRelighter::go_dark() {
  const LightingOptions options = tracker_.options();
  LightingOptions all = options;
  all.method = LightingMethod::reference;
  tracker_.set_options(std::move(all));
  relighter_->set_exact(true);
  relighter_->apply(
      tracker_.advance(std::vector<Rgb>(static_cast<std::size_t>(transport().layout().size()))));
  tracker_.set_options(options);
}

const FrameMetrics& FrameRelighter::relight(std::span<const Rgb> target, FrameStart start,
                                            int frame) {
  if (start == FrameStart::dark) go_dark();
  const HaarLayout& layout = transport().layout();
  const LightingOptions& lighting = tracker_.options();

  // Decide which wavelets change, stream their columns, make the picture.
  const Clock::time_point begin = Clock::now();
  const LightingUpdate& update =
      start == FrameStart::exact ? tracker_.start_exact(target) : tracker_.advance(target);
  const Clock::time_point decided = Clock::now();
  relighter_->set_exact(start == FrameStart::exact || lighting.method == LightingMethod::reference);
  const RelightStats stats = relighter_->apply(update);
  const Clock::time_point end = Clock::now();
  update_ = &update;

  metrics_.frame = frame;
  metrics_.method = lighting.method;
  metrics_.wavelets =
      lighting.method == LightingMethod::reference ? layout.size() : lighting.wavelets;
  metrics_.weight = weight_;
  metrics_.updates = static_cast<int>(update.deltas.size());
  metrics_.resets.clear();
  for (int b = 0; b < layout.band_count(); ++b) {
    metrics_.resets += update.reset[static_cast<std::size_t>(b)] ? '1' : '0';
  }
  metrics_.lighting_error = lighting_error(layout, tracker_.shown(), target);
  metrics_.update_ms = milliseconds(begin, decided);
  metrics_.apply_ms = stats.apply_ms;
  metrics_.finish_ms = stats.finish_ms;
  metrics_.total_ms = milliseconds(begin, end);
  metrics_.bytes = stats.apply.transport_bytes + stats.apply.sum_bytes;

  // The same frame under the exact lighting. Both pictures are black where the scene is not, so
  // sums over all pixels are sums over the scene's.
  metrics_.image_rel_rmse.reset();
  metrics_.image_max_abs.reset();
  if (compare_ && exact_) {
    exact_->relighter->set_camera(relighter_->camera());
    exact_->relighter->apply(exact_->tracker.advance(target));
    const ImageDifference difference =
        compare_images(relighter_->picture(), exact_->relighter->picture());
    metrics_.image_rel_rmse = difference.relative_rmse;
    metrics_.image_max_abs = difference.max_abs;
  }
  return metrics_;
}

}  // namespace haarlight
