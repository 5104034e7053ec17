// What is seen behind the scene while the light moves.

#pragma once

#include <span>

#include "core/image.h"
#include "prt/light_rig.h"
#include "prt/motion.h"
#include "prt/scene_view.h"
#include "wavelet/environment.h"

namespace haarlight {

/// Draws the light of a frame of a motion where the scene does not cover `picture`: the environment
/// turned for rotate, tumble and swing, the blend of both for blend, the dimmed environment with
/// the disc for light. `to` is the second environment of blend, which must be there for it.
/// View and picture are of one size. Throws Error{invalid_argument} otherwise.
void composite_motion_background(const SceneView& view, const MotionOptions& options, int frame,
                                 const Environment& from, const Environment* to, Image& picture);

/// The same for a state of light among `environments`. Throws as check_light_state does.
void composite_light_background(const SceneView& view, const LightState& state,
                                std::span<const Environment> environments, Image& picture);

}  // namespace haarlight
