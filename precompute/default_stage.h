// What a bare mesh lacks to make a picture: a ground to stand on and a camera.

#pragma once

#include <optional>

#include "core/camera.h"
#include "core/rgb.h"
#include "precompute/scene.h"

namespace haarlight {

enum class GroundMode { automatic, on, off };

struct StageOptions {
  GroundMode ground = GroundMode::automatic;  ///< automatic: if needs_ground()
  double ground_size = 6;                     ///< side of the square, in widths of the scene; > 0
  Rgb ground_albedo{0.5f, 0.5f, 0.5f};
  bool use_scene_camera = true;   ///< rather than a framing one, where the file has a camera
  int width = 512, height = 512;  ///< of the picture, pixels; >= 1
};

struct Stage {
  Camera camera;
  bool ground_added = false;
  bool camera_made = false;
};

/// Whether a ground plane would help: not if the file brings a camera (it was set up as a picture),
/// nor if triangles facing up within the lowest 5 % of its height already cover half of its
/// footprint, as a floor does.
bool needs_ground(const Scene& scene);

/// A camera that holds the bounding sphere of all triangles: from the front (looking along -Z)
/// turned 30 degrees to the scene's left, 20 degrees above, 35 degrees of vertical field of view.
/// A room - a floor facing up and a ceiling facing down, each half of the footprint - is looked at
/// straight from the front, where such scenes are open. Throws Error{missing} without triangles.
Camera framing_camera(const Scene& scene, int width, int height);

/// Adds what is missing: the camera first (it frames the mesh, not the ground), then the ground, a
/// square at the lowest point. Throws Error{invalid_argument} for options outside their range.
Stage set_stage(Scene& scene, const StageOptions& options);

}  // namespace haarlight
