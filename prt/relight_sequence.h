// The whole way through, frame by frame: motion -> tracker -> relighter -> picture and its metrics.

#pragma once

#include <functional>
#include <span>

#include "core/camera.h"
#include "core/image.h"
#include "prt/frame_relighter.h"
#include "prt/lighting_tracker.h"
#include "prt/motion.h"
#include "prt/motion_file.h"
#include "prt/transport.h"
#include "wavelet/environment.h"

namespace haarlight {

struct SequenceOptions {
  MotionOptions motion;
  int frames = 130;          ///< >= 1; the light rests from frame motion.stop on
  LightingOptions lighting;  ///< its `weights` are ignored: `weight` says which
  WaveletWeight weight = WaveletWeight::area;
  FrameBudget budget;        ///< in time or error instead of lighting.wavelets
  bool judge_errors = true;  ///< estimate errors, where that can be; see FrameMetrics
  bool from_dark = false;    ///< start with nothing shown; else frame 0 is exact (Overbeck 2006, 3)
  double orbit_degrees = 0;  ///< of a mesh: the camera goes round the vertical axis through the
                             ///< mesh's middle by orbit_degrees * t, t = min(frame, stop) / stop
  int width = 0, height = 0;       ///< of a mesh: size of the picture; 0: the file's
  bool against_reference = false;  ///< follow the exact lighting too and measure each picture
};

/// A frame as it is handed out; everything in it is valid during the call only.
struct SequenceFrame {
  const FrameMetrics& metrics;
  const Image& picture;    ///< radiance of the scene alone, nothing where it is not
  const Image* reference;  ///< the same under the exact lighting; null without against_reference
  std::span<const Rgb> target;  ///< the exact lighting, coefficients
  const SceneView& view;        ///< the picture's camera and what of it the scene covers
};

/// Called after every frame, in order; return false to stop, and relight_sequence throws
/// Error{cancelled}. Its own time is in no metric.
using FrameDone = std::function<bool(const SequenceFrame& frame)>;

/// The view of a frame: the file's, of a mesh at the size and place on the orbit that the options
/// say. Throws Error{invalid_argument} for an orbit or a size of a picture's transport.
Camera sequence_camera(const Transport& transport, const SequenceOptions& options, int frame);

/// Runs options.frames frames. `to` is the second environment of MotionKind::blend; `make` makes
/// the renderer. Metrics but for times are the same bits on any number of threads. Throws
/// Error{invalid_argument} for options out of range or a blend without `to`.
void relight_sequence(const Transport& transport, const Environment& from, const Environment* to,
                      const SequenceOptions& options, const FrameDone& frame_done,
                      const RelighterFactory& make = {});

/// Replays a recording, frame by frame, with the numbers it had. `environments` are those it names,
/// in its order. A mesh is drawn from
/// where it was seen. Throws Error{invalid_argument} when there are
/// not that many.
void relight_recording(const Transport& transport, std::span<const Environment> environments,
                       const MotionRecording& recording, bool against_reference,
                       const FrameDone& frame_done, const RelighterFactory& make = {},
                       bool judge_errors = true);

}  // namespace haarlight
