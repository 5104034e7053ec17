// What a closed mesh holds.

#pragma once

#include "precompute/scene.h"

namespace haarlight::data_gen {

/// Volume inside a closed mesh by the divergence theorem: a sixth of the sum of the triple
/// products. Negative when the triangles are turned inside out.
inline double volume(const Scene& scene) {
  double sum = 0;
  for (const Triangle& t : scene.triangle) {
    sum += dot(scene.position[t.vertex[0]],
               cross(scene.position[t.vertex[1]], scene.position[t.vertex[2]]));
  }
  return sum / 6;
}

}  // namespace haarlight::data_gen
