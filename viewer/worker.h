// Relights on a thread of its own, so that the window never waits for a frame.

#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "viewer/session.h"
#include "viewer/settings.h"
#include "viewer/triple_buffer.h"
#include "viewer/view_frame.h"

namespace haarlight::viewer {

/// What became of an action, or of a frame that failed.
struct Notice {
  std::string text;  ///< one line
  bool failed = false;
};

/// A session behind a mailbox. Settings: the newest count; actions: all, in order. Frames come
/// through three buffers: a slow one is late, never torn, and none is waited for. Sleeps while the
/// session rests.
class Worker {
 public:
  /// `wake` is called from the worker's thread after a frame or a notice. `frames_per_second`
  /// bounds how often the session advances.
  explicit Worker(std::function<void()> wake, double frames_per_second = 60);
  ~Worker();

  void set(const ViewSettings& settings);
  void act(ViewAction action);

  /// Makes frame() the newest; false if it was already.
  bool update() { return frames_.update(); }
  const ViewFrame& frame() const { return frames_.front(); }

  /// What was noted since the last call.
  std::vector<Notice> take_notices();
  /// Whether everything handed in is done, and the session rests.
  bool idle() const;

 private:
  void run();
  void note(Notice notice);

  std::function<void()> wake_;
  double period_;  // seconds
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  ViewSettings settings_;
  std::vector<ViewAction> actions_;
  std::vector<Notice> notices_;
  bool dirty_ = false, quit_ = false, idle_ = true;
  TripleBuffer<ViewFrame> frames_;
  std::thread thread_;
};

}  // namespace haarlight::viewer
