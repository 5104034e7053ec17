// Hands out the tiles of a run until it ends.

#include "precompute/tile_queue.h"

#include <algorithm>

namespace haarlight {

void TileQueue::set_limit(Clock::time_point end, double after, double each) {
  const std::lock_guard lock(mutex_);
  limit_ = end;
  after_ = after;
  each_ = each;
}

void TileQueue::learn(double tile_seconds, double after) {
  const std::lock_guard lock(mutex_);
  longest_ = std::max(longest_, tile_seconds);
  after_ = after;
}

std::optional<int> TileQueue::next() {
  const std::lock_guard lock(mutex_);
  if (stopped_ || at_ == pending_.size()) return std::nullopt;
  if (limit_) {
    const double left = std::chrono::duration<double>(*limit_ - Clock::now()).count();
    const double needed = longest_ + after_ + each_ * static_cast<double>(pending_.size() - at_);
    if (left < needed) {
      stopped_ = true;
      why_ = RunEnd::time_limit;
      return std::nullopt;
    }
  }
  return pending_[at_++];
}

void TileQueue::stop(RunEnd why) {
  const std::lock_guard lock(mutex_);
  if (stopped_) return;
  stopped_ = true;
  why_ = why;
}

RunEnd TileQueue::end() const {
  const std::lock_guard lock(mutex_);
  return why_;
}

std::vector<int> TileQueue::left() const {
  const std::lock_guard lock(mutex_);
  return {pending_.begin() + static_cast<std::ptrdiff_t>(at_), pending_.end()};
}

}  // namespace haarlight
