// From where a picture looks, and how much of each pixel the scene fills.

#pragma once

#include <span>

#include "core/camera.h"
#include "prt/transport.h"

namespace haarlight {

/// What is needed to draw something behind a scene. Does not own `coverage`.
struct SceneView {
  Camera camera;
  std::span<const float> coverage;  ///< a share a pixel, [0, 1]

  SceneView(const Camera& seen_by, std::span<const float> covered)
      : camera(seen_by), coverage(covered) {}
  /// The view of a picture's transport. Throws Error{invalid_argument} for a mesh, which has none
  /// of its own.
  SceneView(const Transport& transport);  // NOLINT(google-explicit-constructor): the same thing
};

}  // namespace haarlight
