// Relights on a thread of its own, so that the window never waits for a frame.

#pragma once

#include <condition_variable>
#include <cstddef>
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

/// How fast a worker goes.
struct WorkerPace {
  double frames_per_second = 60;  ///< at most
  /// More than 0: so many frames and no more, each a tick of the motion, those at rest too, and
  /// none is made before the last one is taken.
  int frames = 0;
};

/// A session behind a mailbox. Settings: the newest count; actions: all, in order. Frames come
/// through three buffers: a slow one is late, never torn, and the window waits for none. The next
/// one is begun when the last one is taken, so that a slow display does not cost frames that nobody
/// sees; a window that takes none for a quarter of a second is not waited for. Sleeps while the
/// session rests.
class Worker {
 public:
  /// `wake` is called from the worker's thread after a frame or a notice.
  explicit Worker(std::function<void()> wake, WorkerPace pace = {});
  ~Worker();

  void set(const ViewSettings& settings);
  void act(ViewAction action);

  /// Whether an action that was handed in is not done yet.
  bool busy() const;

  /// Makes frame() the newest; false if it was already.
  bool update();
  const ViewFrame& frame() const { return frames_.front(); }

  /// What was noted since the last call.
  std::vector<Notice> take_notices();
  /// Whether everything handed in is done, and the session rests.
  bool idle() const;

 private:
  void run();
  bool make_frame(Session& session, const ViewSettings& settings, double ticks);
  void note(Notice notice);

  std::function<void()> wake_;
  WorkerPace pace_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  ViewSettings settings_;
  std::vector<ViewAction> actions_;
  std::vector<Notice> notices_;
  std::size_t undone_ = 0;  // of the actions handed in
  bool dirty_ = false, quit_ = false, idle_ = true;
  TripleBuffer<ViewFrame> frames_;
  std::thread thread_;
};

}  // namespace haarlight::viewer
