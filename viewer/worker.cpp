// The relighting thread.

#include "viewer/worker.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <new>
#include <optional>
#include <utility>

namespace haarlight::viewer {
namespace {

using Clock = std::chrono::steady_clock;

// A frame that was late does not make the motion jump by more than this.
constexpr double kMostTicks = 6;

/// What to tell a person once an action is done; nothing where the picture says it.
std::optional<std::string> done_text(const ViewAction& action) {
  struct Teller {
    std::optional<std::string> operator()(const OpenTransport& a) const {
      return "opened " + a.file.filename().string();
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
  return std::visit(Teller{}, action);
}

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

}  // namespace

Worker::Worker(std::function<void()> wake, double frames_per_second)
    : wake_(std::move(wake)), period_(1 / frames_per_second), thread_([this] { run(); }) {}

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
    idle_ = false;
  }
  changed_.notify_one();
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

void Worker::run() {
  Session session;
  ViewSettings settings;
  std::vector<ViewAction> actions;
  bool failed = false;  // a frame that failed would fail again: wait for something new
  Clock::time_point last = Clock::now();
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      if (!dirty_ && actions_.empty() && (failed || session.resting(settings_))) {
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
        if (auto text = done_text(action)) note({std::move(*text), false});
      } catch (const std::bad_alloc&) {
        note({"not enough memory for this, expected more or a smaller file", true});
      } catch (const std::exception& error) {
        note({error.what(), true});
      }
    }

    const Clock::time_point begin = Clock::now();
    const double elapsed = std::chrono::duration<double>(begin - last).count();
    last = begin;
    try {
      if (session.advance(settings, std::clamp(elapsed * 60, 0.0, kMostTicks), frames_.back())) {
        frames_.publish();
        wake_();
      }
    } catch (const std::exception& error) {
      failed = true;
      note({error.what(), true});
    }

    // No faster than frames are shown. New settings wait for the end of the period too, so that a
    // drag does not make frames that nobody sees.
    std::this_thread::sleep_until(begin + std::chrono::duration_cast<Clock::duration>(
                                              std::chrono::duration<double>(period_)));
  }
}

}  // namespace haarlight::viewer
