// One pixel -> the points whose light it shows.

#pragma once

#include <vector>

#include "core/camera.h"
#include "core/rgb.h"
#include "precompute/point_tracer.h"
#include "precompute/scene.h"
#include "precompute/visibility.h"

namespace haarlight {

/// A point seen in a pixel.
struct PixelPoint {
  ShadingPoint point;
  double weight = 0;  ///< share of the pixel, (0, 1]
  Rgb albedo;
  Rgb specular;
};

/// Finds what pixels see through `samples` stratified places each (1, 4 or 16), jittered by a hash
/// of pixel and sample. Immutable, shared by all threads; keeps references.
class PixelSampler {
 public:
  PixelSampler(const Scene& scene, const Visibility& visibility, const Camera& camera, int samples);

  /// The points of pixel (x, y), replacing what `points` holds. The weights add up to the share of
  /// the pixel that the scene covers. Where all hits lie on one smooth piece of surface - the same
  /// material, normals within 8 degrees, less than the width of a pixel off its plane - one point
  /// in the middle stands for all, with their mean albedo: light on it changes as slowly as its
  /// normal, and a ray in the middle is worth more than several anywhere.
  void sample(int x, int y, std::vector<PixelPoint>& points, RayCounts& counts) const;

 private:
  const Scene& scene_;
  const Visibility& visibility_;
  Camera camera_;
  Vec3 eye_;            // local
  int side_;            // samples on an axis
  double pixel_width_;  // of a pixel at distance 1, in the middle of the picture
};

}  // namespace haarlight
