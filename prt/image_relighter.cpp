// Sums of rows become pixels.

#include "prt/image_relighter.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/apply_kernel.h"

namespace haarlight {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

// Rows of a chunk, coloured, to their pixels.
void finish_chunk(const Transport& transport, int chunk, const double* totals, Image& picture) {
  const std::size_t first = static_cast<std::size_t>(chunk) * kChunkRows;
  const std::uint32_t* output = transport.row_output().data() + first;
  const Rgb* color = transport.row_color().data() + first;
  for (std::size_t block = 0; block < static_cast<std::size_t>(kChunkBlocks); ++block) {
    const double* sum = totals + block * kBlockTotals;
    for (std::size_t r = 0; r < static_cast<std::size_t>(kBlockRows); ++r) {
      const std::size_t row = block * kBlockRows + r;
      if (output[row] == kNoOutput) continue;
      picture.pixels[output[row]] = {static_cast<float>(sum[r]) * color[row].r,
                                     static_cast<float>(sum[kBlockRows + r]) * color[row].g,
                                     static_cast<float>(sum[2 * kBlockRows + r]) * color[row].b};
    }
  }
}

}  // namespace

ImageRelighter::ImageRelighter(Transport transport)
    : sums_(std::move(transport)),
      picture_(sums_.transport().width(), sums_.transport().height()) {}

RelightStats ImageRelighter::apply(const LightingUpdate& update) {
  // Chunks finish inside the streaming loop; the time they take there is measured apart and shared
  // out over the threads that took it.
  std::atomic<std::int64_t> finishing{0};
  const auto begin = Clock::now();
  RelightStats stats;
  stats.apply = sums_.apply(update, [&](int chunk, const double* totals) {
    const auto chunk_begin = Clock::now();
    finish_chunk(sums_.transport(), chunk, totals, picture_);
    finishing.fetch_add((Clock::now() - chunk_begin).count(), std::memory_order_relaxed);
  });
  const double all = milliseconds(Clock::now() - begin);
  const double finish =
      milliseconds(Clock::duration(finishing.load())) / static_cast<double>(thread_count());
  stats.finish_ms = std::min(finish, all);
  stats.apply_ms = all - stats.finish_ms;
  return stats;
}

Image relight_once(const Transport& transport, std::span<const Rgb> lighting) {
  if (lighting.size() != static_cast<std::size_t>(transport.layout().size())) {
    throw Error(ErrorKind::invalid_argument, "lighting has " + std::to_string(lighting.size()) +
                                                 " coefficients, expected " +
                                                 std::to_string(transport.layout().size()));
  }
  LightingUpdate update;
  for (std::size_t j = 0; j < lighting.size(); ++j) {
    if (!(lighting[j] == Rgb{})) update.deltas.push_back({static_cast<int>(j), RgbD(lighting[j])});
  }
  ImageRelighter relighter(transport);
  relighter.expect_resets(false);
  relighter.apply(update);
  return relighter.picture();
}

void composite_environment(const Transport& transport, const Environment& environment,
                           const Rotation& rotation, Image& picture) {
  const Rotation back = rotation.transposed();  // where a direction was before it was turned
  const Camera& camera = transport.info().camera;
  parallel_for(picture.height, [&](int y) {
    for (int x = 0; x < picture.width; ++x) {
      const float uncovered = 1 - transport.coverage()[picture.index(x, y)];
      if (uncovered <= 0) continue;
      const Rgb behind = environment.radiance(back * camera.direction(x + 0.5, y + 0.5));
      picture.at(x, y) += uncovered * behind;
    }
  });
}

}  // namespace haarlight
