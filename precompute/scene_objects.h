// The connected pieces of a scene, and which of them are convex.

#pragma once

#include <cstdint>
#include <vector>

#include "precompute/scene.h"

namespace haarlight {

/// Pieces of surface that hang together. Vertices at the same place, to a 10^-6th of the scene's
/// size, are one, whatever their normals.
struct SceneObjects {
  std::vector<std::int32_t> object_of;  ///< per triangle
  std::vector<bool> convex;             ///< per object: a closed, convex body
  int count() const { return static_cast<int>(convex.size()); }
};

/// A body is convex if it is closed (each edge has two triangles), of one piece, without handles
/// (Euler's characteristic is 2), and no edge is concave by more than a 10^-6th of the scene's
/// size: locally convex and simply closed is convex (van Heijenoort 1952).
SceneObjects find_objects(const Scene& scene);

}  // namespace haarlight
