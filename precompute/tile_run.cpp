// The driver: pilots, thresholds, every tile traced and compressed, one file.

#include "precompute/tile_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <exception>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "precompute/distribution.h"
#include "precompute/memory_budget.h"
#include "precompute/pilots.h"
#include "precompute/preview.h"
#include "precompute/run_checks.h"
#include "precompute/tile_queue.h"
#include "prt/tile_record.h"
#include "prt/transport_writer.h"

namespace haarlight {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kPreviewSecondsAfterStop = 5;
constexpr double kPreviewShareOfLimit = 0.1;
// Putting a file together: what any machine does, so that a promised time is kept.
constexpr double kAssemblyBytesPerSecond = 60e6;
constexpr double kAssemblySeconds = 0.1;

double seconds_between(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}
double seconds_since(Clock::time_point start) { return seconds_between(start, Clock::now()); }

// Thrown where the caller's stop or the time limit ends the pilots.
struct PilotsCut {
  RunEnd why;
};

// One run, from its options to its report.
class Run {
 public:
  Run(const TileSource& source, const TileRun& run, const RunOptions& options,
      const std::filesystem::path& file, const Progress& progress)
      : source_(source),
        run_(run),
        options_(options),
        file_(file),
        progress_(progress),
        order_(row_order(run.info)) {}

  PrecomputeReport go();

 private:
  void prepare();
  void tune();
  void trace_all();
  void work_here(TileQueue& queue);
  void follow();
  void took(const std::vector<std::byte>& record, double tile_seconds);
  void tell();
  void finish();
  void preview_only(RunEnd why);
  void write_preview(std::vector<int> missing);
  bool may_replace() const;
  bool leads() const { return !options_.distribution || options_.distribution->leads(); }
  double assembly_seconds() const;
  TransportWriterOptions writing() const;
  std::span<const std::uint32_t> outputs(int tile) const {
    return std::span(order_).subspan(static_cast<std::size_t>(tile) * kTileRows, kTileRows);
  }

  const TileSource& source_;
  const TileRun& run_;
  const RunOptions& options_;
  const std::filesystem::path& file_;
  const Progress& progress_;
  const Clock::time_point start_ = Clock::now();
  std::vector<std::uint32_t> order_;
  PrecomputeReport report_;
  std::optional<TransportWriter> writer_;
  std::optional<ToleranceTuner> tuner_;

  // Of tracing, under the mutex.
  std::mutex mutex_;
  std::optional<TileQueue> queue_;
  Clock::time_point tracing_since_;
  RayCounts running_;  // rays of workers that are still at work
  int pilots_done_ = 0;
  std::uint64_t journal_bytes_ = 0;
  std::vector<float> provisional_;  // thresholds of a preview when there are no others
};

TransportWriterOptions Run::writing() const {
  TransportWriterOptions writing;
  writing.thresholds = report_.thresholds;
  writing.fingerprint = run_.fingerprint;
  writing.resume = options_.resume;
  writing.meta = run_.meta;
  writing.shard = options_.shard;
  writing.max_bytes = options_.max_bytes;
  return writing;
}

void Run::prepare() {
  check(options_);
  check_max_bytes(run_.info, options_.max_bytes);
  check_output(file_);
  std::size_t rows = order_.size();
  while (rows > 0 && order_[rows - 1] == kNoOutput) --rows;
  const int all = static_cast<int>((rows + kTileRows - 1) / kTileRows);
  for (int t = 0; t < all; ++t) report_.tiles += options_.shard.has(t) ? 1 : 0;
  report_.workers =
      workers_that_fit(options_.memory, used_memory(), source_.worker_bytes(), thread_count());
}

// Pilot tiles say how much may be dropped; a journal that is continued remembers.
void Run::tune() {
  if (options_.resume) {
    const auto known = journal_thresholds(file_, run_.fingerprint, options_.shard);
    if (known) {
      report_.thresholds = *known;
      pilots_done_ = kPilotTiles;
      return;
    }
  }
  const auto scout = source_.make_worker();
  int seen = 0;
  const std::vector<int> pilots = choose_pilots(*scout, order_, seen);
  report_.ray_counts += scout->counts;
  tuner_.emplace(source_.layout(), options_.error);
  report_.ray_counts +=
      trace_pilots(source_, order_, pilots, report_.workers, *tuner_, [&](int count) {
        pilots_done_ += count;
        tell();
        if (options_.time_limit > 0 && pilots_done_ < static_cast<int>(pilots.size()) &&
            seconds_since(start_) > 0.7 * options_.time_limit) {
          throw PilotsCut{RunEnd::time_limit};
        }
      });
  pilots_done_ = kPilotTiles;
  report_.thresholds = tuner_->thresholds(seen);
  if (options_.max_bytes > 0 && seen > 0) {
    // A tenth more than fits: what is too much is known exactly in the end, and dropped then.
    const double entries =
        static_cast<double>(options_.max_bytes - transport_overhead_bytes(run_.info));
    const std::vector<float> smaller = tuner_->thresholds_for_size(1.1 * entries / seen, seen);
    report_.limited_by_size = smaller != report_.thresholds;
    report_.thresholds = smaller;
  }
}

// Tells the caller how far it is. Requires that no other thread does.
void Run::tell() {
  const int done = report_.resumed_tiles + (report_.tiles_traced - report_.resumed_tiles);
  if (options_.watch && queue_) {
    PrecomputeStatus status;
    status.tiles = report_.tiles;
    status.tiles_done = done;
    status.rays = running_.rays();
    status.seconds = seconds_since(tracing_since_);
    options_.watch(status);
  }
  const double share = static_cast<double>(done + pilots_done_) / (report_.tiles + kPilotTiles);
  if (progress_ && !progress_(std::min(1.0, share))) {
    if (!queue_) throw PilotsCut{RunEnd::stopped};
    queue_->stop(RunEnd::stopped);
  }
}

double Run::assembly_seconds() const {
  if (options_.shard.count > 1) return 0;
  const double tiles = std::max(1, report_.tiles_traced);
  const double bytes = static_cast<double>(journal_bytes_) / tiles * report_.tiles;
  return kAssemblySeconds + bytes / kAssemblyBytesPerSecond * (options_.max_bytes > 0 ? 2 : 1);
}

// A finished tile into the journal.
void Run::took(const std::vector<std::byte>& record, double tile_seconds) {
  writer_->write_record(record);
  const std::lock_guard lock(mutex_);
  ++report_.tiles_traced;
  journal_bytes_ += record.size();
  queue_->learn(tile_seconds, assembly_seconds());
  tell();
}

struct Traced {
  std::vector<std::byte> record;
  StageSeconds seconds;
};

Traced trace_tile(TileSource::Worker& worker, const HaarLayout& layout, int tile,
                  std::span<const std::uint32_t> outputs, std::span<const float> thresholds,
                  TileRows& rows) {
  Traced made;
  const auto begin = Clock::now();
  worker.transform_seconds = 0;
  worker.trace(outputs, rows);
  const auto traced = Clock::now();
  made.record = pack_record(tile, make_tile_record(layout, tile, rows, thresholds));
  made.seconds.trace = seconds_between(begin, traced);
  made.seconds.transform = worker.transform_seconds;
  made.seconds.compress = seconds_since(traced);
  return made;
}

// Every tile by itself: trace, transform, compress, append.
void Run::work_here(TileQueue& queue) {
  parallel_for(report_.workers, [&](int) {
    const std::unique_ptr<TileSource::Worker> worker = source_.make_worker();
    TileRows rows;
    RayCounts known;
    try {
      while (const std::optional<int> tile = queue.next()) {
        Traced made =
            trace_tile(*worker, source_.layout(), *tile, outputs(*tile), report_.thresholds, rows);
        std::int64_t blocks = 0, rgb_blocks = 0;
        for (std::size_t b = 0; b < kTileBlocks; ++b) {
          const auto first = rows.coverage.begin() + static_cast<std::ptrdiff_t>(b * kBlockRows);
          if (std::any_of(first, first + kBlockRows, [](float c) { return c > 0; })) ++blocks;
          if (rows.rgb_blocks >> b & 1u) ++rgb_blocks;
        }
        {
          const std::lock_guard lock(mutex_);
          report_.blocks += blocks;
          report_.rgb_blocks += rgb_blocks;
          report_.stages += made.seconds;
          running_ += worker->counts;
          worker->counts = {};
        }
        const auto begin = Clock::now();
        took(made.record, made.seconds.trace + made.seconds.compress);
        const std::lock_guard lock(mutex_);
        report_.stages.write += seconds_since(begin);
      }
    } catch (...) {
      queue.stop(RunEnd::stopped);
      throw;
    }
  });
}

// Leader: traces with its own threads, and lets another serve the other processes.
void Run::trace_all() {
  std::vector<int> pending;
  for (int t = 0; t < writer_->tile_count(); ++t) {
    if (!options_.shard.has(t)) continue;
    if (writer_->has_tile(t)) {
      ++report_.resumed_tiles;
      journal_bytes_ += writer_->record_bytes(t);
    } else {
      pending.push_back(t);
    }
  }
  report_.tiles_traced = report_.resumed_tiles;
  tracing_since_ = Clock::now();
  double each = 0;
  if (options_.time_limit > 0 && options_.shard.count == 1 && !pending.empty()) {
    double estimate = 0;
    choose_grain(*source_.make_worker(), source_.layout(), report_.thresholds, order_, pending,
                 kPreviewShareOfLimit * options_.time_limit, report_.workers, estimate);
    if (options_.max_bytes > 0) estimate *= 2;  // made for finding the size, and once more
    each = estimate / static_cast<double>(pending.size());
  }
  queue_.emplace(std::move(pending));
  if (options_.time_limit > 0) {
    queue_->set_limit(start_ + std::chrono::duration_cast<Clock::duration>(
                                   std::chrono::duration<double>(options_.time_limit)),
                      assembly_seconds(), each);
  }
  {
    const std::lock_guard lock(mutex_);
    tell();
  }

  std::string failure;
  std::exception_ptr failed_here;
  std::thread server;
  if (options_.distribution) {
    server = std::thread([&] {
      const auto take = [&](const std::vector<std::byte>& record) {
        if (failed_here) return;
        try {
          took(record, 0);
        } catch (...) {
          failed_here = std::current_exception();
          queue_->stop(RunEnd::stopped);
        }
      };
      options_.distribution->serve([&] { return queue_->next(); }, take,
                                   [&](const std::string& message) {
                                     if (failure.empty()) failure = message;
                                     queue_->stop(RunEnd::stopped);
                                   },
                                   [&] {
                                     const std::lock_guard lock(mutex_);
                                     tell();
                                   });
    });
  }
  std::exception_ptr failed;
  try {
    work_here(*queue_);
  } catch (...) {
    failed = std::current_exception();
  }
  if (server.joinable()) server.join();
  if (!failed) failed = failed_here;
  if (failed) std::rethrow_exception(failed);
  if (!failure.empty()) throw Error(ErrorKind::io, failure);
  report_.end = queue_->end();
}

// Other processes: ask, trace, hand in.
void Run::follow() {
  Distribution& others = *options_.distribution;
  std::mutex once;
  std::string failure;
  std::atomic<bool> failed{false};  // ends the other threads of this process at their next tile
  parallel_for(report_.workers, [&](int) {
    try {
      const std::unique_ptr<TileSource::Worker> worker = source_.make_worker();
      TileRows rows;
      std::vector<std::byte> record;
      while (!failed) {
        const std::optional<int> tile = others.exchange(record);
        if (!tile) break;
        Traced made =
            trace_tile(*worker, source_.layout(), *tile, outputs(*tile), report_.thresholds, rows);
        record = std::move(made.record);
        const std::lock_guard lock(mutex_);
        report_.stages += made.seconds;
        report_.ray_counts += worker->counts;
        worker->counts = {};
      }
    } catch (const std::exception& error) {
      failed = true;
      const std::lock_guard lock(once);
      if (failure.empty()) failure = fmt::format("process {}: {}", others.rank(), error.what());
    }
  });
  others.leave(failure);
  if (!failure.empty()) throw Error(ErrorKind::io, failure);
}

// Whether a preview may take the place of what is there: nothing, or an earlier preview.
bool Run::may_replace() const {
  std::error_code code;
  if (!std::filesystem::exists(file_, code)) return true;
  try {
    const auto meta = nlohmann::json::parse(Transport::open(file_).info().meta, nullptr, false);
    return meta.is_object() && meta.contains("complete") && meta["complete"] == false;
  } catch (const Error&) {
    return false;
  }
}

void Run::write_preview(std::vector<int> missing) {
  if (report_.end == RunEnd::stopped && !may_replace()) {
    writer_.reset();
    return;
  }
  const double budget = options_.time_limit > 0 ? kPreviewShareOfLimit * options_.time_limit
                                                : kPreviewSecondsAfterStop;
  double estimate = 0;
  const PreviewGrain grain =
      choose_grain(*source_.make_worker(), source_.layout(), report_.thresholds, order_, missing,
                   options_.max_bytes > 0 ? budget / 2 : budget, report_.workers, estimate);
  Preview preview(source_, order_, grain, report_.thresholds);
  FinishOptions finishing;
  finishing.workers = report_.workers;
  finishing.stand_in = [&](int tile) { return preview.record(tile); };
  TransportSummary summary;
  if (writer_) {
    writer_->keep();
    summary = writer_->finish(run_.meta, finishing);
  } else {
    summary = TransportWriter::write_stand_ins(file_, run_.info, writing(), finishing);
  }
  report_.bytes = summary.bytes;
  report_.measured_error = summary.measured_error;
  report_.noise = summary.noise;
}

// The run ended before thresholds were known: those of what was seen so far must do.
void Run::preview_only(RunEnd why) {
  report_.end = why;
  if (options_.shard.count > 1) return;
  std::vector<int> missing;
  for (int t = 0; t < report_.tiles; ++t) missing.push_back(t);
  if (!tuner_) tuner_.emplace(source_.layout(), options_.error);
  const auto worker = source_.make_worker();
  TileRows rows;
  constexpr std::size_t kGlances = 8;
  for (std::size_t i = 0; i < kGlances; ++i) {
    const int tile = missing[(2 * i + 1) * missing.size() / (2 * kGlances)];
    trace_preview(*worker, outputs(tile), false, rows);
    tuner_->add(rows);
  }
  report_.thresholds = tuner_->thresholds();
  write_preview(std::move(missing));
}

void Run::finish() {
  report_.ray_counts += running_;
  report_.complete = report_.tiles_traced == report_.tiles;
  if (report_.complete) report_.end = RunEnd::done;
  const auto begin = Clock::now();
  if (options_.shard.count > 1) {
    writer_->keep();
  } else if (report_.complete) {
    FinishOptions finishing;
    finishing.workers = report_.workers;
    const TransportSummary summary = writer_->finish(run_.meta, finishing);
    report_.bytes = summary.bytes;
    report_.measured_error = summary.measured_error;
    report_.noise = summary.noise;
    if (summary.size_threshold > 0) report_.limited_by_size = true;
  } else {
    writer_->keep();
    write_preview(queue_->left());
  }
  report_.stages.assemble = seconds_since(begin);
}

PrecomputeReport Run::go() {
  std::optional<PilotsCut> cut;
  together(options_.distribution, [&] {
    prepare();
    if (!leads()) return;
    try {
      tune();
    } catch (const PilotsCut& pilots) {
      cut = pilots;
      return;
    }
    report_.pilot_seconds = seconds_since(start_);
    writer_.emplace(file_, run_.info, writing());
  });
  if (options_.distribution) {
    std::vector<std::byte> bytes(report_.thresholds.size() * sizeof(float));
    if (cut) bytes.clear();
    if (!bytes.empty()) std::memcpy(bytes.data(), report_.thresholds.data(), bytes.size());
    bytes = options_.distribution->broadcast(bytes);
    if (!leads() && !bytes.empty()) {
      report_.thresholds.resize(bytes.size() / sizeof(float));
      std::memcpy(report_.thresholds.data(), bytes.data(), bytes.size());
      follow();
    }
  }
  if (leads() && cut) {
    preview_only(cut->why);
  } else if (leads()) {
    trace_all();
    finish();
  }
  report_.rays = report_.ray_counts.rays();
  report_.seconds = seconds_since(start_);
  return report_;
}

}  // namespace

PrecomputeReport run_tiles(const TileSource& source, const TileRun& run, const RunOptions& options,
                           const std::filesystem::path& file, const Progress& progress) {
  return Run(source, run, options, file, progress).go();
}

}  // namespace haarlight
