// The whole way through, frame by frame: motion -> tracker -> relighter -> picture and its metrics.

#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/image.h"
#include "prt/lighting_tracker.h"
#include "prt/motion.h"
#include "prt/transport.h"
#include "wavelet/environment.h"

namespace haarlight {

/// What makes one wavelet more worth an update than another, beside the size of its change.
enum class WaveletWeight {
  none,       ///< nothing: the orthonormal coefficient itself
  area,       ///< area_weights(): area of the wavelet times its unnormalised coefficient (Ng 2003)
  transport,  ///< Transport::column_norms(): the change of the picture
};

std::optional<WaveletWeight> wavelet_weight_from_name(std::string_view name);
std::string wavelet_weight_name(WaveletWeight weight);

/// LightingOptions::weights for a choice; layout.size() of them.
std::vector<float> wavelet_weights(WaveletWeight weight, const Transport& transport);

struct SequenceOptions {
  MotionOptions motion;
  int frames = 130;          ///< >= 1; the light rests from frame motion.stop on
  LightingOptions lighting;  ///< its `weights` are ignored: `weight` says which
  WaveletWeight weight = WaveletWeight::area;
  bool from_dark = false;  ///< start with nothing shown; else frame 0 is exact (Overbeck 2006, 3)
  bool against_reference = false;  ///< follow the exact lighting too and measure each picture
};

/// What a frame cost and how near it came. One row of the metrics file.
struct FrameMetrics {
  int frame = 0;
  LightingMethod method = LightingMethod::pbi;
  int wavelets = 0;  ///< budget of an update; all coefficients for the reference method
  WaveletWeight weight = WaveletWeight::area;
  int updates = 0;            ///< wavelets changed
  std::string resets;         ///< one digit a band, coarsest first; 1: the band was reset
  double lighting_error = 0;  ///< lighting_error() of what is shown against the target
  /// Over the pixels of the scene, against the picture under the exact lighting: relative RMSE and
  /// the largest difference in any channel (W m^-2 sr^-1). Only with against_reference.
  std::optional<double> image_rel_rmse, image_max_abs;
  double update_ms = 0;     ///< deciding the update
  double apply_ms = 0;      ///< streaming columns into sums
  double finish_ms = 0;     ///< sums to pixels
  double total_ms = 0;      ///< wall time from the target's coefficients to the picture
  std::uint64_t bytes = 0;  ///< of transport and of sums moved
};

/// A frame as it is handed out; everything in it is valid during the call only.
struct SequenceFrame {
  const FrameMetrics& metrics;
  const Image& picture;    ///< radiance of the scene alone, nothing where it is not
  const Image* reference;  ///< the same under the exact lighting; null without against_reference
  std::span<const Rgb> target;  ///< the exact lighting, coefficients
};

/// Called after every frame, in order; return false to stop, and relight_sequence throws
/// Error{cancelled}. Its own time is in no metric.
using FrameDone = std::function<bool(const SequenceFrame& frame)>;

/// Runs options.frames frames. `to` is the second environment of MotionKind::blend. Metrics but for
/// times are the same bits on any number of threads. Throws Error{invalid_argument} for options out
/// of range or a blend without `to`.
void relight_sequence(const Transport& transport, const Environment& from, const Environment* to,
                      const SequenceOptions& options, const FrameDone& frame_done);

}  // namespace haarlight
