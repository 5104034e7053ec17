// Runs a sequence: decides, applies, finishes, measures.

#include "prt/relight_sequence.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <utility>

#include "core/error.h"
#include "core/image_metrics.h"
#include "prt/image_relighter.h"

namespace haarlight {
namespace {

constexpr std::array<std::pair<WaveletWeight, std::string_view>, 3> kWeightNames{{
    {WaveletWeight::none, "none"},
    {WaveletWeight::area, "area"},
    {WaveletWeight::transport, "transport"},
}};

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

std::string reset_digits(const HaarLayout& layout, const BandMask& reset) {
  std::string digits;
  for (int b = 0; b < layout.band_count(); ++b) {
    digits += reset[static_cast<std::size_t>(b)] ? '1' : '0';
  }
  return digits;
}

}  // namespace

std::optional<WaveletWeight> wavelet_weight_from_name(std::string_view name) {
  for (const auto& [weight, word] : kWeightNames) {
    if (word == name) return weight;
  }
  return std::nullopt;
}

std::string wavelet_weight_name(WaveletWeight weight) {
  return std::string(kWeightNames[static_cast<std::size_t>(weight)].second);
}

std::vector<float> wavelet_weights(WaveletWeight weight, const Transport& transport) {
  const HaarLayout& layout = transport.layout();
  switch (weight) {
    case WaveletWeight::area:
      return area_weights(layout);
    case WaveletWeight::transport: {
      const std::span<const float> norms = transport.column_norms();
      return {norms.begin(), norms.end()};
    }
    case WaveletWeight::none:
      break;
  }
  return std::vector<float>(static_cast<std::size_t>(layout.size()), 1.0f);
}

void relight_sequence(const Transport& transport, const Environment& from, const Environment* to,
                      const SequenceOptions& options, const FrameDone& frame_done) {
  if (options.frames < 1) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("frames is {}, expected at least 1", options.frames));
  }
  const HaarLayout& layout = transport.layout();
  LightingOptions lighting = options.lighting;
  lighting.weights = wavelet_weights(options.weight, transport);
  LightingOptions exact = lighting;
  exact.method = LightingMethod::reference;

  Motion motion(options.motion, layout, from, to);
  LightingTracker tracker(layout, lighting);
  ImageRelighter relighter(transport);
  relighter.expect_resets(lighting.method == LightingMethod::pbi);
  std::optional<LightingTracker> exact_tracker;
  std::optional<ImageRelighter> exact_relighter;
  if (options.against_reference) {
    exact_tracker.emplace(layout, exact);
    exact_relighter.emplace(transport);
    exact_relighter->expect_resets(false);
  }

  for (int frame = 0; frame < options.frames; ++frame) {
    const std::span<const Rgb> target = motion.coefficients(frame);

    // Decide which wavelets change, stream their columns, make the picture.
    const Clock::time_point begin = Clock::now();
    const LightingUpdate& update =
        frame == 0 && !options.from_dark ? tracker.start_exact(target) : tracker.advance(target);
    const Clock::time_point decided = Clock::now();
    const RelightStats stats = relighter.apply(update);
    const Clock::time_point end = Clock::now();

    FrameMetrics metrics;
    metrics.frame = frame;
    metrics.method = lighting.method;
    metrics.wavelets =
        lighting.method == LightingMethod::reference ? layout.size() : lighting.wavelets;
    metrics.weight = options.weight;
    metrics.updates = static_cast<int>(update.deltas.size());
    metrics.resets = reset_digits(layout, update.reset);
    metrics.lighting_error = lighting_error(layout, tracker.shown(), target);
    metrics.update_ms = milliseconds(begin, decided);
    metrics.apply_ms = stats.apply_ms;
    metrics.finish_ms = stats.finish_ms;
    metrics.total_ms = milliseconds(begin, end);
    metrics.bytes = stats.apply.transport_bytes + stats.apply.sum_bytes;

    // The same frame under the exact lighting. Both pictures are black where the scene is not, so
    // sums over all pixels are sums over the scene's.
    if (options.against_reference) {
      exact_relighter->apply(exact_tracker->advance(target));
      const ImageDifference difference =
          compare_images(relighter.picture(), exact_relighter->picture());
      metrics.image_rel_rmse = difference.relative_rmse;
      metrics.image_max_abs = difference.max_abs;
    }

    const Image* reference = options.against_reference ? &exact_relighter->picture() : nullptr;
    if (frame_done && !frame_done(SequenceFrame{metrics, relighter.picture(), reference, target})) {
      throw Error(ErrorKind::cancelled, fmt::format("relighting stopped after {} of {} frames",
                                                    frame + 1, options.frames));
    }
  }
}

}  // namespace haarlight
