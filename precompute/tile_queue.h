// Hands out the tiles of a run until it ends.

#pragma once

#include <chrono>
#include <cstddef>
#include <mutex>
#include <optional>
#include <vector>

#include "precompute/run_options.h"

namespace haarlight {

/// Thread-safe.
class TileQueue {
 public:
  using Clock = std::chrono::steady_clock;

  /// `pending` in the order in which they go out.
  explicit TileQueue(std::vector<int> pending) : pending_(std::move(pending)) {}

  /// No tile goes out that would not be done, with all that must come after it, by `end`: `after`
  /// seconds for what comes last, and `each` more for every tile that was not traced.
  void set_limit(Clock::time_point end, double after, double each);
  /// Last word on what a tile takes and what comes last.
  void learn(double tile_seconds, double after);

  std::optional<int> next();
  void stop(RunEnd why);          ///< from here on nothing goes out
  RunEnd end() const;             ///< done unless stopped
  std::vector<int> left() const;  ///< what did not go out

 private:
  mutable std::mutex mutex_;
  std::vector<int> pending_;
  std::size_t at_ = 0;
  bool stopped_ = false;
  RunEnd why_ = RunEnd::done;
  std::optional<Clock::time_point> limit_;
  double longest_ = 0, after_ = 0, each_ = 0;
};

}  // namespace haarlight
