// One pixel -> the receivers whose light it shows.

#pragma once

#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "precompute/direction_table.h"
#include "precompute/effects.h"
#include "precompute/point_tracer.h"
#include "precompute/receiver.h"
#include "precompute/scene.h"
#include "precompute/visibility.h"

namespace haarlight {

/// Finds what pixels see through `samples` places each (1, 4 or 16), through mirrors and glass
/// where there are. The places are the same in every pixel, one in each column and row of as many,
/// so that edges are even steps and neighbouring rows differ by what the scene does. Immutable,
/// shared by all threads; keeps references.
class PixelSampler {
 public:
  PixelSampler(const Scene& scene, const Visibility& visibility, const Camera& camera, int samples,
               const Effects& effects);

  /// Appends the receivers and escapes of pixel (x, y) as row `row`; returns the share of the pixel
  /// that the scene covers.
  ///
  /// Where all hits lie on one smooth piece of surface - the same material without mirror or glass,
  /// normals within 8 degrees, less than the width of a pixel off its plane - one receiver in the
  /// middle stands for all, with their mean colours: light on it changes as slowly as its normal,
  /// and a ray in the middle is worth more than several anywhere. Where there are mirrors or glass,
  /// a pixel is looked at through at least 16 places, since what leaves the scene by way of them
  /// costs little; every fourth of them gives receivers.
  double sample(int x, int y, std::uint32_t row, TileReceivers& tile, RayCounts& counts) const;

 private:
  struct Seen;
  bool shoot(double px, double py, Seen& seen, RayCounts& counts) const;
  void add(const Seen& seen, double weight, std::uint32_t row, TileReceivers& tile) const;
  void look_through(const Seen& seen, double weight, double receiver_weight, std::uint64_t key,
                    std::uint32_t row, TileReceivers& tile, RayCounts& counts) const;

  const Scene& scene_;
  const Visibility& visibility_;
  Camera camera_;
  Effects effects_;
  Vec3 eye_;  // local
  std::vector<TexelPlace> places_;
  double pixel_width_;  // of a pixel at distance 1, in the middle of the picture
};

}  // namespace haarlight
