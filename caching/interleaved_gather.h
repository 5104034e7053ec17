// Instant global illumination: interleaved sampling and a discontinuity buffer.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "caching/moving_visibility.h"
#include "caching/surface_points.h"
#include "caching/virtual_lights.h"

namespace haarlight {

struct InterleavedOptions {
  int pattern = 3;              ///< n: pixels of an n x n pattern share the lights; 1: all to each
  double least_distance = 0.1;  ///< min_d of equation 2, local units
  double reach = 0.1;           ///< places farther apart do not share, local units
};

/// Irradiance of each point, in the order of `rows`, by every n^2-th virtual light; then the mean
/// over the n x n pixels about it that lie on the same surface, which together have asked all of
/// them (Wald and others 2002). Returns the number of shadow rays.
std::int64_t interleaved_gather(const MovingVisibility& scene, std::span<const VirtualLight> lights,
                                std::span<const SurfaceRow> rows, const InterleavedOptions& options,
                                std::vector<std::vector<RgbD>>& irradiance);

}  // namespace haarlight
