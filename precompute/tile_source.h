// What the driver knows of a tracer: it makes the rows of tiles.

#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "precompute/interreflection.h"
#include "precompute/point_tracer.h"
#include "prt/transport_writer.h"
#include "wavelet/haar.h"

namespace haarlight {

/// Makes the rows of a transport, tile by tile: of a picture's pixels, of a mesh's vertices. What a
/// tile's rows are depends on its outputs alone, never on thread, order or other tiles.
class TileSource {
 public:
  /// Working memory of one thread, and what it did.
  class Worker {
   public:
    virtual ~Worker() = default;
    /// Rows of `outputs` (kTileRows entries of the row order, kNoOutput: an empty row), replacing
    /// what `rows` holds.
    virtual void trace(std::span<const std::uint32_t> outputs, TileRows& rows) = 0;
    /// Whether the scene is seen in any of `outputs`; cheap.
    virtual bool shows_scene(std::span<const std::uint32_t> outputs) = 0;

    RayCounts counts;
    TileNoise noise;
    double transform_seconds = 0;  ///< part of trace(): the wavelet transform
  };

  virtual ~TileSource() = default;
  virtual const HaarLayout& layout() const = 0;
  virtual std::unique_ptr<Worker> make_worker() const = 0;
  /// Bytes that a worker and the rows it makes take, at most, with those of compressing them.
  virtual std::uint64_t worker_bytes() const {
    const auto size = static_cast<std::uint64_t>(layout().size());
    return 2 * 3 * kTileRows * size * sizeof(float) + (std::uint64_t{70} << 20) * size / 24576;
  }
};

}  // namespace haarlight
