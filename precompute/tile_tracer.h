// The receivers of one tile -> its exact rows of the transport.

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/camera.h"
#include "precompute/direction_table.h"
#include "precompute/effects.h"
#include "precompute/interreflection.h"
#include "precompute/pixel_sampler.h"
#include "precompute/point_tracer.h"
#include "precompute/receiver.h"
#include "precompute/scene.h"
#include "precompute/visibility.h"
#include "prt/transport_writer.h"
#include "wavelet/haar.h"

namespace haarlight {

struct TraceOptions {
  int face_size = 64;      ///< texels on an edge of a cube face; a power of two in [4, 256]
  int spp = 4;             ///< directions in a texel, [1, 64]
  bool adaptive = true;    ///< all directions only where visibility changes (see PointTracer)
  int pixel_samples = 4;   ///< 1, 4 or 16
  Effects effects;         ///< what is simulated; by default direct light of every kind
  int indirect_face = 32;  ///< squares along an edge of a cube face in which the sky is seen by
                           ///< light that is reflected between surfaces; a power of two, at least
                           ///< 4; no more than face_size are used
  double noise = 0.02;     ///< a tile's interreflection is traced until its picture is estimated to
                           ///< be as noisy as this, relative RMS, under the worst built-in lighting
  int paths = 2048;        ///< or until it has so many paths of a kind, [1, 2^20]
  std::uint64_t seed = 0;  ///< of interreflection's paths
};

/// Throws Error{invalid_argument} naming the option, its value and what was wanted.
void check(const TraceOptions& options);

/// Makes rows. Immutable, shared by all threads; keeps references to scene and visibility.
class TileTracer {
 public:
  /// Rows are receivers that the caller finds. Throws Error{invalid_argument} as check() does.
  TileTracer(const Scene& scene, const Visibility& visibility, const TraceOptions& options);
  /// Rows are also pixels of `camera`.
  TileTracer(const Scene& scene, const Visibility& visibility, const Camera& camera,
             const TraceOptions& options);

  /// Working memory of one thread: up to 70 MB at 64x64 faces with interreflection.
  struct Scratch {
    Scratch() : paths(Interreflection::make_scratch()) {}
    PointScratch point;
    TileReceivers receivers;
    std::vector<float> diffuse, first, second, texels;
    std::vector<Deposit> deposits;
    std::vector<std::vector<std::size_t>> of_row;
    std::vector<float> term_rows;        // of the terms of one vertex
    std::vector<std::size_t> term_done;  // receivers whose direct light is there
    std::unique_ptr<Interreflection::Scratch, void (*)(Interreflection::Scratch*)> paths;
    double transform_seconds = 0;  ///< spent on wavelets by all calls
  };

  /// Rows of the pixels `outputs` (kTileRows entries: y * width + x, or kNoOutput), replacing what
  /// `tile` holds. Needs a camera. A block is grey if its rows are: of one colour each, to 1 % of
  /// their norm - or if color is not among the effects: then each row gets the one that fits best.
  /// Adds to `noise` if given.
  void trace(std::span<const std::uint32_t> outputs, Scratch& scratch, TileRows& tile,
             RayCounts& counts, TileNoise* noise = nullptr) const;

  /// The same for receivers.
  void trace(const TileReceivers& receivers, Scratch& scratch, TileRows& tile, RayCounts& counts,
             TileNoise* noise = nullptr) const;

  /// Receivers of the pixels `outputs`, replacing what `receivers` holds. Needs a camera.
  void find_receivers(std::span<const std::uint32_t> outputs, TileReceivers& receivers,
                      RayCounts& counts) const;

  /// The points of a pixel; for measuring and testing the ray stage by itself.
  const PixelSampler& pixels() const { return *pixels_; }
  const PointTracer& points() const { return points_; }
  const HaarLayout& layout() const { return layout_; }
  const TraceOptions& options() const { return options_; }

 private:
  void add_terms(const TileReceivers& receivers, std::size_t first, Scratch& scratch,
                 const std::function<float*(std::size_t channel, std::size_t row)>& to,
                 std::span<const bool> open, std::span<const RgbD> base, RayCounts& counts) const;
  void add_direct(const Receiver& receiver, bool first, Scratch& scratch,
                  std::span<float* const> channels, const RgbD& base, RayCounts& counts) const;

  const Scene& scene_;
  const Visibility& visibility_;
  TraceOptions options_;
  HaarLayout layout_;
  int width_ = 0;
  DirectionTable table_;
  std::optional<PixelSampler> pixels_;
  PointTracer points_;
  std::optional<Interreflection> paths_;
};

}  // namespace haarlight
