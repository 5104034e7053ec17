// Runs a sequence: what the light does, frame by frame, through a frame relighter.

#include "prt/relight_sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "core/error.h"
#include "prt/light_rig.h"

namespace haarlight {
namespace {

void hand_out(const FrameRelighter& relighter, const FrameMetrics& metrics,
              std::span<const Rgb> target, int frames, const FrameDone& frame_done) {
  if (!frame_done) return;
  const SceneView view = relighter.view();
  if (!frame_done(
          SequenceFrame{metrics, relighter.picture(), relighter.reference(), target, view})) {
    throw Error(ErrorKind::cancelled,
                fmt::format("relighting stopped after {} of {} frames", metrics.frame + 1, frames));
  }
}

}  // namespace

Camera sequence_camera(const Transport& transport, const SequenceOptions& options, int frame) {
  Camera camera = transport.info().camera;
  if (!transport.info().mesh) {
    if (options.orbit_degrees != 0 || options.width != 0 || options.height != 0) {
      throw Error(ErrorKind::invalid_argument,
                  "an orbit or a size is for the transport of a mesh; this one is of one view");
    }
    return camera;
  }
  if (options.width > 0) camera.width = options.width;
  if (options.height > 0) camera.height = options.height;
  const double t = static_cast<double>(std::min(frame, options.motion.stop)) / options.motion.stop;
  return turned_about(camera, bounding_sphere(*transport.info().mesh).center,
                      options.orbit_degrees * t * kPi / 180);
}

void relight_sequence(const Transport& transport, const Environment& from, const Environment* to,
                      const SequenceOptions& options, const FrameDone& frame_done,
                      const RelighterFactory& make) {
  if (options.frames < 1) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("frames is {}, expected at least 1", options.frames));
  }
  Motion motion(options.motion, transport.layout(), from, to);
  FrameRelighter relighter(transport, options.lighting, options.weight, make);
  relighter.compare_with_reference(options.against_reference);
  relighter.judge_errors(options.judge_errors);
  relighter.set_budget(options.budget);
  for (int frame = 0; frame < options.frames; ++frame) {
    const std::span<const Rgb> target = motion.coefficients(frame);
    const FrameStart start =
        frame == 0 && !options.from_dark ? FrameStart::exact : FrameStart::advance;
    relighter.set_camera(sequence_camera(transport, options, frame));
    hand_out(relighter, relighter.relight(target, start, frame), target, options.frames,
             frame_done);
  }
}

void relight_recording(const Transport& transport, std::span<const Environment> environments,
                       const MotionRecording& recording, bool against_reference,
                       const FrameDone& frame_done, const RelighterFactory& make,
                       bool judge_errors) {
  if (environments.size() < recording.environments.size() || recording.frames.empty()) {
    throw Error(
        ErrorKind::invalid_argument,
        fmt::format("{} environments and {} frames, expected {} environments as the "
                    "recording and at least one frame",
                    environments.size(), recording.frames.size(), recording.environments.size()));
  }
  LightRig rig(transport.layout());
  for (std::size_t i = 0; i < environments.size(); ++i) rig.set_environment(i, environments[i]);
  const auto options_of = [](const RecordedFrame& frame) {
    LightingOptions options;
    options.method = frame.method;
    options.wavelets = frame.wavelets;
    return options;
  };
  const RecordedFrame& first = recording.frames.front();
  FrameRelighter relighter(transport, options_of(first), first.weight, make);
  relighter.compare_with_reference(against_reference);
  relighter.judge_errors(judge_errors);
  const int frames = static_cast<int>(recording.frames.size());
  for (int i = 0; i < frames; ++i) {
    const RecordedFrame& frame = recording.frames[static_cast<std::size_t>(i)];
    const std::span<const Rgb> target = rig.coefficients(frame.light);
    relighter.set_options(options_of(frame), frame.weight);
    if (frame.camera) relighter.set_camera(*frame.camera);
    if (frame.course.timed) relighter.repeat(frame.course);
    hand_out(relighter, relighter.relight(target, frame.start, i), target, frames, frame_done);
  }
}

}  // namespace haarlight
