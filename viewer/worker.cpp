// The relighting thread.

#include "viewer/worker.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <new>
#include <optional>
#include <utility>

#include "prt/completeness.h"

namespace haarlight::viewer {
namespace {

using Clock = std::chrono::steady_clock;

// A frame that was late does not make the motion jump by more than this.
constexpr double kMostTicks = 6;
// A hidden window may take no frames: motion and recordings go on without it.
constexpr std::chrono::milliseconds kLongestWait{250};

/// What to tell a person once an action is done; nothing where the picture says it.
std::optional<std::string> done_text(const ViewAction& action, const Session& session) {
  struct Teller {
    const Session& session;
    std::optional<std::string> operator()(const OpenTransport& a) const {
      const std::string missing = incomplete_note(session.transport()->info().meta);
      return "opened " + a.file.filename().string() +
             (missing.empty() ? "" : ", incomplete: " + missing);
    }
    std::optional<std::string> operator()(const OpenEnvironment& a) const {
      return "opened " + a.file.filename().string();
    }
    std::optional<std::string> operator()(const StopRecording& a) const {
      return "wrote " + a.file.string();
    }
    std::optional<std::string> operator()(const SavePicture& a) const {
      return "wrote " + a.file.string();
    }
    std::optional<std::string> operator()(const SetBlend&) const { return std::nullopt; }
    std::optional<std::string> operator()(const Restart&) const { return std::nullopt; }
    std::optional<std::string> operator()(const Rewind&) const { return std::nullopt; }
    std::optional<std::string> operator()(const Step&) const { return std::nullopt; }
    std::optional<std::string> operator()(const StartRecording&) const { return "recording"; }
  };
  return std::visit(Teller{session}, action);
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

}  // namespace

Worker::Worker(std::function<void()> wake, WorkerPace pace)
    : wake_(std::move(wake)), pace_(pace), thread_([this] { run(); }) {}

Worker::~Worker() {
  {
    const std::lock_guard lock(mutex_);
    quit_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void Worker::set(const ViewSettings& settings) {
  {
    const std::lock_guard lock(mutex_);
    if (settings == settings_) return;
    settings_ = settings;
    dirty_ = true;
    idle_ = false;
  }
  changed_.notify_one();
}

void Worker::act(ViewAction action) {
  {
    const std::lock_guard lock(mutex_);
    actions_.push_back(std::move(action));
    ++undone_;
    idle_ = false;
  }
  changed_.notify_one();
}

bool Worker::busy() const {
  const std::lock_guard lock(mutex_);
  return undone_ > 0;
}

bool Worker::update() {
  if (!frames_.update()) return false;
  // The lock makes sure that the worker either sees the frame taken or hears that it was.
  { const std::lock_guard lock(mutex_); }
  changed_.notify_one();
  return true;
}

std::vector<Notice> Worker::take_notices() {
  const std::lock_guard lock(mutex_);
  return std::exchange(notices_, {});
}

bool Worker::idle() const {
  const std::lock_guard lock(mutex_);
  return idle_;
}

void Worker::note(Notice notice) {
  notice.text = one_line(std::move(notice.text));
  {
    const std::lock_guard lock(mutex_);
    notices_.push_back(std::move(notice));
  }
  wake_();
}

bool Worker::make_frame(Session& session, const ViewSettings& settings, double ticks) {
  if (pace_.frames == 0) return session.advance(settings, ticks, frames_.back());
  // A frame that would repeat the last one is asked for all the same.
  if (session.resting(settings)) session.act(Step{});
  if (session.advance(settings, 1, frames_.back())) return true;
  session.act(Step{});
  return session.advance(settings, 1, frames_.back());
}

void Worker::run() {
  Session session;
  ViewSettings settings;
  std::vector<ViewAction> actions;
  bool failed = false;  // a frame that failed would fail again: wait for something new
  int made = 0;
  Clock::time_point last = Clock::now();
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      const auto taken = [this] { return quit_ || !frames_.unread(); };
      if (pace_.frames > 0) {
        changed_.wait(lock, taken);
      } else {
        changed_.wait_for(lock, kLongestWait, taken);
      }
      const bool over = pace_.frames > 0 && made >= pace_.frames;
      const bool resting = pace_.frames > 0 ? over || !session.ready() : session.resting(settings_);
      if (!dirty_ && actions_.empty() && (failed || resting)) {
        if (!idle_) {
          idle_ = true;
          lock.unlock();
          wake_();
          lock.lock();
        }
        changed_.wait(lock, [this] { return quit_ || dirty_ || !actions_.empty(); });
        last = Clock::now();
      }
      if (quit_) return;
      settings = settings_;
      actions.clear();
      std::swap(actions, actions_);
      if (dirty_ || !actions.empty()) failed = false;
      dirty_ = false;
    }
    for (const ViewAction& action : actions) {
      try {
        session.act(action);
        if (auto text = done_text(action, session)) note({std::move(*text), false});
      } catch (const std::bad_alloc&) {
        note({"not enough memory for this, expected more or a smaller file", true});
      } catch (const std::exception& error) {
        note({error.what(), true});
      }
    }
    {
      const std::lock_guard lock(mutex_);
      undone_ -= actions.size();
    }

    const Clock::time_point begin = Clock::now();
    const double elapsed = std::chrono::duration<double>(begin - last).count();
    last = begin;
    try {
      const bool over = pace_.frames > 0 && made >= pace_.frames;
      if (!over && make_frame(session, settings, std::clamp(elapsed * 60, 0.0, kMostTicks))) {
        ++made;
        frames_.publish();
        wake_();
      }
    } catch (const std::exception& error) {
      failed = true;
      note({error.what(), true});
    }

    // No faster than frames are shown. New settings wait for the end of the period too, so that a
    // drag does not make frames that nobody sees.
    std::this_thread::sleep_until(begin +
                                  std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(1 / pace_.frames_per_second)));
  }
}

}  // namespace haarlight::viewer
