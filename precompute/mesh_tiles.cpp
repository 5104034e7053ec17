// The tiles of a mesh as a source for the driver.

#include "precompute/mesh_tiles.h"

#include <algorithm>
#include <utility>

namespace haarlight {
namespace {

class MeshWorker : public TileSource::Worker {
 public:
  MeshWorker(const VertexSampler& sampler, const TileTracer& tracer)
      : sampler_(sampler), tracer_(tracer) {}

  void trace(std::span<const std::uint32_t> outputs, TileRows& rows) override {
    sampler_.sample(outputs, receivers_);
    if (!tracer_.options().effects.gloss) {
      std::erase_if(receivers_.receivers, [](const Receiver& r) { return r.bsdf.term != nullptr; });
    }
    TileNoise here;
    tracer_.trace(receivers_, scratch_, rows, counts, &here);
    rows.noise_variance = here.variance;
    rows.noise_energy = here.energy;
    noise.add(here);
    transform_seconds += std::exchange(scratch_.transform_seconds, 0.0);
  }

  bool shows_scene(std::span<const std::uint32_t> outputs) override {
    return std::any_of(outputs.begin(), outputs.end(),
                       [](std::uint32_t output) { return output != kNoOutput; });
  }

 private:
  const VertexSampler& sampler_;
  const TileTracer& tracer_;
  TileReceivers receivers_;
  TileTracer::Scratch scratch_;
};

}  // namespace

std::unique_ptr<TileSource::Worker> MeshTiles::make_worker() const {
  return std::make_unique<MeshWorker>(sampler_, tracer_);
}

}  // namespace haarlight
