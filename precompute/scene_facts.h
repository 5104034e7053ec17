// What a scene's materials are, by area.

#pragma once

#include "precompute/scene.h"

namespace haarlight {

/// Averages over the surface; textures by their mean.
struct SceneFacts {
  double mean_albedo = 0;    ///< luminance of all that is reflected, lobes and mirrors too
  bool reflects = false;     ///< whether any surface reflects more than a thousandth
  bool colored = false;      ///< whether any colour is not grey, to 1 %
  double glossy_area = 0;    ///< share of the surface with a lobe
  double specular_area = 0;  ///< share with single directions
  bool has_glass = false;    ///< anything that light passes
  double measured_area = 0;  ///< share that is tables of a BRDF
  int glossiest = -1;        ///< material with the narrowest lobe, or none
  int measured = -1;         ///< the table that covers most, or none
};

SceneFacts scene_facts(const Scene& scene);

}  // namespace haarlight
