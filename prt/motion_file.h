// Recorded motions: what the light did and how each frame went about it, as JSON. docs/viewer.md
// gives the format.

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/camera.h"
#include "prt/frame_relighter.h"
#include "prt/light_rig.h"

namespace haarlight {

/// All that decides a frame's numbers, given what was shown before.
struct RecordedFrame {
  LightState light;
  LightingMethod method = LightingMethod::pbi;
  int wavelets = 30;  ///< the budget that was used, also where it was given in milliseconds; >= 1
  WaveletWeight weight = WaveletWeight::area;
  FrameStart start = FrameStart::advance;
  FrameCourse course;            ///< of a budget in milliseconds
  std::optional<Camera> camera;  ///< of a mesh; none: the file's
  bool operator==(const RecordedFrame&) const = default;
};

struct MotionRecording {
  std::vector<std::filesystem::path> environments;  ///< at least one; by LightState::from and to
  std::vector<RecordedFrame> frames;                ///< at least one
};

/// Reads a recording. Environments that are not absolute are taken from the file's folder. Throws
/// Error{missing} if there is no such file, Error{io} if the system refuses, Error{format} naming
/// the frame and the key of what is wrong.
MotionRecording load_motion_file(const std::filesystem::path& file);

/// The same from text; `name` is used in messages.
MotionRecording parse_motion(const std::string& text, const std::string& name);

/// As JSON; numbers come back as the same bits. A frame says only what it changes.
std::string motion_text(const MotionRecording& recording);

/// Writes it, whole or not at all. Throws Error{invalid_argument} for a recording without frames,
/// Error{io} if the system refuses.
void save_motion_file(const std::filesystem::path& file, const MotionRecording& recording);

}  // namespace haarlight
