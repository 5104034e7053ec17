// What makes a picture black though all is well: worth a word before somebody looks for a fault.

#pragma once

#include <string>
#include <vector>

#include "core/camera.h"
#include "precompute/scene.h"
#include "precompute/visibility.h"

namespace haarlight {

/// One clause each, none for a scene that shows something:
/// - "all materials are black": no surface reflects or lets through more than a thousandth;
/// - "nothing of the scene is in the picture": the middle of no pixel of `camera` (nullptr: the
///   view is not fixed) meets a surface. Costs a few rays where something is seen, one a pixel
///   where nothing is.
/// `visibility` is the scene's.
std::vector<std::string> scene_notes(const Scene& scene, const Visibility& visibility,
                                     const Camera* camera);

}  // namespace haarlight
