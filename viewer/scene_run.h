// A scene that moves in haarlight-view: with a window, and without.

#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "prt/tonemap.h"
#include "viewer/scene_session.h"

namespace haarlight::viewer {

struct SceneRunOptions {
  std::filesystem::path scene;
  SceneSettings settings;
  int frames = 0;     ///< pictures, then it ends; 0: when the person closes the window
  int pause_at = -1;  ///< stops playing at this frame, and draws it better and better; -1: never
  std::optional<double> exposure_ev;  ///< none: chosen from the first picture
  TonemapCurve curve = TonemapCurve::filmic;
  std::filesystem::path screenshot, exr, metrics;
};

/// Whether a file is a scene, by its suffix: .gltf or .glb.
bool is_scene_file(const std::filesystem::path& file);

/// Plays options.frames pictures and writes what was asked for. Throws Error.
void run_scene_headless(const SceneRunOptions& options);

/// Opens a window of `width` x `height` and returns when it is closed, or after options.frames.
/// Drag turns the camera, the wheel comes closer; with the right button, or Shift, what is under
/// the pointer is dragged. Space plays, . and , step, M changes the method, L shows the life of
/// records, + and - change the exposure.
/// Throws Error, in particular Error{missing} where there is no display or no OpenGL 3.3.
void show_scene(const SceneRunOptions& options, int width, int height, double scale);

}  // namespace haarlight::viewer
