// Hands values from one thread to another: the reader always gets the newest complete one, the
// writer never waits, and nothing is torn.

#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace haarlight::viewer {

/// One writer thread, one reader thread. Three values take turns: one being written, one being
/// read, one in between.
template <typename T>
class TripleBuffer {
 public:
  /// The writer's value; holds something old, to be overwritten.
  T& back() { return values_[back_]; }
  /// Makes back() the newest, in place of one that was not read yet.
  void publish() {
    const std::uint8_t old =
        middle_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel);
    back_ = old & kIndex;
  }

  /// Makes front() the newest; false if it was already.
  bool update() {
    if (!(middle_.load(std::memory_order_relaxed) & kFresh)) return false;
    const std::uint8_t old = middle_.exchange(front_, std::memory_order_acq_rel);
    front_ = old & kIndex;
    return true;
  }
  /// Whether the newest was not read yet. For either thread.
  bool unread() const { return middle_.load(std::memory_order_acquire) & kFresh; }
  /// The reader's value; stays the same until update().
  const T& front() const { return values_[front_]; }

 private:
  static constexpr std::uint8_t kFresh = 4, kIndex = 3;
  std::array<T, 3> values_{};
  std::atomic<std::uint8_t> middle_{1};
  std::uint8_t back_ = 0, front_ = 2;
};

}  // namespace haarlight::viewer
