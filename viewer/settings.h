// What a person has set: plain values, copied from the window to the session whole.

#pragma once

#include <array>
#include <filesystem>
#include <variant>

#include "prt/disc_light.h"
#include "prt/frame_relighter.h"
#include "prt/motion.h"

namespace haarlight::viewer {

inline constexpr int kMaxDiscs = 8;
inline constexpr int kMaxWavelets = 1 << 20;

/// Holds no memory of its own, so that handing it over every frame touches no heap.
struct ViewSettings {
  LightingMethod method = LightingMethod::pbi;
  BudgetKind budget = BudgetKind::wavelets;
  int wavelets = 30;        ///< [1, kMaxWavelets]
  double milliseconds = 8;  ///< > 0; of deciding, applying and finishing together
  double error = 0.01;  ///< > 0; estimated, relative, of the picture; by wavelets where there is
                        ///< no estimate
  WaveletWeight weight = WaveletWeight::area;

  double yaw = 0, pitch = 0;  ///< radians: the light about +Y after about +X, by hand
  double background = 1;      ///< factor of the environment, [0, 1e6]
  std::array<DiscLight, kMaxDiscs> discs;
  int disc_count = 0;

  MotionKind motion = MotionKind::rotate;
  double degrees = 90;  ///< size of the motion
  double speed = 1;     ///< frames of the motion in a sixtieth of a second, >= 0
  bool loop = true;     ///< begin again when the motion has rested for a second
  bool playing = false;

  // From where a mesh is seen; a picture's view is fixed.
  double orbit = 0,
         elevation = 0;       ///< radians, right-handed about +Y, and up, from the file's view
  double closer = 0;          ///< halvings of the distance to the middle, [-6, 6]
  double right = 0, up = 0;   ///< of the middle, in heights of the picture
  int width = 0, height = 0;  ///< pixels; 0: the file's

  bool compare = false;        ///< relight exactly too
  bool clusters = false;       ///< show a compressed transport's clusters in colours instead
  bool show_lighting = false;  ///< fill ViewFrame::target, shown and touched

  bool operator==(const ViewSettings&) const = default;
};

// Things that happen once, in order.
struct OpenTransport {
  std::filesystem::path file;
};
/// Becomes the second environment, and is blended to; the first one when there is none.
struct OpenEnvironment {
  std::filesystem::path file;
  double fade = 0;  ///< sixtieths of a second until only it is seen
};
struct SetBlend {
  double blend = 0;  ///< [0, 1]
};
struct Restart {
  FrameStart start = FrameStart::dark;  ///< of the next frame
};
struct Rewind {};  ///< the motion to its beginning
struct Step {};    ///< one frame, also while paused
struct StartRecording {};
struct StopRecording {
  std::filesystem::path file;
};
struct SavePicture {
  std::filesystem::path file;  ///< .exr: radiance with its background
};
using ViewAction = std::variant<OpenTransport, OpenEnvironment, SetBlend, Restart, Rewind, Step,
                                StartRecording, StopRecording, SavePicture>;

}  // namespace haarlight::viewer
