// The driver: pilots, thresholds, every tile traced and compressed, one file.

#include "precompute/tile_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "precompute/pilots.h"
#include "precompute/run_checks.h"
#include "prt/transport_writer.h"

namespace haarlight {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Workers handed from tile to tile, at most one a thread.
class WorkerPool {
 public:
  struct Work {
    std::unique_ptr<TileSource::Worker> worker;
    TileRows rows;
  };
  explicit WorkerPool(const TileSource& source) : source_(source) {}
  std::unique_ptr<Work> take() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) return std::make_unique<Work>(Work{source_.make_worker(), {}});
    auto work = std::move(free_.back());
    free_.pop_back();
    return work;
  }
  void give(std::unique_ptr<Work> work) {
    const std::lock_guard lock(mutex_);
    rays_ += work->worker->counts;
    work->worker->counts = {};
    free_.push_back(std::move(work));
  }
  const RayCounts& rays() const { return rays_; }

 private:
  const TileSource& source_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Work>> free_;
  RayCounts rays_;
};

// Tells the caller about finished steps of work, one at a time.
class Steps {
 public:
  Steps(const Progress& progress, int total) : progress_(progress), total_(total) {}
  void done(int count) {
    const std::lock_guard lock(mutex_);
    done_ += count;
    if (progress_ && !progress_(std::min(1.0, static_cast<double>(done_) / total_))) {
      throw Error(ErrorKind::cancelled, "precomputation stopped by its caller");
    }
  }

 private:
  std::mutex mutex_;
  const Progress& progress_;
  int total_;
  int done_ = 0;
};

std::vector<float> tune(const TileSource& source, std::span<const std::uint32_t> order,
                        double error, Steps& steps, RayCounts& counts) {
  const auto scout = source.make_worker();
  const std::vector<int> pilots = choose_pilots(*scout, order);
  ToleranceTuner tuner(source.layout(), error);
  counts += scout->counts;
  counts += trace_pilots(
      source, order, pilots, thread_count(), [&](const TileRows& rows) { tuner.add(rows); },
      [&](int count) { steps.done(count); });
  steps.done(kPilotTiles - static_cast<int>(pilots.size()));
  return tuner.thresholds();
}

}  // namespace

PrecomputeReport run_tiles(const TileSource& source, const TileRun& run, const RunOptions& options,
                           const std::filesystem::path& file, const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  check(options);
  check_output(file);

  const std::vector<std::uint32_t> order = row_order(run.info);
  PrecomputeReport report;
  report.tiles = used_tiles(order);

  // Pilot tiles say how much may be dropped.
  Steps steps(progress, report.tiles + kPilotTiles);
  report.thresholds = tune(source, order, options.error, steps, report.ray_counts);
  report.pilot_seconds = seconds_since(start);

  TransportWriterOptions writing;
  writing.thresholds = report.thresholds;
  writing.fingerprint = run.fingerprint;
  writing.resume = options.resume;
  TransportWriter writer(file, run.info, writing);

  // Every tile by itself: trace, transform, compress, append.
  WorkerPool pool(source);
  std::mutex mutex;
  parallel_for(writer.tile_count(), [&](int tile) {
    const bool known = writer.has_tile(tile);
    std::int64_t blocks = 0, rgb_blocks = 0;
    if (!known) {
      auto work = pool.take();
      work->worker->trace(writer.tile_outputs(tile), work->rows);
      writer.write_tile(tile, work->rows);
      for (std::size_t b = 0; b < kTileBlocks; ++b) {
        const auto first =
            work->rows.coverage.begin() + static_cast<std::ptrdiff_t>(b * kBlockRows);
        if (std::any_of(first, first + kBlockRows, [](float c) { return c > 0; })) ++blocks;
        if (work->rows.rgb_blocks >> b & 1u) ++rgb_blocks;
      }
      pool.give(std::move(work));
    }
    {
      const std::lock_guard lock(mutex);
      if (known) ++report.resumed_tiles;
      report.blocks += blocks;
      report.rgb_blocks += rgb_blocks;
    }
    steps.done(1);
  });
  report.ray_counts += pool.rays();
  report.rays = report.ray_counts.primary + report.ray_counts.shadow;

  writer.finish(run.meta);
  const Transport written = Transport::open(file);
  report.bytes = written.file_bytes();
  report.measured_error = nlohmann::json::parse(written.info().meta).value("measured_error", 0.0);
  report.seconds = seconds_since(start);
  return report;
}

}  // namespace haarlight
