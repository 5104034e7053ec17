// A person's doings from a file: keys, clicks, drags and drops, for tests and for pictures of the
// window. docs/viewer.md lists the commands.

#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "viewer/interface.h"
#include "viewer/window.h"
#include "viewer/worker.h"

namespace haarlight::viewer {

/// Runs one line after the other, over as many frames of the window as each takes.
class Script {
 public:
  /// Throws Error{missing}, Error{io} or, naming the line, Error{format}.
  explicit Script(const std::filesystem::path& file);

  /// Before a frame of the window: sends what is next.
  void before_frame(Window& window, Interface& interface, const Worker& worker, bool shown_newest);
  /// After everything is drawn: pictures and expectations. Throws Error for one that does not hold.
  void after_frame(Window& window, const Interface& interface, const Worker& worker);

  const ScriptedPointer& pointer() const { return pointer_; }
  bool done() const { return next_ >= lines_.size() && steps_.empty(); }
  bool wants_close() const { return close_; }
  /// Whether the window is being watched at rest: nothing is to be drawn on the script's account.
  bool resting() const { return resting_ || (settling_ && steps_.empty()); }

 private:
  struct Line {
    std::size_t number;
    std::string command;
    std::vector<std::string> words;
    std::string rest;
  };
  using StepFunction = std::function<void(Window&)>;

  void begin(const Line& line, Window& window, Interface& interface);
  Interface::Area area(const Line& line, const std::string& name, const Interface& interface) const;
  void point(float x, float y, bool down, int button = 0);
  [[noreturn]] void fail(const Line& line, const std::string& what) const;
  double number(const Line& line, std::size_t word) const;

  std::string name_;
  std::vector<Line> lines_;
  std::size_t next_ = 0;
  std::deque<StepFunction> steps_;  // one a frame
  ScriptedPointer pointer_;
  bool settling_ = false, resting_ = false, close_ = false;
  std::chrono::steady_clock::time_point since_;
  double rest_seconds_ = 0, rest_cpu_ = 0;
  const Line* after_ = nullptr;  // waits for the frame to be drawn
};

}  // namespace haarlight::viewer
