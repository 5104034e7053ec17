// The window's loop: takes frames from the worker, draws them and the interface over them.

#include "viewer/show.h"

#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/image_io.h"
#include "prt/metrics_csv.h"
#include "viewer/interface.h"
#include "viewer/picture_painter.h"
#include "viewer/preferences.h"
#include "viewer/script.h"
#include "viewer/window.h"
#include "viewer/worker.h"

namespace haarlight::viewer {
namespace {

using Clock = std::chrono::steady_clock;

// Dear ImGui settles within a few frames after an event.
constexpr int kFramesAfterEvent = 3;
constexpr double kSleep = 0.5;  // seconds without any event until messages are looked after

double milliseconds(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

double median(std::vector<double>& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Samples {
  std::vector<double> light, relight, upload, gui;
};

PixelRect pixels_of(const Interface::Area& area, double ratio) {
  const auto pixels = [ratio](float units) {
    return static_cast<int>(std::lround(static_cast<double>(units) * ratio));
  };
  return {pixels(area.x), pixels(area.y), pixels(area.width), pixels(area.height)};
}

/// Opens what the command line names, or else what was open last.
void open_first(const RunOptions& options, const Preferences& remembered, Interface& interface) {
  std::error_code error;
  const auto or_remembered = [&](const std::filesystem::path& named,
                                 const std::filesystem::path& last) {
    return !named.empty() || last.empty() || !std::filesystem::exists(last, error) ? named : last;
  };
  const auto transport = or_remembered(options.transport, remembered.transport);
  const auto env = or_remembered(options.env, remembered.env);
  if (!transport.empty()) interface.open_transport(transport);
  if (!env.empty()) interface.open_environment(env, 0);
  if (!options.env_to.empty()) interface.open_environment(options.env_to, 0);
}

}  // namespace

std::string show(const RunOptions& options, double scale) {
  const std::filesystem::path preferences =
      options.remember ? preferences_file() : std::filesystem::path();
  Preferences remembered;
  if (!preferences.empty()) remembered = load_preferences(preferences);
  std::optional<Script> script;
  if (!options.script.empty()) script.emplace(options.script);
  std::optional<MetricsCsvWriter> table;
  if (!options.metrics.empty()) table.emplace(options.metrics);

  const bool own_size = options.width > 0;
  Window window(own_size ? options.width : remembered.width,
                own_size ? options.height : remembered.height, scale);
  PicturePainter painter;
  Interface interface(options, window.scale());
  interface.panels = remembered.panels;
  interface.plots = remembered.plots;
  interface.set_folder(remembered.folder);
  Worker worker([] { glfwPostEmptyEvent(); }, {.frames = options.frames});
  open_first(options, remembered, interface);
  if (!options.record.empty()) interface.start_recording();

  WindowTimes times;
  Samples samples;
  Clock::time_point last = Clock::now();
  std::uint64_t first_frame = 0;
  int due = kFramesAfterEvent;
  bool ended = false;
  bool new_frame = false;  // taken and not drawn yet
  while (!ended && !glfwWindowShouldClose(window.handle()) && !interface.wants_quit()) {
    // Sleep until something happens.
    const bool scripted = script && !script->resting() && !script->done();
    if (due > 0 || scripted || interface.moving()) {
      glfwPollEvents();
    } else {
      glfwWaitEventsTimeout(kSleep);
    }
    new_frame |= worker.update();
    for (const Notice& notice : worker.take_notices()) {
      // Nobody is there to open something else.
      if (options.frames > 0 && notice.failed) throw Error(ErrorKind::format, notice.text);
      interface.note(notice);
      due = kFramesAfterEvent;
    }
    if (window.take_activity()) due = kFramesAfterEvent;
    if (new_frame || interface.message_over()) due = std::max(due, 1);
    if (script && !script->done()) {
      script->before_frame(window, interface, worker, !new_frame);
      ended |= script->wants_close();
    }
    for (const auto& file : window.take_dropped()) {
      interface.open(file);
      due = kFramesAfterEvent;
    }
    if (due == 0 && !scripted && !interface.moving()) continue;
    due = std::max(0, due - 1);

    int width = 0, height = 0;
    window.framebuffer(width, height);
    if (width < 1 || height < 1) continue;  // iconified
    const Clock::time_point begin = Clock::now();
    const double seconds = std::min(0.25, 1e-3 * milliseconds(last, begin));
    last = begin;
    const ViewFrame& frame = worker.frame();
    if (new_frame) painter.upload(frame);
    const Clock::time_point uploaded = Clock::now();

    window.begin_frame(script ? script->pointer() : ScriptedPointer{});
    interface.draw(frame, times, seconds, new_frame);
    worker.set(interface.settings());
    for (ViewAction& action : interface.take_actions()) worker.act(std::move(action));
    glViewport(0, 0, width, height);
    glClearColor(0.055f, 0.058f, 0.063f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    PaintOptions paint = interface.paint();
    painter.draw(pixels_of(interface.first(), window.pixel_ratio()), height, paint);
    paint.reference = true;
    paint.split = 0;
    painter.draw(pixels_of(interface.second(), window.pixel_ratio()), height, paint);
    window.end_frame();
    if (script) script->after_frame(window, interface, worker);
    if (auto file = interface.take_screenshot()) {
      try {
        save_image(*file, window.read_pixels(0, 0, width, height));
        interface.note({"wrote " + file->string(), false});
      } catch (const Error& error) {
        interface.note({error.what(), true});
      }
      due = kFramesAfterEvent;
    }
    const Clock::time_point drawn = Clock::now();

    if (new_frame) {
      if (first_frame == 0) first_frame = frame.number;
      if (table) table->add(frame.metrics);
      samples.light.push_back(frame.light_ms);
      samples.relight.push_back(frame.metrics.total_ms);
      samples.upload.push_back(milliseconds(begin, uploaded));
      times.upload_ms = milliseconds(begin, uploaded);
    }
    samples.gui.push_back(milliseconds(uploaded, drawn));
    times.gui_ms += 0.1 * (milliseconds(uploaded, drawn) - times.gui_ms);
    // The last frame of --frames is kept as it was drawn.
    if (options.frames > 0 && frame.number >= static_cast<std::uint64_t>(options.frames)) {
      ended = true;
      if (!options.screenshot.empty()) {
        save_image(options.screenshot, window.read_pixels(0, 0, width, height));
      }
    }
    window.show();
    new_frame = false;
  }

  if (table) table->commit();
  if (!options.record.empty()) {
    worker.act(StopRecording{options.record});
    while (worker.busy()) {
      worker.update();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    for (const Notice& notice : worker.take_notices()) {
      if (notice.failed) throw Error(ErrorKind::io, notice.text);
    }
  }
  if (!preferences.empty()) {
    Preferences now = remembered;
    glfwGetWindowSize(window.handle(), &now.width, &now.height);
    now.panels = interface.panels;
    now.plots = interface.plots;
    if (!interface.transport.empty())
      now.transport = std::filesystem::absolute(interface.transport);
    if (!interface.env.empty()) now.env = std::filesystem::absolute(interface.env);
    now.folder = interface.folder();
    save_preferences(preferences, now);
  }
  if (!options.timings) return {};
  return fmt::format(
      "frames {}\nlight_ms {:.3f}\nrelight_ms {:.3f}\nupload_ms {:.3f}\ngui_ms {:.3f}\n",
      samples.relight.size(), median(samples.light), median(samples.relight),
      median(samples.upload), median(samples.gui));
}

}  // namespace haarlight::viewer
