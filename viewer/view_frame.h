// A finished frame, as the session hands it to whatever shows it.

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "prt/frame_relighter.h"
#include "prt/light_rig.h"
#include "prt/transport.h"
#include "wavelet/cubemap.h"
#include "wavelet/environment.h"

namespace haarlight::viewer {

/// A transport that is open; never changes, so that frames can share it.
struct OpenScene {
  std::filesystem::path file;
  Transport transport;
};

/// An environment that is open, with a small lat-long picture of it.
struct OpenLight {
  std::filesystem::path file;
  Environment environment;
  Image preview;  ///< lat-long, linear radiance
};

/// Its vectors keep their memory from frame to frame.
struct ViewFrame {
  std::uint64_t number = 0;  ///< counts frames; 0: nothing was relit yet
  std::shared_ptr<const OpenScene> scene;
  std::shared_ptr<const OpenLight> from, to;  ///< what light.blend is between
  LightState light;
  double exact_exposure_ev = 0;  ///< a good exposure for the scene under its first light

  Image picture;    ///< radiance of the scene alone
  Image reference;  ///< the same under the exact lighting, if `compared`
  bool compared = false;
  Camera camera;
  std::vector<float> coverage;    ///< share of each pixel that the scene covers
  std::uint64_t view_number = 0;  ///< another one whenever camera or coverage changed

  FrameMetrics metrics;
  double light_ms = 0;  ///< making the target lighting
  int budget = 0;       ///< wavelets that the frame was allowed
  int band_count = 0;
  std::array<int, HaarLayout::kMaxBands> band_updates{};
  BandMask resets;

  bool converged = false;  ///< the picture is that of the exact lighting
  double position = 0;     ///< of the motion, frames
  int recorded = 0;        ///< frames recorded so far
  bool recording = false;

  /// With ViewSettings::show_lighting: the exact and the shown lighting, and per texel how many of
  /// this frame's wavelets lie over it.
  bool lighting_filled = false;
  Cubemap target = Cubemap(0), shown = Cubemap(0);
  std::vector<std::uint16_t> touched;
};

}  // namespace haarlight::viewer
