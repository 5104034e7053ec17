// The mesh whose vertices a transport relights.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/vec.h"

namespace haarlight {

/// Triangles over vertices; what a transport per vertex is drawn with. A plain value.
struct TransportMesh {
  Vec3 origin;                                 ///< metres, in the world
  std::vector<std::array<float, 3>> position;  ///< metres from `origin`, one a vertex: a
                                               ///< mesh far from the world's keeps its shape
  std::vector<std::array<float, 3>> normal;    ///< shading normals, one a vertex
  std::vector<std::array<std::uint32_t, 3>> triangle;  ///< three vertices each
  std::vector<std::uint32_t> material;                 ///< one a vertex, or empty: none is told

  /// Position of a vertex in the world, metres.
  Vec3 world(std::size_t vertex) const {
    const auto& p = position[vertex];
    return origin +
           Vec3{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  }
};

/// What is wrong with a mesh, or nothing: no vertex, arrays of different length, a number that is
/// not finite, a triangle of a vertex that is not there.
std::string check_mesh(const TransportMesh& mesh);

/// A sphere around all vertices: middle of the bounding box (world, metres) and its half diagonal.
struct BoundingSphere {
  Vec3 center;
  double radius = 0;
};
BoundingSphere bounding_sphere(const TransportMesh& mesh);

/// Sizes by which a packed mesh is unpacked.
struct MeshCounts {
  std::uint32_t vertices = 0, triangles = 0;
  bool materials = false;
};

/// The bytes of a mesh in a file: origin, positions, normals, triangles, materials, under zstd.
std::vector<std::byte> pack_mesh(const TransportMesh& mesh);

/// Throws Error{format}, message beginning with `name`, unless the bytes unpack to exactly these
/// counts and check_mesh() finds nothing. What it asks for is bounded by the size of `packed`.
TransportMesh unpack_mesh(std::span<const std::byte> packed, const MeshCounts& counts,
                          const std::string& name);

}  // namespace haarlight
