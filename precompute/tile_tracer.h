// One 8x8 pixel tile -> its exact rows of the transport.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/camera.h"
#include "precompute/direction_table.h"
#include "precompute/pixel_sampler.h"
#include "precompute/point_tracer.h"
#include "precompute/scene.h"
#include "precompute/visibility.h"
#include "prt/transport_writer.h"
#include "wavelet/haar.h"

namespace haarlight {

struct TraceOptions {
  int face_size = 64;     ///< texels on an edge of a cube face; a power of two in [4, 256]
  int spp = 4;            ///< directions in a texel, [1, 64]
  bool adaptive = true;   ///< all directions only where visibility changes (see PointTracer)
  int pixel_samples = 4;  ///< 1, 4 or 16
};

/// Throws Error{invalid_argument} naming the option, its value and what was wanted.
void check(const TraceOptions& options);

/// Makes rows. Immutable, shared by all threads; keeps references to scene and visibility.
class TileTracer {
 public:
  /// Throws Error{invalid_argument} as check() does.
  TileTracer(const Scene& scene, const Visibility& visibility, const Camera& camera,
             const TraceOptions& options);

  /// Working memory of one thread.
  struct Scratch {
    PointScratch point;
    std::vector<std::vector<PixelPoint>> pixels;
    std::vector<float> lambert, lobe, texels;
  };

  /// Rows of the pixels `outputs` (kTileRows entries: y * width + x, or kNoOutput), replacing what
  /// `tile` holds. A block is grey if each of its pixels is: the BRDFs of its points are multiples
  /// of one colour to 1 % of that colour.
  void trace(std::span<const std::uint32_t> outputs, Scratch& scratch, TileRows& tile,
             RayCounts& counts) const;

  /// The points of a pixel; for measuring and testing the ray stage by itself.
  const PixelSampler& pixels() const { return pixels_; }
  const PointTracer& points() const { return points_; }
  const HaarLayout& layout() const { return layout_; }

 private:
  HaarLayout layout_;
  int width_;
  DirectionTable table_;
  PixelSampler pixels_;
  PointTracer points_;
};

}  // namespace haarlight
