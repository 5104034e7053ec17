// How a precomputation runs, and what it says of itself; the same for pictures and meshes.

#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "precompute/point_tracer.h"
#include "prt/transport_writer.h"

namespace haarlight {

class Distribution;  // precompute/distribution.h

/// How far a run is, for people who wait for it.
struct PrecomputeStatus {
  int tiles = 0, tiles_done = 0;  ///< of this run; done: with those found in the journal
  std::int64_t rays = 0;          ///< traced so far by this process
  double seconds = 0;             ///< since the first tile was begun
};

/// How a run goes, whatever it traces.
struct RunOptions {
  double error = 0.01;  ///< relative picture error that compression may cost, [0, 1); 0: drop
                        ///< nothing but what 8 bits cannot hold
  bool resume = false;  ///< go on with the journal if it was made from the same input
  Shard shard{};        ///< trace this slice only, into journal_path(FILE, shard), to be joined by
                        ///< merge_transport; no file is made
  double time_limit = 0;        ///< seconds that the call may take; 0: none. What is not traced by
                                ///< then is a preview in the file
  std::uint64_t max_bytes = 0;  ///< that the file may have; 0: no limit. Goes before `error`
  std::uint64_t memory = 0;     ///< bytes that the process may use; 0: half of what is free
  std::filesystem::path scene_file{};    ///< where the scene came from, if from a file: its place
                                         ///< beside the output and its hash are kept in the file
  Distribution* distribution = nullptr;  ///< other processes that take part; not owned
  /// Told of every finished tile, never by two threads at once, just before Progress is.
  std::function<void(const PrecomputeStatus&)> watch{};
};

/// Why a run ended.
enum class RunEnd {
  done,       ///< all is traced
  stopped,    ///< Progress said so
  time_limit  ///< RunOptions::time_limit
};

/// Seconds of work, summed over threads.
struct StageSeconds {
  double trace = 0;      ///< rays, and from them exact rows; with transform
  double transform = 0;  ///< part of trace: the wavelet transform
  double compress = 0;   ///< dropping, rounding, measuring
  double write = 0;      ///< to the journal
  double assemble = 0;   ///< from the journal to the file: wall time
  StageSeconds& operator+=(const StageSeconds& o) {
    trace += o.trace, transform += o.transform, compress += o.compress;
    write += o.write, assemble += o.assemble;
    return *this;
  }
};

/// What a run did. Times and rays of a resumed run are those of this run alone, of a distributed
/// one those of the calling process.
struct PrecomputeReport {
  std::int64_t rays = 0;      ///< traced, of all kinds
  RayCounts ray_counts;       ///< the same in detail
  std::uint64_t bytes = 0;    ///< of the file; 0: none was made (a shard; stopped too early)
  double measured_error = 0;  ///< largest relative picture error over the built-in lightings
  double noise = 0;           ///< largest relative noise over the same, estimated; 0: none
  double seconds = 0;         ///< wall time of all of it
  double pilot_seconds = 0;   ///< of that, choosing the thresholds
  StageSeconds stages;        ///< without pilots
  RunEnd end = RunEnd::done;
  bool complete = false;           ///< every tile of the transport (or shard) is traced
  bool limited_by_size = false;    ///< max_bytes asked for more dropping than `error` would
  int workers = 0;                 ///< threads that traced: as many as memory allows
  int tiles = 0;                   ///< to trace: of the transport, or of the shard
  int resumed_tiles = 0;           ///< of those, found in the journal
  int tiles_traced = 0;            ///< of those, traced by now, in this run and before
  std::int64_t blocks = 0;         ///< traced now, of 16 rows with something to see
  std::int64_t rgb_blocks = 0;     ///< of those, with three channels
  std::vector<float> thresholds;   ///< per band
  std::vector<std::string> notes;  ///< see precompute/scene_notes.h
};

}  // namespace haarlight
