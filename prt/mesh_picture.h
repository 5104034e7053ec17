// A mesh with a radiance at each vertex -> a picture from any camera: a small software rasteriser.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "prt/transport_mesh.h"

namespace haarlight {

/// Looking and shading are apart: what a pixel sees depends on the camera alone, so that a light
/// that moves before a still camera costs a weighted sum a pixel.
///
/// Triangles are two-sided. Vertices in front are rounded to a fixed grid of 2^-23 of the picture's
/// size (rounded up to a power of two), on which edges are exact, and a place on an edge belongs to
/// one side of it alone: meshes have neither cracks nor double hits. Interpolation is linear on the
/// triangle in space (perspective-correct), to within that rounding. Triangles that reach behind
/// the camera are drawn in homogeneous coordinates and need no clipping (Olano and Greer 1997,
/// "Triangle Scan Conversion using 2D Homogeneous Coordinates"). Of surfaces equally far the
/// triangle of lower number is seen. The same bits on any number of threads; no heap use once warm.
class MeshPicture {
 public:
  /// `samples` places are looked at in a pixel, 1 (its middle) or 4 (a rotated grid). Throws
  /// Error{invalid_argument} for another number, no mesh, or one that check_mesh() refuses.
  explicit MeshPicture(std::shared_ptr<const TransportMesh> mesh, int samples = 4);
  ~MeshPicture();
  MeshPicture(MeshPicture&&) noexcept;
  MeshPicture& operator=(MeshPicture&&) noexcept;

  /// Finds what each pixel of camera.width x camera.height sees. Throws Error{invalid_argument}
  /// unless sizes are 1 to 16384, the camera is finite and its field of view in (0, pi).
  void look(const Camera& camera);

  /// Radiance of the mesh times the share of the pixel it covers, nothing where it is not.
  /// `radiance` has one entry a vertex; `picture` gets the camera's size. Call look() first.
  /// A constant radiance comes out exactly.
  void shade(std::span<const Rgb> radiance, Image& picture) const;

  /// Share of each pixel that the mesh covers, as of the last look().
  std::span<const float> coverage() const;

  /// What a pixel sees of one triangle: sum over its corners of weight x radiance is share x r0 +
  /// second x (r1 - r0) + third x (r2 - r0).
  struct Fragment {
    std::uint32_t triangle = 0;
    float share = 0, second = 0, third = 0;
  };
  /// The fragments of pixel (x, y), as of the last look(): at most one a triangle.
  std::span<const Fragment> fragments(int x, int y) const;
  /// Of each vertex the sum over pixels of its weight in the pixel times the pixel's coverage, as
  /// of the last look(): a picture's sum of squares is at most that of the vertices, so weighted.
  void vertex_weights(std::vector<float>& weights) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace haarlight
