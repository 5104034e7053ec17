// Sums of rows become outputs: pixels, vertices.

#include "prt/finish_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "core/denormals.h"
#include "core/error.h"
#include "core/parallel.h"
#include "prt/apply_kernel.h"

namespace haarlight {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

// Rows of a chunk, coloured, to their outputs.
void finish_chunk(const Transport& transport, int chunk, const double* totals,
                  std::span<Rgb> outputs) {
  const FlushDenormals flush;
  const std::size_t first = static_cast<std::size_t>(chunk) * kChunkRows;
  const std::uint32_t* output = transport.row_output().data() + first;
  const Rgb* color = transport.row_color().data() + first;
  for (std::size_t block = 0; block < static_cast<std::size_t>(kChunkBlocks); ++block) {
    const double* sum = totals + block * kBlockTotals;
    for (std::size_t r = 0; r < static_cast<std::size_t>(kBlockRows); ++r) {
      const std::size_t row = block * kBlockRows + r;
      if (output[row] == kNoOutput) continue;
      outputs[output[row]] = {static_cast<float>(sum[r]) * color[row].r,
                              static_cast<float>(sum[kBlockRows + r]) * color[row].g,
                              static_cast<float>(sum[2 * kBlockRows + r]) * color[row].b};
    }
  }
}

}  // namespace

RelightStats apply_and_finish(RowSums& sums, const LightingUpdate& update, std::span<Rgb> outputs,
                              UpdatePart part) {
  // Chunks finish inside the streaming loop; the time they take there is measured apart and shared
  // out over the threads that took it.
  std::atomic<std::int64_t> finishing{0};
  const auto begin = Clock::now();
  RelightStats stats;
  const auto finish_timed = [&](int chunk, const double* totals) {
    const auto chunk_begin = Clock::now();
    finish_chunk(sums.transport(), chunk, totals, outputs);
    finishing.fetch_add((Clock::now() - chunk_begin).count(), std::memory_order_relaxed);
  };
  // By reference: a std::function would take the heap for its three captures.
  stats.apply = sums.apply(update, std::ref(finish_timed), part);
  const double all = milliseconds(Clock::now() - begin);
  const double finish =
      milliseconds(Clock::duration(finishing.load())) / static_cast<double>(thread_count());
  stats.finish_ms = std::min(finish, all);
  stats.apply_ms = all - stats.finish_ms;
  return stats;
}

LightingUpdate full_update(const HaarLayout& layout, std::span<const Rgb> lighting) {
  if (lighting.size() != static_cast<std::size_t>(layout.size())) {
    throw Error(
        ErrorKind::invalid_argument,
        fmt::format("lighting has {} coefficients, expected {}", lighting.size(), layout.size()));
  }
  LightingUpdate update;
  for (std::size_t j = 0; j < lighting.size(); ++j) {
    if (!(lighting[j] == Rgb{})) update.deltas.push_back({static_cast<int>(j), RgbD(lighting[j])});
  }
  return update;
}

}  // namespace haarlight
