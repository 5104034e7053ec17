// Reads and plays scripts.

#include "viewer/script.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <utility>

#include "core/error.h"
#include "core/image_io.h"

namespace haarlight::viewer {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kMostSettling = 120;  // seconds
constexpr int kDragSteps = 12;

double processor_seconds() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// GLFW's number of a key by name; 0 for another word.
int key_of(const std::string& name) {
  static const std::pair<const char*, int> names[] = {
      {"space", GLFW_KEY_SPACE}, {"tab", GLFW_KEY_TAB},        {"escape", GLFW_KEY_ESCAPE},
      {"enter", GLFW_KEY_ENTER}, {"period", GLFW_KEY_PERIOD},  {"minus", GLFW_KEY_MINUS},
      {"equal", GLFW_KEY_EQUAL}, {"[", GLFW_KEY_LEFT_BRACKET}, {"]", GLFW_KEY_RIGHT_BRACKET}};
  for (const auto& [word, key] : names) {
    if (name == word) return key;
  }
  if (name.size() == 1 && name[0] >= 'a' && name[0] <= 'z') return GLFW_KEY_A + name[0] - 'a';
  if (name.size() == 1 && name[0] >= '0' && name[0] <= '9') return GLFW_KEY_0 + name[0] - '0';
  return 0;
}

}  // namespace

Script::Script(const std::filesystem::path& file) : name_(file.string()) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    throw Error(ErrorKind::missing, name_ + ": no such file, expected a script");
  }
  std::ifstream stream(file);
  if (!stream) throw Error(ErrorKind::io, name_ + ": cannot read this file");
  std::size_t count = 0;
  for (std::string text; std::getline(stream, text);) {
    ++count;
    std::istringstream words(text);
    Line line{count, {}, {}, {}};
    if (!(words >> line.command) || line.command[0] == '#') continue;
    std::getline(words >> std::ws, line.rest);
    std::istringstream arguments(line.rest);
    for (std::string word; arguments >> word;) line.words.push_back(word);
    lines_.push_back(std::move(line));
  }
}

void Script::fail(const Line& line, const std::string& what) const {
  throw Error(ErrorKind::format,
              fmt::format("{}, line {}, {}: {}", name_, line.number, line.command, what));
}

double Script::number(const Line& line, std::size_t word) const {
  double value = 0;
  if (word < line.words.size()) {
    const std::string& text = line.words[word];
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc() && end == text.data() + text.size() && std::isfinite(value)) {
      return value;
    }
  }
  fail(line, fmt::format("word {} is no number", word + 1));
}

Interface::Area Script::area(const Line& line, const std::string& name,
                             const Interface& interface) const {
  if (name == "picture") return interface.first();
  const auto found = interface.marks().find(name);
  if (found == interface.marks().end()) fail(line, fmt::format("no widget is called '{}'", name));
  return found->second;
}

void Script::point(float x, float y, bool down, int button) {
  pointer_ = {true, x, y, down, button, 0};
}

// Puts what a line does into steps of a frame each.
void Script::begin(const Line& line, Window& window, Interface& interface) {
  const std::string& c = line.command;
  const auto rest_word = [&]() -> const std::string& {
    if (line.rest.empty()) fail(line, "stands alone, expected what to do it with");
    return line.rest;
  };
  if (c == "wait") {
    const auto frames = static_cast<int>(number(line, 0));
    for (int i = 0; i < frames; ++i) steps_.emplace_back([](Window&) {});
  } else if (c == "settle") {
    settling_ = true;
    since_ = Clock::now();
    // What the last line did must reach the worker first.
    for (int i = 0; i < 3; ++i) steps_.emplace_back([](Window&) {});
  } else if (c == "key" || c == "control") {
    const int key = key_of(rest_word());
    if (key == 0) fail(line, fmt::format("'{}' is no key", line.rest));
    const bool control = c == "control";
    if (control) {
      steps_.emplace_back(
          [](Window& w) { w.send_key(GLFW_KEY_LEFT_CONTROL, true, GLFW_MOD_CONTROL); });
    }
    steps_.emplace_back(
        [key, control](Window& w) { w.send_key(key, true, control ? GLFW_MOD_CONTROL : 0); });
    steps_.emplace_back([key](Window& w) { w.send_key(key, false, 0); });
    if (control)
      steps_.emplace_back([](Window& w) { w.send_key(GLFW_KEY_LEFT_CONTROL, false, 0); });
  } else if (c == "type") {
    const std::string text = rest_word();
    steps_.emplace_back([text](Window& w) { w.send_text(text); });
    steps_.emplace_back([](Window&) {});
  } else if (c == "click" || c == "double") {
    const Interface::Area a = area(line, rest_word(), interface);
    const float x = a.x + 0.5f * a.width, y = a.y + 0.5f * a.height;
    steps_.emplace_back([this, x, y](Window&) { point(x, y, false); });
    for (int i = 0; i < (c == "double" ? 2 : 1); ++i) {
      steps_.emplace_back([this, x, y](Window&) { point(x, y, true); });
      steps_.emplace_back([this, x, y](Window&) { point(x, y, false); });
    }
    steps_.emplace_back([](Window&) {});
  } else if (c == "wheel") {
    if (line.words.size() != 2) fail(line, "expected CLICKS NAME");
    const auto clicks = static_cast<float>(number(line, 0));
    const Interface::Area a = area(line, line.words[1], interface);
    const float x = a.x + 0.5f * a.width, y = a.y + 0.5f * a.height;
    steps_.emplace_back([this, x, y](Window&) { point(x, y, false); });
    steps_.emplace_back([this, clicks](Window&) { pointer_.scroll = clicks; });
    steps_.emplace_back([this](Window&) { pointer_.scroll = 0; });
  } else if (c == "drag" || c == "drag_right" || c == "drag_middle") {
    // drag X1 Y1 X2 Y2 NAME: from one place of a widget to another, in shares of its size.
    const int button = c == "drag" ? 0 : c == "drag_right" ? 1 : 2;
    if (line.words.size() < 5) fail(line, "expected X1 Y1 X2 Y2 NAME");
    std::string name = line.words[4];
    for (std::size_t i = 5; i < line.words.size(); ++i) name += " " + line.words[i];
    const Interface::Area a = area(line, name, interface);
    const auto place = [&](double share) {
      const double x = number(line, 0) + share * (number(line, 2) - number(line, 0));
      const double y = number(line, 1) + share * (number(line, 3) - number(line, 1));
      return std::pair{a.x + static_cast<float>(x) * a.width,
                       a.y + static_cast<float>(y) * a.height};
    };
    const auto put = [&](double share, bool down) {
      const auto [x, y] = place(share);
      steps_.emplace_back(
          [this, x = x, y = y, down, button](Window&) { point(x, y, down, button); });
    };
    put(0, false);
    for (int i = 0; i <= kDragSteps; ++i) put(static_cast<double>(i) / kDragSteps, true);
    put(1, false);
  } else if (c == "drop") {
    const std::filesystem::path file = rest_word();
    steps_.emplace_back([file](Window& w) { w.drop(file); });
    steps_.emplace_back([](Window&) {});
  } else if (c == "resize") {
    const auto width = static_cast<int>(number(line, 0)),
               height = static_cast<int>(number(line, 1));
    steps_.emplace_back(
        [width, height](Window& w) { glfwSetWindowSize(w.handle(), width, height); });
    for (int i = 0; i < 4; ++i) steps_.emplace_back([](Window&) {});
  } else if (c == "rest") {
    rest_seconds_ = number(line, 0);
    resting_ = true;
    since_ = Clock::now();
    rest_cpu_ = processor_seconds();
  } else if (c == "shot" || c == "shot_picture" || c == "expect_message" || c == "expect_method" ||
             c == "expect_inside") {
    rest_word();
    after_ = &line;
  } else if (c == "close") {
    close_ = true;
  } else {
    fail(line, "is no command");
  }
  (void)window;
}

void Script::before_frame(Window& window, Interface& interface, const Worker& worker,
                          bool shown_newest) {
  if (resting_) {
    const double seconds = seconds_since(since_);
    if (seconds < rest_seconds_) return;
    resting_ = false;
    fmt::print("rest_cpu_percent {:.2f}\n", 100 * (processor_seconds() - rest_cpu_) / seconds);
    std::fflush(stdout);
  }
  if (!steps_.empty()) {
    const StepFunction step = std::move(steps_.front());
    steps_.pop_front();
    step(window);
    return;
  }
  if (settling_) {
    if (!(worker.idle() && shown_newest)) {
      if (seconds_since(since_) > kMostSettling) {
        fail(lines_[next_ - 1], fmt::format("did not come to rest in {} s", kMostSettling));
      }
      return;
    }
    settling_ = false;
  }
  if (next_ < lines_.size()) begin(lines_[next_++], window, interface);
}

void Script::after_frame(Window& window, const Interface& interface, const Worker& worker) {
  if (!after_) return;
  const Line& line = *std::exchange(after_, nullptr);
  if (line.command == "shot") {
    int width = 0, height = 0;
    window.framebuffer(width, height);
    save_image(line.rest, window.read_pixels(0, 0, width, height));
  } else if (line.command == "shot_picture") {
    const Interface::Area& a = interface.first();
    const auto pixels = [&](float units) {
      return static_cast<int>(std::lround(static_cast<double>(units) * window.pixel_ratio()));
    };
    if (a.empty()) fail(line, "no picture is shown");
    save_image(line.rest,
               window.read_pixels(pixels(a.x), pixels(a.y), pixels(a.width), pixels(a.height)));
  } else if (line.command == "expect_message") {
    if (interface.message().find(line.rest) == std::string::npos) {
      fail(line, fmt::format("the message is '{}'", interface.message()));
    }
  } else if (line.command == "expect_inside") {
    const Interface::Area a = area(line, line.rest, interface);
    int width = 0, height = 0;
    window.framebuffer(width, height);
    const double right = static_cast<double>(a.x + a.width) * window.pixel_ratio();
    const double bottom = static_cast<double>(a.y + a.height) * window.pixel_ratio();
    if (a.x < 0 || a.y < 0 || right > width || bottom > height) {
      fail(line, fmt::format("it ends at {:.0f}, {:.0f} of {} x {}", right, bottom, width, height));
    }
  } else if (line.command == "expect_method") {
    const std::string method = lighting_method_name(worker.frame().metrics.method);
    if (method != line.rest) fail(line, fmt::format("the method is '{}'", method));
  }
}

}  // namespace haarlight::viewer
