// What the person sees and sets beside the picture: panels, keys, dragging, messages.

#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "prt/tonemap.h"
#include "viewer/file_browser.h"
#include "viewer/history.h"
#include "viewer/light_panel.h"
#include "viewer/picture_painter.h"
#include "viewer/run_options.h"
#include "viewer/settings.h"
#include "viewer/view_frame.h"
#include "viewer/worker.h"

namespace haarlight::viewer {

/// Milliseconds of the window's own work, smoothed.
struct WindowTimes {
  double upload_ms = 0;  ///< pictures to the graphics card
  double gui_ms = 0;     ///< widgets, drawing and waiting for the card's driver
};

/// The state of the interface and what it asks for. Draws with Dear ImGui, into its current frame.
class Interface {
 public:
  Interface(const RunOptions& options, double scale);

  /// One frame of widgets over a framebuffer of so many pixels (times `pixel_ratio` of the units
  /// that the pointer moves in). Changes settings and collects actions.
  void draw(const ViewFrame& frame, const WindowTimes& times, double seconds, bool new_frame);

  const ViewSettings& settings() const { return settings_; }
  std::vector<ViewAction> take_actions() { return std::exchange(actions_, {}); }
  void note(const Notice& notice);

  /// Opens what was dropped or chosen, by its suffix.
  void open(const std::filesystem::path& file);
  void open_transport(const std::filesystem::path& file);
  void open_environment(const std::filesystem::path& file, double fade);
  void start_recording() { actions_.emplace_back(StartRecording{}); }
  /// Blends to it in so many sixtieths of a second.
  static constexpr double kFade = 45;

  /// Where the picture goes, in the units of the pointer; the exact one is beside it for
  /// CompareView::side, else `second` is empty.
  struct Area {
    float x = 0, y = 0, width = 0, height = 0;
    bool empty() const { return width < 1 || height < 1; }
  };
  const Area& first() const { return first_; }
  const Area& second() const { return second_; }
  PaintOptions paint() const;
  CompareView compare() const { return compare_; }

  /// Whether something moves by itself, and the window must be drawn again.
  bool moving() const;
  bool wants_quit() const { return quit_; }
  std::optional<std::filesystem::path> take_screenshot() {
    return std::exchange(screenshot_, std::nullopt);
  }
  /// Whether the message on the screen has had its time, so that one more frame takes it away.
  bool message_over() const;
  const std::filesystem::path& folder() const { return browser_.folder; }
  void set_folder(const std::filesystem::path& folder) { browser_.folder = folder; }
  const std::string& message() const { return message_; }

  /// Where a widget was drawn last, by name: scripts click there.
  const std::map<std::string, Area>& marks() const { return marks_; }

  // What preferences remember.
  std::filesystem::path transport, env;
  bool panels = true, plots = true;
  double exposure_ev = 0;
  bool own_exposure = false;  ///< not that of the scene
  TonemapCurve curve = TonemapCurve::filmic;
  bool false_colour = false;

 private:
  void handle_keys(const ViewFrame& frame);
  void handle_picture(const ViewFrame& frame, double seconds);
  void handle_view(const ViewFrame& frame, bool over_picture);
  void reset_view();
  void fit_mesh(const ViewFrame& frame, float right, float bottom);
  void place_picture(const ViewFrame& frame, float right, float bottom);
  void draw_controls(const ViewFrame& frame, const WindowTimes& times, float width);
  void draw_file_row(const ViewFrame& frame);
  void draw_method(const ViewFrame& frame);
  void draw_motion(const ViewFrame& frame);
  void draw_environment(const ViewFrame& frame);
  void draw_display(const ViewFrame& frame);
  void draw_numbers(const ViewFrame& frame, const WindowTimes& times);
  void draw_plots(const ViewFrame& frame, float right, float height);
  void draw_help();
  void draw_overlay(const ViewFrame& frame);
  void cycle_compare();
  void mark(const char* name);

  ViewSettings settings_;
  std::vector<ViewAction> actions_;
  double scale_;
  CompareView compare_ = CompareView::none;
  double split_ = 0.5;
  bool dragging_split_ = false, dragging_light_ = false;
  int view_button_ = -1;  // that turns or moves a mesh
  bool inertia_ = false;
  double yaw_speed_ = 0, pitch_speed_ = 0;  // radians a second
  bool help_ = false, quit_ = false;
  bool blend_held_ = false;
  float blend_ = 0;
  Area first_, second_;
  std::map<std::string, Area> marks_;
  std::string message_;
  bool message_failed_ = false;
  bool message_shown_ = false;
  std::chrono::steady_clock::time_point message_since_;
  std::optional<std::filesystem::path> screenshot_;
  FileBrowser browser_;
  History history_;
  LightPanel lights_;
  double lights_exposure_ = 0;
  float lights_width_ = 0, lights_low_ = 0;  // without a scroll bar; what the map gives away
  float controls_height_ = 0;                // of all controls, had the map its full height
  bool new_frame_ = false;
  std::shared_ptr<const OpenScene> seen_scene_;
};

/// The next free name STEM-1.SUFFIX, STEM-2.SUFFIX, ... in the working folder.
std::filesystem::path free_name(const std::string& stem, const std::string& suffix);

}  // namespace haarlight::viewer
