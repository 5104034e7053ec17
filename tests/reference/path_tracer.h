// A plain path tracer: the truth that transports are compared with.
//
// It starts at the camera, scatters at random, and looks the sky up where it leaves the scene. It
// shares with precomputation the scene, the meaning of materials and nothing else: no wavelets, no
// transport, no Embree, its own random numbers.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/rgb.h"
#include "precompute/scene.h"
#include "tests/reference/sky.h"
#include "tests/reference/triangle_tree.h"

namespace haarlight::reference {

/// Which light is followed. A bounce is scattering at a diffuse or glossy surface beyond the first
/// one seen; mirrors and glass on the way are no bounces.
struct PathOptions {
  int samples = 64;          ///< paths a pixel, >= 2
  int max_bounces = 10'000;  ///< 0: direct light only
  bool shadows = true;      ///< off: all of the sky above the horizon reaches a surface; no bounces
  bool gloss = true;        ///< off: no lobes
  bool specular = true;     ///< off: mirrors and glass are black in the picture
  bool caustics = true;     ///< off: they are black to all other surfaces
  bool next_event = true;   ///< aims at the sky too (where it can be aimed at)
  bool background = false;  ///< lines of sight that meet nothing show the sky, otherwise black
  bool pixel_centers = false;  ///< lines of sight through the middle of pixels, or all over them
  std::uint64_t seed = 1;
};

/// A mean over paths.
struct Estimate {
  RgbD mean;
  RgbD variance;            ///< of the mean, estimated from the spread of the paths
  double sum_variance = 0;  ///< of the sum of its channels, which rise and fall together
};

/// Keeps references to scene and sky. Immutable, shared by all threads. Of materials it knows all
/// but normal textures; metallic-roughness is asked of precompute/bsdf.h, everything else is its
/// own.
class PathTracer {
 public:
  /// Throws Error{missing} without triangles, Error{invalid_argument} for a normal texture
  /// or a measured BRDF.
  PathTracer(const Scene& scene, const Sky& sky, const PathOptions& options = {});

  /// Radiance arriving at `origin` (world) from the unit `direction`. `stream` tells estimates of
  /// one seed apart.
  Estimate radiance(const Vec3& origin, const Vec3& direction, std::uint64_t stream = 0) const;

  /// The pixels y * width + x of a camera's picture, in their order; the same bits on any number of
  /// threads.
  std::vector<Estimate> pixels(const Camera& camera, std::span<const std::uint32_t> which) const;
  /// All of them, row by row.
  std::vector<Estimate> picture(const Camera& camera) const;

 private:
  struct Surface;
  class Random;
  Surface surface(const TriangleTree::Hit& hit, const Vec3& direction) const;
  bool is_hole(const TriangleTree::Hit& hit) const;
  std::optional<TriangleTree::Hit> first_hit(const Vec3& origin, const Vec3& direction,
                                             bool any = false) const;
  RgbD path(Vec3 origin, Vec3 direction, Random& random) const;
  RgbD aimed(const Surface& surface, Random& random) const;

  const Scene& scene_;
  const Sky& sky_;
  PathOptions options_;
  TriangleTree tree_;
  std::vector<Image> alpha_;  // as red, one a texture
  bool has_holes_ = false;
};

/// The means as a picture.
Image picture_of(std::span<const Estimate> estimates, int width, int height);

}  // namespace haarlight::reference
