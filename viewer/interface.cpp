// Panels, keys and dragging.

#include "viewer/interface.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <utility>

namespace haarlight::viewer {
namespace {

namespace fs = std::filesystem;

constexpr ImU32 kOrange = IM_COL32(242, 158, 51, 255);
constexpr double kMessageSeconds = 6;

constexpr ImGuiWindowFlags kFixed =
    ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
    ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoSavedSettings |
    ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoNavInputs;

std::string suffix_of(const fs::path& file) {
  std::string suffix = file.extension().string();
  for (char& c : suffix) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return suffix;
}

/// Buttons side by side over the whole width, one of them chosen.
template <typename T, std::size_t n, typename Mark>
bool choose(const std::array<std::pair<const char*, T>, n>& choices, T& value, const Mark& mark) {
  bool changed = false;
  const float gap = 3;
  const float width = (ImGui::GetContentRegionAvail().x - gap * (n - 1)) / n;
  for (std::size_t i = 0; i < n; ++i) {
    if (i > 0) ImGui::SameLine(0, gap);
    const bool chosen = value == choices[i].second;
    if (chosen) {
      ImGui::PushStyleColor(ImGuiCol_Button, {0.80f, 0.50f, 0.14f, 1});
      ImGui::PushStyleColor(ImGuiCol_ButtonHovered, {0.86f, 0.56f, 0.20f, 1});
    }
    if (ImGui::Button(choices[i].first, {width, 0})) {
      value = choices[i].second;
      changed = true;
    }
    mark(choices[i].first);
    if (chosen) ImGui::PopStyleColor(2);
  }
  return changed;
}

void row(const char* name, const std::string& value) {
  ImGui::TextDisabled("%s", name);
  ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(value.c_str()).x);
  ImGui::TextUnformatted(value.c_str());
}

/// Key with modifiers, not while something is typed.
bool pressed(int key, bool control = false) {
  const ImGuiIO& io = ImGui::GetIO();
  return io.KeyCtrl == control && !io.KeyAlt && ImGui::IsKeyPressed(key, false);
}

struct HelpLine {
  const char* key;
  const char* what;
};
constexpr HelpLine kHelp[] = {
    {"drag the picture", "turn the light"},
    {"right, middle, wheel", "of a mesh: go round it, move it, go closer"},
    {"Space", "play, pause"},
    {".", "one frame"},
    {"0", "light and motion as at first"},
    {"R / E", "begin again from dark / from exact"},
    {"1 2 3 4", "NWA, BI, PBI, exact reference"},
    {"[ ]", "half, double the budget"},
    {"W", "next weight of wavelets"},
    {"C", "compare: off, split, side by side"},
    {"T / F", "next tonemap / false colour"},
    {"- =", "exposure by half a stop"},
    {"O", "open a transport or an environment"},
    {"P / X", "save the window as PNG / the picture as EXR"},
    {"M", "record the motion, and write it"},
    {"Tab / L", "panels / plots on and off"},
    {"H", "this help"},
    {"Ctrl+Q", "quit"},
};

}  // namespace

fs::path free_name(const std::string& stem, const std::string& suffix) {
  for (int i = 1;; ++i) {
    const fs::path name = fmt::format("{}-{}{}", stem, i, suffix);
    std::error_code error;
    if (!fs::exists(name, error)) return name;
  }
}

Interface::Interface(const RunOptions& options, double scale)
    : exposure_ev(options.exposure_ev.value_or(0)),
      own_exposure(options.exposure_ev.has_value()),
      curve(options.curve),
      false_colour(options.false_colour),
      settings_(options.settings),
      scale_(scale),
      compare_(options.compare) {}

void Interface::mark(const char* name) {
  const ImVec2 a = ImGui::GetItemRectMin(), b = ImGui::GetItemRectMax();
  marks_[name] = {a.x, a.y, b.x - a.x, b.y - a.y};
}

void Interface::note(const Notice& notice) {
  message_ = notice.text;
  message_failed_ = notice.failed;
  message_since_ = std::chrono::steady_clock::now();
  message_shown_ = true;
}

void Interface::open(const fs::path& file) {
  const std::string suffix = suffix_of(file);
  if (suffix == ".hlt") {
    open_transport(file);
  } else if (suffix == ".exr" || suffix == ".hdr") {
    open_environment(file, kFade);
  } else {
    note({file.filename().string() + ": is neither a transport (.hlt) nor an environment (.exr, "
                                     ".hdr)",
          true});
  }
}

void Interface::open_transport(const fs::path& file) {
  transport = file;
  actions_.emplace_back(OpenTransport{file});
}

void Interface::open_environment(const fs::path& file, double fade) {
  env = file;
  actions_.emplace_back(OpenEnvironment{file, fade});
}

bool Interface::message_over() const {
  const std::chrono::duration<double> age = std::chrono::steady_clock::now() - message_since_;
  return message_shown_ && age.count() > (message_failed_ ? 3 : 1) * kMessageSeconds;
}

PaintOptions Interface::paint() const {
  return {.exposure_ev = exposure_ev,
          .curve = curve,
          .false_colour = false_colour,
          .reference = compare_ == CompareView::split,
          .split = split_};
}

bool Interface::moving() const {
  return inertia_ && !dragging_light_ && std::abs(yaw_speed_) + std::abs(pitch_speed_) > 1e-3;
}

void Interface::reset_view() {
  settings_.yaw = settings_.pitch = yaw_speed_ = pitch_speed_ = 0;
  settings_.orbit = settings_.elevation = settings_.closer = settings_.right = settings_.up = 0;
  actions_.emplace_back(Rewind{});
}

void Interface::cycle_compare() {
  compare_ = static_cast<CompareView>((static_cast<int>(compare_) + 1) % 3);
}

void Interface::handle_keys(const ViewFrame& frame) {
  if (ImGui::GetIO().WantTextInput || browser_.is_open()) return;
  if (pressed(GLFW_KEY_SPACE)) settings_.playing = !settings_.playing;
  if (pressed(GLFW_KEY_PERIOD)) {
    settings_.playing = false;
    actions_.emplace_back(Step{});
  }
  if (pressed(GLFW_KEY_0)) {
    reset_view();
  }
  if (pressed(GLFW_KEY_R)) actions_.emplace_back(Restart{FrameStart::dark});
  if (pressed(GLFW_KEY_E)) actions_.emplace_back(Restart{FrameStart::exact});
  for (int i = 0; i < 4; ++i) {
    if (pressed(GLFW_KEY_1 + i)) settings_.method = static_cast<LightingMethod>(i);
  }
  const double factor = pressed(GLFW_KEY_LEFT_BRACKET)    ? 0.5
                        : pressed(GLFW_KEY_RIGHT_BRACKET) ? 2
                                                          : 1;
  if (factor != 1) {
    settings_.wavelets =
        std::clamp(static_cast<int>(std::lround(settings_.wavelets * factor)), 1, kMaxWavelets);
    settings_.milliseconds = std::clamp(settings_.milliseconds * factor, 0.1, 1000.0);
  }
  if (pressed(GLFW_KEY_W)) {
    settings_.weight = static_cast<WaveletWeight>((static_cast<int>(settings_.weight) + 1) % 3);
  }
  if (pressed(GLFW_KEY_C)) cycle_compare();
  if (pressed(GLFW_KEY_T)) curve = static_cast<TonemapCurve>((static_cast<int>(curve) + 1) % 3);
  if (pressed(GLFW_KEY_F)) false_colour = !false_colour;
  if (pressed(GLFW_KEY_MINUS) || pressed(GLFW_KEY_EQUAL)) {
    exposure_ev += pressed(GLFW_KEY_MINUS) ? -0.5 : 0.5;
    own_exposure = true;
  }
  if (pressed(GLFW_KEY_H) || pressed(GLFW_KEY_F1)) help_ = !help_;
  if (pressed(GLFW_KEY_ESCAPE)) help_ = false;
  if (pressed(GLFW_KEY_TAB)) panels = !panels;
  if (pressed(GLFW_KEY_L)) plots = !plots;
  if (pressed(GLFW_KEY_P)) screenshot_ = free_name("haarlight", ".png");
  if (pressed(GLFW_KEY_X)) actions_.emplace_back(SavePicture{free_name("haarlight", ".exr")});
  if (pressed(GLFW_KEY_M)) {
    if (frame.recording) {
      actions_.emplace_back(StopRecording{free_name("motion", ".json")});
    } else {
      actions_.emplace_back(StartRecording{});
    }
  }
  if (pressed(GLFW_KEY_O)) {
    browser_.open("Open", {".hlt", ".exr", ".hdr"}, [this](const fs::path& file) { open(file); });
  }
  if (pressed(GLFW_KEY_Q, true)) quit_ = true;
}

// A mesh is drawn in the shape of what the panels leave, at no more pixels than are quickly filled.
void Interface::fit_mesh(const ViewFrame& frame, float right, float bottom) {
  settings_.width = settings_.height = 0;
  if (frame.number == 0 || !frame.scene->transport.info().mesh) return;
  const float room = compare_ == CompareView::side ? 0.5f * right : right;
  if (room < 1 || bottom < 1) return;
  const float most = 720;
  const float factor = std::min(1.0f, most / std::max(room, bottom));
  settings_.width = std::max(1, static_cast<int>(std::lround(room * factor)));
  settings_.height = std::max(1, static_cast<int>(std::lround(bottom * factor)));
}

// The largest place that keeps the picture's shape, in what the panels leave.
void Interface::place_picture(const ViewFrame& frame, float right, float bottom) {
  first_ = second_ = {};
  if (frame.number == 0) return;
  const float gap = 6;
  const bool both = compare_ == CompareView::side && frame.compared;
  const float room = both ? 0.5f * (right - gap) : right;
  const float shape =
      static_cast<float>(frame.picture.width) / static_cast<float>(frame.picture.height);
  const float width = std::min(room, bottom * shape), height = width / shape;
  const float y = 0.5f * (bottom - height);
  first_ = {both ? room - width : 0.5f * (room - width), y, width, height};
  if (both) second_ = {room + gap, y, width, height};
}

void Interface::handle_picture(const ViewFrame& frame, double seconds) {
  const ImGuiIO& io = ImGui::GetIO();
  const auto over = [&](const Area& a) {
    return !a.empty() && io.MousePos.x >= a.x && io.MousePos.x < a.x + a.width &&
           io.MousePos.y >= a.y && io.MousePos.y < a.y + a.height;
  };
  const float line = first_.x + first_.width * static_cast<float>(split_);
  const bool splitting = compare_ == CompareView::split && frame.compared;
  const bool near_line =
      splitting && over(first_) && std::abs(io.MousePos.x - line) < 8 * static_cast<float>(scale_);
  if (ImGui::IsMouseClicked(0) && !io.WantCaptureMouse) {
    dragging_split_ = near_line;
    dragging_light_ = !near_line && (over(first_) || over(second_));
  }
  if (!io.MouseDown[0]) dragging_split_ = dragging_light_ = false;
  if (near_line || dragging_split_) ImGui::SetMouseCursor(ImGuiMouseCursor_ResizeEW);
  if (dragging_split_ && first_.width > 0) {
    split_ = std::clamp(static_cast<double>((io.MousePos.x - first_.x) / first_.width), 0.0, 1.0);
  }

  // Across the picture is half a turn.
  double yaw = 0, pitch = 0;
  if (dragging_light_ && first_.width > 0) {
    yaw = kPi * static_cast<double>(io.MouseDelta.x / first_.width);
    pitch = kPi * static_cast<double>(io.MouseDelta.y / first_.width);
    if (seconds > 0) {
      // Over a few frames, so that the last one's jitter is not what goes on.
      yaw_speed_ += 0.3 * (yaw / seconds - yaw_speed_);
      pitch_speed_ += 0.3 * (pitch / seconds - pitch_speed_);
    }
  } else if (moving()) {
    yaw = yaw_speed_ * seconds;
    pitch = pitch_speed_ * seconds;
    const double slower = std::exp(-1.5 * seconds);
    yaw_speed_ *= slower;
    pitch_speed_ *= slower;
  } else {
    yaw_speed_ = pitch_speed_ = 0;
  }
  handle_view(frame, over(first_) || over(second_));
  settings_.yaw = std::remainder(settings_.yaw + yaw, 2 * kPi);
  settings_.pitch = std::clamp(settings_.pitch + pitch, -0.5 * kPi, 0.5 * kPi);
}

// Of a mesh: the right button, or the left with Shift, goes round it; the middle one moves it; the
// wheel goes closer.
void Interface::handle_view(const ViewFrame& frame, bool over_picture) {
  if (frame.number == 0 || !frame.scene->transport.info().mesh) return;
  const ImGuiIO& io = ImGui::GetIO();
  for (const int button : {0, 1, 2}) {
    if (ImGui::IsMouseClicked(button) && !io.WantCaptureMouse && over_picture &&
        (button > 0 || io.KeyShift)) {
      view_button_ = button;
      dragging_light_ = false;
    }
  }
  if (view_button_ >= 0 && !io.MouseDown[view_button_]) view_button_ = -1;
  if (view_button_ >= 0 && first_.height > 0) {
    const auto dx = static_cast<double>(io.MouseDelta.x / first_.height);
    const auto dy = static_cast<double>(io.MouseDelta.y / first_.height);
    if (view_button_ == 2) {
      settings_.right = std::clamp(settings_.right + dx, -100.0, 100.0);
      settings_.up = std::clamp(settings_.up - dy, -100.0, 100.0);
    } else {
      settings_.orbit = std::remainder(settings_.orbit - kPi * dx, 2 * kPi);
      settings_.elevation = std::clamp(settings_.elevation + kPi * dy, -kPi, kPi);
    }
  }
  if (over_picture && !io.WantCaptureMouse && io.MouseWheel != 0) {
    settings_.closer =
        std::clamp(settings_.closer + 0.15 * static_cast<double>(io.MouseWheel), -6.0, 6.0);
  }
}

void Interface::draw(const ViewFrame& frame, const WindowTimes& times, double seconds,
                     bool new_frame) {
  if (frame.scene != seen_scene_) {
    seen_scene_ = frame.scene;
    history_.clear();
    if (!own_exposure) exposure_ev = frame.exact_exposure_ev;
  }
  if (new_frame && frame.number > 0) history_.add(frame);
  if (message_over()) message_shown_ = false;
  handle_keys(frame);

  const ImVec2 all = ImGui::GetIO().DisplaySize;
  const auto s = static_cast<float>(scale_);
  // On a small window the picture goes first.
  const float right = panels && all.x > 560 * s ? 318 * s : 0;
  const float bottom = plots && panels && all.y > 420 * s ? 176 * s : 0;
  fit_mesh(frame, all.x - right, all.y - bottom);
  place_picture(frame, all.x - right, all.y - bottom);
  handle_picture(frame, seconds);
  settings_.compare = compare_ != CompareView::none;
  settings_.show_lighting = right > 0;
  draw_overlay(frame);
  if (right > 0) {
    ImGui::SetNextWindowPos({all.x - right, 0});
    ImGui::SetNextWindowSize({right, all.y});
    ImGui::Begin("controls", nullptr, kFixed);
    lights_exposure_ = exposure_ev;
    new_frame_ = new_frame;
    draw_controls(frame, times, right);
    ImGui::End();
  }
  if (bottom > 0) draw_plots(frame, all.x - right, bottom);
  if (help_) draw_help();
  browser_.draw(scale_);
}

// On a window that is not high enough for all, the map gives way.
void Interface::draw_controls(const ViewFrame& frame, const WindowTimes& times, float width) {
  const ImGuiStyle& style = ImGui::GetStyle();
  lights_width_ = width - 2 * style.WindowPadding.x;
  lights_low_ = std::clamp(controls_height_ - ImGui::GetWindowHeight(), 0.0f, 0.3f * lights_width_);
  draw_file_row(frame);
  draw_numbers(frame, times);
  ImGui::Separator();
  ImGui::PushItemWidth(-1);
  draw_method(frame);
  draw_motion(frame);
  draw_environment(frame);
  draw_display(frame);
  ImGui::PopItemWidth();
  controls_height_ =
      ImGui::GetCursorPosY() - style.ItemSpacing.y + style.WindowPadding.y + lights_low_;
}

void Interface::draw_file_row(const ViewFrame& frame) {
  const float gap = 4;
  const float width = (ImGui::GetContentRegionAvail().x - 3 * gap) / 4;
  if (ImGui::Button("Open", {width, 0})) {
    browser_.open("Open", {".hlt", ".exr", ".hdr"}, [this](const fs::path& file) { open(file); });
  }
  mark("open");
  ImGui::SameLine(0, gap);
  if (ImGui::Button("Save", {width, 0})) ImGui::OpenPopup("save");
  mark("save");
  if (ImGui::BeginPopup("save")) {
    if (ImGui::MenuItem("Window as PNG", "P")) screenshot_ = free_name("haarlight", ".png");
    if (ImGui::MenuItem("Picture as EXR", "X")) {
      actions_.emplace_back(SavePicture{free_name("haarlight", ".exr")});
    }
    ImGui::EndPopup();
  }
  ImGui::SameLine(0, gap);
  const bool recording = frame.recording;
  if (recording) ImGui::PushStyleColor(ImGuiCol_Button, {0.72f, 0.20f, 0.16f, 1});
  if (ImGui::Button(recording ? "Stop###record" : "Record###record", {width, 0})) {
    if (recording) {
      actions_.emplace_back(StopRecording{free_name("motion", ".json")});
    } else {
      actions_.emplace_back(StartRecording{});
    }
  }
  mark("record");
  if (recording) ImGui::PopStyleColor();
  ImGui::SameLine(0, gap);
  if (ImGui::Button("Help", {width, 0})) help_ = !help_;
  mark("help");
}

void Interface::draw_numbers(const ViewFrame& frame, const WindowTimes& times) {
  if (frame.number == 0) return;
  const FrameMetrics& m = frame.metrics;
  row("relight / light", fmt::format("{:.2f} / {:.2f} ms", m.total_ms, frame.light_ms));
  row("upload / window", fmt::format("{:.2f} / {:.2f} ms", times.upload_ms, times.gui_ms));
  row("wavelets",
      fmt::format("{} of {}", m.updates,
                  settings_.method == LightingMethod::reference ? std::string("all")
                                                                : std::to_string(frame.budget)));
}

void Interface::draw_method(const ViewFrame& frame) {
  const auto marker = [this](const char* name) { mark(name); };
  choose<LightingMethod>(
      std::array<std::pair<const char*, LightingMethod>, 4>{{{"NWA", LightingMethod::nwa},
                                                             {"BI", LightingMethod::bi},
                                                             {"PBI", LightingMethod::pbi},
                                                             {"Exact", LightingMethod::reference}}},
      settings_.method, marker);
  choose<BudgetKind>(
      std::array<std::pair<const char*, BudgetKind>, 3>{{{"wavelets", BudgetKind::wavelets},
                                                         {"time", BudgetKind::milliseconds},
                                                         {"error", BudgetKind::error}}},
      settings_.budget, marker);
  if (settings_.budget == BudgetKind::wavelets) {
    ImGui::SliderInt("##wavelets", &settings_.wavelets, 1, 4096, "%d wavelets a frame",
                     ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp);
    mark("budget");
  } else if (settings_.budget == BudgetKind::error) {
    auto percent = static_cast<float>(100 * settings_.error);
    if (ImGui::SliderFloat("##error", &percent, 0.01f, 50, "%.2f %% picture error",
                           ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp)) {
      settings_.error = static_cast<double>(percent) / 100;
    }
    mark("budget");
  } else {
    auto ms = static_cast<float>(settings_.milliseconds);
    if (ImGui::SliderFloat("##ms", &ms, 0.5f, 50, "%.1f ms a frame",
                           ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp)) {
      settings_.milliseconds = static_cast<double>(ms);
    }
    mark("budget");
  }
  choose<WaveletWeight>(
      std::array<std::pair<const char*, WaveletWeight>, 3>{
          {{"no weight", WaveletWeight::none},
           {"area", WaveletWeight::area},
           {"transport", WaveletWeight::transport}}},
      settings_.weight, marker);
  const float half = 0.5f * (ImGui::GetContentRegionAvail().x - 4);
  if (ImGui::Button("From dark", {half, 0})) actions_.emplace_back(Restart{FrameStart::dark});
  mark("dark");
  ImGui::SameLine(0, 4);
  if (ImGui::Button("From exact", {half, 0})) actions_.emplace_back(Restart{FrameStart::exact});
  mark("exact");
  (void)frame;
  ImGui::Separator();
}

void Interface::draw_motion(const ViewFrame& frame) {
  const float third = (ImGui::GetContentRegionAvail().x - 8) / 3;
  if (ImGui::Button(settings_.playing ? "Pause###play" : "Play###play", {third, 0})) {
    settings_.playing = !settings_.playing;
  }
  mark("play");
  ImGui::SameLine(0, 4);
  if (ImGui::Button("Step", {third, 0})) {
    settings_.playing = false;
    actions_.emplace_back(Step{});
  }
  mark("step");
  ImGui::SameLine(0, 4);
  if (ImGui::Button("Reset", {third, 0})) {
    reset_view();
  }
  mark("reset");
  const float half = 0.5f * (ImGui::GetContentRegionAvail().x - 4);
  int kind = static_cast<int>(settings_.motion);
  ImGui::SetNextItemWidth(half);
  if (ImGui::Combo("##motion", &kind, "still\0rotate\0tumble\0swing\0blend\0light\0")) {
    settings_.motion = static_cast<MotionKind>(kind);
    actions_.emplace_back(Rewind{});
  }
  mark("motion");
  ImGui::SameLine(0, 4);
  auto speed = static_cast<float>(settings_.speed);
  ImGui::SetNextItemWidth(half);
  if (ImGui::SliderFloat("##speed", &speed, 0.02f, 8, "speed %.2f",
                         ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp)) {
    settings_.speed = static_cast<double>(speed);
  }
  mark("speed");
  auto degrees = static_cast<float>(settings_.degrees);
  ImGui::SetNextItemWidth(half);
  if (ImGui::SliderFloat("##degrees", &degrees, -360, 360, "%.0f degrees")) {
    settings_.degrees = static_cast<double>(degrees);
  }
  mark("degrees");
  ImGui::SameLine(0, 8);
  ImGui::Checkbox("loop", &settings_.loop);
  ImGui::SameLine();
  ImGui::Checkbox("inertia", &inertia_);
  mark("inertia");
  (void)frame;
  ImGui::Separator();
}

void Interface::draw_environment(const ViewFrame& frame) {
  if (frame.from && frame.to) {
    if (!blend_held_) blend_ = static_cast<float>(frame.light.blend);
    if (ImGui::SliderFloat("##blend", &blend_, 0, 1, "blend %.2f", ImGuiSliderFlags_AlwaysClamp)) {
      actions_.emplace_back(SetBlend{static_cast<double>(blend_)});
    }
    blend_held_ = ImGui::IsItemActive();
    mark("blend");
    ImGui::TextDisabled("%s", frame.from->file.filename().string().c_str());
    const std::string to = frame.to->file.filename().string();
    ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(to.c_str()).x);
    ImGui::TextDisabled("%s", to.c_str());
  }
  auto background = static_cast<float>(settings_.background);
  if (ImGui::SliderFloat("##background", &background, 0, 2, "environment x %.2f")) {
    settings_.background = std::max(0.0, static_cast<double>(background));
  }
  mark("background");
  lights_.draw(
      frame, new_frame_, lights_exposure_,
      {ImGui::GetContentRegionAvail().x, 0.5f * lights_width_ - lights_low_, lights_width_},
      static_cast<float>(scale_), settings_, [this](const char* name) { mark(name); });
  ImGui::Separator();
}

void Interface::draw_display(const ViewFrame& frame) {
  const auto marker = [this](const char* name) { mark(name); };
  choose<CompareView>(
      std::array<std::pair<const char*, CompareView>, 3>{{{"picture", CompareView::none},
                                                          {"split", CompareView::split},
                                                          {"both", CompareView::side}}},
      compare_, marker);
  int shown = false_colour ? 3 : static_cast<int>(curve);
  if (choose<int>(
          std::array<std::pair<const char*, int>, 4>{
              {{"linear", 0}, {"Reinhard", 1}, {"filmic", 2}, {"false", 3}}},
          shown, marker)) {
    false_colour = shown == 3;
    if (shown < 3) curve = static_cast<TonemapCurve>(shown);
  }
  if (frame.number > 0 && frame.scene->transport.kind() == TransportKind::clusters) {
    ImGui::Checkbox("clusters in colours", &settings_.clusters);
    mark("clusters");
  }
  auto exposure = static_cast<float>(exposure_ev);
  const float button = ImGui::CalcTextSize("auto").x + 16 * static_cast<float>(scale_);
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x - button - 4);
  if (ImGui::SliderFloat("##exposure", &exposure, -12, 12, "exposure %+.2f")) {
    exposure_ev = static_cast<double>(exposure);
    own_exposure = true;
  }
  mark("exposure");
  ImGui::SameLine(0, 4);
  if (ImGui::Button("auto", {button, 0})) {
    own_exposure = false;
    exposure_ev = frame.exact_exposure_ev;
  }
  mark("auto");
}

void Interface::draw_plots(const ViewFrame&, float right, float height) {
  ImGui::SetNextWindowPos({0, ImGui::GetIO().DisplaySize.y - height});
  ImGui::SetNextWindowSize({right, height});
  ImGui::Begin("plots", nullptr, kFixed | ImGuiWindowFlags_NoScrollbar);
  const ImVec2 room = ImGui::GetContentRegionAvail();
  history_.draw(room.x, room.y, static_cast<float>(scale_));
  ImGui::End();
}

void Interface::draw_help() {
  const ImVec2 all = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({0.5f * all.x, 0.5f * all.y}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::Begin("Keys", &help_,
               ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings);
  for (const HelpLine& line : kHelp) {
    ImGui::TextColored({0.95f, 0.62f, 0.20f, 1}, "%s", line.key);
    ImGui::SameLine(180 * static_cast<float>(scale_));
    ImGui::TextUnformatted(line.what);
  }
  ImGui::Spacing();
  ImGui::TextDisabled("Drop a transport (.hlt) or an environment (.exr, .hdr) on the window.");
  ImGui::End();
}

// Over the picture: the split line, names, the message, convergence, the scale of false colour.
void Interface::draw_overlay(const ViewFrame& frame) {
  ImDrawList& draw = *ImGui::GetBackgroundDrawList();
  const auto s = static_cast<float>(scale_);
  const float line = ImGui::GetTextLineHeight();
  const auto label = [&](float x, float y, ImU32 color, const std::string& text) {
    const ImVec2 size = ImGui::CalcTextSize(text.c_str());
    draw.AddRectFilled({x - 6 * s, y - 3 * s}, {x + size.x + 6 * s, y + size.y + 3 * s},
                       IM_COL32(0, 0, 0, 165), 3 * s);
    draw.AddText({x, y}, color, text.c_str());
  };
  constexpr ImU32 white = IM_COL32(240, 240, 236, 255);
  if (frame.number == 0) {
    const char* hint = "Drop a transport (.hlt) and an environment (.exr, .hdr) here, or press O";
    const ImVec2 size = ImGui::CalcTextSize(hint), all = ImGui::GetIO().DisplaySize;
    draw.AddText({std::max(8 * s, 0.5f * (all.x - (panels ? 318 * s : 0) - size.x)), 0.4f * all.y},
                 IM_COL32(170, 170, 168, 255), hint);
  } else {
    const std::string method =
        frame.metrics.method == LightingMethod::reference
            ? std::string("exact")
            : fmt::format("{} {}", lighting_method_name(frame.metrics.method), frame.budget);
    label(first_.x + 12 * s, first_.y + 10 * s, white, method);
    if (compare_ == CompareView::split && frame.compared) {
      const float x = first_.x + first_.width * static_cast<float>(split_);
      draw.AddLine({x, first_.y}, {x, first_.y + first_.height}, white, 1.5f * s);
      draw.AddCircleFilled({x, first_.y + 0.5f * first_.height}, 6 * s, white);
      label(std::min(x + 14 * s, first_.x + first_.width - 50 * s), first_.y + 10 * s, white,
            "exact");
    }
    if (!second_.empty()) label(second_.x + 12 * s, second_.y + 10 * s, white, "exact");
    // The light is still there, or the picture is on its way to it.
    const std::string state =
        frame.converged ? std::string("exact")
        : frame.metrics.error_estimate
            ? fmt::format("picture error about {:.2f} %", 100 * *frame.metrics.error_estimate)
            : fmt::format("lighting error {:.4f}", frame.metrics.lighting_error);
    const float width = ImGui::CalcTextSize(state.c_str()).x;
    label(first_.x + first_.width - width - 14 * s, first_.y + first_.height - line - 12 * s,
          frame.converged ? IM_COL32(130, 214, 120, 255) : kOrange, state);
    if (frame.recording) {
      label(first_.x + 12 * s, first_.y + 16 * s + 1.6f * line, IM_COL32(250, 90, 70, 255),
            fmt::format("recording, {} frames", frame.recorded));
    }
  }
  if (false_colour && !first_.empty()) {
    const float x = first_.x + 14 * s, width = std::min(220 * s, first_.width - 28 * s);
    const float y = first_.y + first_.height - 34 * s;
    draw.AddRectFilled({x - 8 * s, y - line - 8 * s}, {x + width + 8 * s, y + 22 * s},
                       IM_COL32(0, 0, 0, 165), 3 * s);
    draw.AddText({x, y - line - 3 * s}, white, "stops from mid grey");
    for (int i = 0; i < 64; ++i) {
      const Rgb c = false_colour_of(((i + 0.5) / 32 - 1) * kFalseColourStops);
      const auto byte = [](float v) {
        return static_cast<int>(std::lround(255 * std::pow(static_cast<double>(v), 1 / 2.2)));
      };
      const float left = x + width * static_cast<float>(i) / 64;
      draw.AddRectFilled({left, y}, {left + width / 64 + 1, y + 8 * s},
                         IM_COL32(byte(c.r), byte(c.g), byte(c.b), 255));
    }
    for (const int stop : {-5, 0, 5}) {
      const std::string text = fmt::format("{:+d}", stop);
      const float at = x + width * static_cast<float>(stop + 5) / 10;
      draw.AddText({std::clamp(at - 8 * s, x, x + width - 18 * s), y + 7 * s}, white, text.c_str());
    }
  }
  if (message_shown_) {
    const ImVec2 all = ImGui::GetIO().DisplaySize;
    label(12 * s, all.y - (plots && panels && all.y > 420 * s ? 176 * s : 0) - line - 12 * s,
          message_failed_ ? IM_COL32(255, 140, 120, 255) : white, message_);
  }
}

}  // namespace haarlight::viewer
