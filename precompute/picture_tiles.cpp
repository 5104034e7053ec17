// The tiles of a picture as a source for the driver.

#include "precompute/picture_tiles.h"

#include <utility>

namespace haarlight {
namespace {

class PictureWorker : public TileSource::Worker {
 public:
  PictureWorker(const TileTracer& tracer, int width) : tracer_(tracer), width_(width) {}

  void trace(std::span<const std::uint32_t> outputs, TileRows& rows) override {
    TileNoise here;
    tracer_.trace(outputs, scratch_, rows, counts, &here);
    rows.noise_variance = here.variance;
    rows.noise_energy = here.energy;
    noise.add(here);
    transform_seconds += std::exchange(scratch_.transform_seconds, 0.0);
  }

  bool shows_scene(std::span<const std::uint32_t> outputs) override {
    for (const std::size_t row : {0u, 21u, 42u, 63u}) {  // one a block
      if (outputs[row] == kNoOutput) continue;
      const int pixel = static_cast<int>(outputs[row]);
      glance_.clear();
      if (tracer_.pixels().sample(pixel % width_, pixel / width_, 0, glance_, counts) > 0)
        return true;
    }
    return false;
  }

 private:
  const TileTracer& tracer_;
  int width_;
  TileTracer::Scratch scratch_;
  TileReceivers glance_;
};

}  // namespace

std::unique_ptr<TileSource::Worker> PictureTiles::make_worker() const {
  return std::make_unique<PictureWorker>(tracer_, width_);
}

}  // namespace haarlight
