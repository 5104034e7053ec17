// Splits triangles where visibility changes, so that shadows on large faces are sharp.

#pragma once

#include <cstdint>

#include "core/progress.h"
#include "precompute/scene.h"
#include "precompute/visibility.h"

namespace haarlight {

struct SubdivideOptions {
  double tolerance = 0.01;    ///< difference of what two ends of an edge see, in shares of their
                              ///< unshadowed irradiance under an even sky, above which it is split;
                              ///< above 0
  double longest = 1.0 / 24;  ///< of the scene's diameter: longer edges are split in any case, so
                              ///< that shadows in the midst of large faces are found; above 0
  double shortest = 1.0 / 512;  ///< of the scene's diameter: shorter edges are left alone
  int max_vertices = 100'000;   ///< no split goes past it
};

struct SubdivideReport {
  std::int64_t vertices = 0, triangles = 0;  ///< of the result
  std::int64_t split_edges = 0;
  int rounds = 0;
  double worst = 0;  ///< the largest difference left on an edge that may be split
};

/// A finer version of `scene` with the same surfaces: edges are split in the middle, together in
/// all triangles that meet there, with normals, texture coordinates and tints interpolated. A
/// triangle's longest edge is split before its others (Rivara 1984), which keeps angles. The worst
/// edges come first: difference times length. What is seen is looked at coarsely, 8x8 texels a
/// face. Memory: 384 bytes a vertex. The same on any number of threads. `visibility` is the
/// scene's. Throws Error{invalid_argument} for options out of range, Error{cancelled} when
/// `progress` says so.
Scene subdivide(const Scene& scene, const Visibility& visibility, const SubdivideOptions& options,
                SubdivideReport* report = nullptr, const Progress& progress = {});

}  // namespace haarlight
