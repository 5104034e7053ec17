// One frame: decide which wavelets change, apply them, measure. Beside it, on demand, the same
// frame under the exact lighting.

#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "core/image.h"
#include "prt/error_judge.h"
#include "prt/frame_budget.h"
#include "prt/frame_course.h"
#include "prt/lighting_tracker.h"
#include "prt/relighter.h"
#include "prt/scene_view.h"
#include "prt/time_budget.h"
#include "prt/transport.h"
#include "prt/wavelet_weight.h"

namespace haarlight {

/// What a frame did and how long it took: a row of the metrics file.
struct FrameMetrics {
  int frame = 0;
  LightingMethod method = LightingMethod::pbi;
  int wavelets = 0;  ///< most that an update could hold, by number; of a budget in time or error,
                     ///< what it came to; all coefficients for the reference method
  WaveletWeight weight = WaveletWeight::area;
  int updates = 0;            ///< wavelets changed
  std::string resets;         ///< one digit a band, coarsest first; 1: the band was reset
  double lighting_error = 0;  ///< lighting_error() of what is shown against the target
  /// Over the pixels of the scene, against the picture under the exact lighting: relative RMSE and
  /// the largest difference in any channel (W m^-2 sr^-1). Only with against_reference.
  std::optional<double> image_rel_rmse, image_max_abs;
  double update_ms = 0;     ///< deciding the update
  double apply_ms = 0;      ///< streaming columns into sums
  double finish_ms = 0;     ///< sums to pixels, drawing of a mesh included
  double total_ms = 0;      ///< wall time from the target's coefficients to the picture
  std::uint64_t bytes = 0;  ///< of transport and of sums moved
  /// Relative RMS of the picture's change since the frame before against that of the exact picture:
  /// || (P - P') - (R - R') || / || R ||. 0 in a first frame. Only with against_reference.
  std::optional<double> flicker;
  /// What an ErrorJudge says of image_rel_rmse without a reference. Not for every renderer.
  std::optional<double> error_estimate, error_bound;
  /// What a budget in milliseconds decided of the frame by the clock, for FrameRelighter::repeat().
  FrameCourse course;
  /// What compressing the transport cost, as its file states: relative RMS of the picture under the
  /// worst of the lightings it was measured under. None where the file does not say.
  std::optional<double> transport_error;
};

/// How a frame goes about its target.
enum class FrameStart {
  advance,  ///< from what is shown, by the method
  exact,    ///< show the target in full, whatever the method (Overbeck 2006, section 3)
  dark,     ///< forget what is shown, then advance
};

/// picture() is that of T * tracker().shown() after every frame; of a renderer that follows step by
/// step, once settled() (see Relighter).
class FrameRelighter {
 public:
  /// `lighting.weights` are ignored: `weight` says which. `make` makes the renderer.
  FrameRelighter(const Transport& transport, LightingOptions lighting, WaveletWeight weight,
                 RelighterFactory make = {});

  /// From the next frame on. Cheap when nothing changed. Throws as LightingTracker::set_options.
  void set_options(const LightingOptions& lighting, WaveletWeight weight);
  /// Whether frames are also relit exactly. The first such frame after a pause costs a full one.
  void compare_with_reference(bool compare);
  /// Whether frames say error_estimate and error_bound, where that can be. Not before it is asked
  /// for is the transport read for it. Its time is in no metric.
  void judge_errors(bool judge) { judge_ = judge; }
  /// Whether there is an estimate for this renderer.
  bool can_judge() const;
  /// What ends updates from the next frame on. Under an error a renderer that follows step by step
  /// follows in full, since no wavelet makes good for what it has not followed. Throws
  /// Error{invalid_argument} for a value out of range, or an error where none can be estimated.
  void set_budget(const FrameBudget& budget);

  /// The next frame goes as one of `course` went, with the wavelets of the options, whatever the
  /// budget: the same picture, bit for bit.
  void repeat(const FrameCourse& course) { repeat_ = course; }

  /// Relights towards `target`, layout.size() coefficients, valid until the next call; the frame's
  /// number is the caller's. Throws as LightingTracker::advance, and then changes nothing.
  const FrameMetrics& relight(std::span<const Rgb> target, FrameStart start, int frame);

  /// From where a mesh is drawn from the next frame on; see Relighter::set_camera.
  void set_camera(const Camera& camera) { relighter_->set_camera(camera); }

  const Image& picture() const { return relighter_->picture(); }
  /// What the picture looks at; valid until the next frame.
  SceneView view() const { return {relighter_->camera(), relighter_->coverage()}; }
  /// The same under the exact lighting; null unless asked for.
  const Image* reference() const;
  const LightingTracker& tracker() const { return tracker_; }
  /// Whether an empty update would leave the picture as it is.
  bool settled() const { return relighter_->settled(); }
  const LightingUpdate& update() const { return update_; }
  const Transport& transport() const { return relighter_->transport(); }

 private:
  void go_dark();
  void start_clock(std::chrono::steady_clock::time_point begin);
  RelightStats go(std::span<const Rgb> target, FrameStart start, BudgetKind kind,
                  const std::optional<FrameCourse>& repeated);
  ErrorJudge& estimator();
  void know_view();
  void judge(std::span<const Rgb> target);
  void follow_flicker();

  LightingTracker tracker_;
  WaveletWeight weight_;
  RelighterFactory make_;
  std::unique_ptr<Relighter> relighter_;
  struct Exact {
    LightingTracker tracker;
    std::unique_ptr<Relighter> relighter;
  };
  std::optional<Exact> exact_;
  bool compare_ = false;
  FrameBudget budget_;
  std::optional<FrameCourse> repeat_;
  std::optional<TimeBudget> time_;      // of the last frames; made when first asked for
  std::unique_ptr<ErrorJudge> errors_;  // likewise
  bool judge_ = false;
  std::optional<Camera> judged_from_;  // the camera that errors_ knows
  std::vector<float> vertex_weights_;
  std::vector<double> pending_;
  std::vector<double> reset_bytes_;
  std::optional<double> transport_error_;
  bool compared_before_ = false;
  Image picture_before_, reference_before_;  // of the last frame that was compared, or empty
  LightingUpdate update_;                    // of the frame, all parts together
  FrameMetrics metrics_;
};

}  // namespace haarlight
