// The window of a scene that moves.

#include <epoxy/gl.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/image_io.h"
#include "viewer/scene_run.h"
#include "viewer/texture.h"
#include "viewer/window.h"

namespace haarlight::viewer {
namespace {

constexpr const char* kMethods[kSceneMethods] = {"path tracing",
                                                 "irradiance caching",
                                                 "temporal radiance caching",
                                                 "instant global illumination",
                                                 "instant caching",
                                                 "temporal instant caching"};

// What a display shows of a share of its light, in steps finer than its own.
class DisplayCode {
 public:
  DisplayCode() {
    for (std::size_t i = 0; i < code_.size(); ++i) {
      const double v = static_cast<double>(i) / kMost;
      const double coded = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
      code_[i] = static_cast<std::uint8_t>(std::lround(255 * coded));
    }
  }
  std::uint8_t operator()(float x) const {
    return code_[static_cast<std::size_t>(std::clamp(x, 0.0f, 1.0f) * kMost + 0.5f)];
  }

 private:
  static constexpr std::uint16_t kMost = 65535;
  std::array<std::uint8_t, kMost + 1> code_{};
};

std::vector<std::uint8_t> bytes_of(const Image& radiance, TonemapCurve curve, double exposure) {
  static const DisplayCode code;
  const Image shown = tonemap(radiance, {curve, exposure});
  std::vector<std::uint8_t> bytes(4 * shown.pixels.size(), 255);
  for (std::size_t i = 0; i < shown.pixels.size(); ++i) {
    const Rgb& c = shown.pixels[i];
    bytes[4 * i] = code(c.r), bytes[4 * i + 1] = code(c.g), bytes[4 * i + 2] = code(c.b);
  }
  return bytes;
}

// How many pictures a second there were lately.
class PictureRate {
 public:
  // One more, so many seconds after the one before.
  void add(double seconds) {
    constexpr double kNew = 0.2;
    mean_ = mean_ > 0 ? (1 - kNew) * mean_ + kNew * seconds : seconds;
  }
  double a_second() const { return mean_ > 0 ? 1 / mean_ : 0; }

 private:
  double mean_ = 0;
};

// Where the picture lies in the window, and which of its pixels is at a place there.
struct Place {
  ImVec2 corner, size;
  double scale = 1;  // units of the window a pixel
  double x(float at) const { return static_cast<double>(at - corner.x) / scale; }
  double y(float at) const { return static_cast<double>(at - corner.y) / scale; }
};

Place place_of(const Image& picture) {
  const ImVec2 all = ImGui::GetIO().DisplaySize;
  const double scale = std::min(static_cast<double>(all.x) / picture.width,
                                static_cast<double>(all.y) / picture.height);
  const ImVec2 size(static_cast<float>(scale * picture.width),
                    static_cast<float>(scale * picture.height));
  return {ImVec2((all.x - size.x) / 2, (all.y - size.y) / 2), size, scale};
}

class SceneInterface {
 public:
  SceneInterface(SceneSession& session, double exposure) : session_(session), exposure_(exposure) {}

  double exposure() const { return exposure_; }

  // Whether something was asked for that changes how the picture is shown.
  bool take_input(const Place& place) {
    const ImGuiIO& io = ImGui::GetIO();
    bool reshow = false;
    if (!io.WantCaptureKeyboard) {
      if (ImGui::IsKeyPressed(GLFW_KEY_SPACE, false)) session_.play(!session_.playing());
      if (ImGui::IsKeyPressed(GLFW_KEY_PERIOD)) session_.step(1);
      if (ImGui::IsKeyPressed(GLFW_KEY_COMMA)) session_.step(-1);
      if (ImGui::IsKeyPressed(GLFW_KEY_M, false)) {
        session_.set_method(
            static_cast<SceneMethod>((static_cast<int>(session_.method()) + 1) % kSceneMethods));
      }
      if (ImGui::IsKeyPressed(GLFW_KEY_L, false)) session_.show_life(!session_.shows_life());
      for (const auto& [key, change] : {std::pair{GLFW_KEY_EQUAL, 0.25}, {GLFW_KEY_MINUS, -0.25}}) {
        if (!ImGui::IsKeyPressed(key)) continue;
        exposure_ += change, reshow = true;
      }
    }
    if (io.WantCaptureMouse) return reshow;
    const double x = place.x(io.MousePos.x), y = place.y(io.MousePos.y);
    const bool moved = io.MouseDelta.x != 0 || io.MouseDelta.y != 0;
    const bool by_hand = ImGui::IsMouseDown(1) || (io.KeyShift && ImGui::IsMouseDown(0));
    if (by_hand && !held_ && (ImGui::IsMouseClicked(1) || ImGui::IsMouseClicked(0))) {
      held_ = session_.grab(x, y);
    }
    if (!by_hand) held_.reset();
    if (by_hand && held_ && moved) session_.drag(*held_, x, y);
    constexpr double kTurn = 0.006;  // radians a unit of the window
    if (!by_hand && ImGui::IsMouseDown(0) && moved) {
      session_.orbit(-kTurn * static_cast<double>(io.MouseDelta.x),
                     kTurn * static_cast<double>(io.MouseDelta.y), 0);
    }
    if (io.MouseWheel != 0) session_.orbit(0, 0, 0.1 * static_cast<double>(io.MouseWheel));
    return reshow;
  }

  void draw(const Place& place, const Texture& texture, double pictures_a_second) {
    ImDrawList& under = *ImGui::GetBackgroundDrawList();
    const ImVec2 end(place.corner.x + place.size.x, place.corner.y + place.size.y);
    under.AddImage(reinterpret_cast<ImTextureID>(static_cast<std::intptr_t>(texture.id())),
                   place.corner, end);
    for (const auto& [x, y] : session_.lamps_seen()) {
      const ImVec2 at(place.corner.x + static_cast<float>(x * place.scale),
                      place.corner.y + static_cast<float>(y * place.scale));
      under.AddCircle(at, 6, IM_COL32(255, 220, 90, 200), 16, 1.5f);
    }
    ImGui::SetNextWindowPos(ImVec2(10, 10), ImGuiCond_FirstUseEver);
    ImGui::Begin("Scene", nullptr, ImGuiWindowFlags_AlwaysAutoResize);
    if (ImGui::Button(session_.playing() ? "Pause" : "Play")) session_.play(!session_.playing());
    ImGui::SameLine();
    if (ImGui::Button("Back")) session_.step(-1);
    ImGui::SameLine();
    if (ImGui::Button("Step")) session_.step(1);
    int method = static_cast<int>(session_.method());
    if (ImGui::Combo("##method", &method, kMethods, kSceneMethods)) {
      session_.set_method(static_cast<SceneMethod>(method));
    }
    bool life = session_.shows_life();
    if (ImGui::Checkbox("life of records", &life)) session_.show_life(life);
    int frame = session_.frame();
    if (ImGui::SliderInt("frame", &frame, 0, std::max(session_.frames() - 1, 1))) {
      session_.step(frame - session_.frame());
    }
    const std::string line = session_.samples() > 0
                                 ? fmt::format("{} triangles, {} paths a pixel",
                                               session_.triangles(), session_.samples())
                                 : fmt::format("{} triangles", session_.triangles());
    ImGui::TextUnformatted(line.c_str());
    ImGui::TextUnformatted(fmt::format("{:.1f} pictures a second, {} x {}", pictures_a_second,
                                       session_.picture().width, session_.picture().height)
                               .c_str());
    ImGui::TextDisabled("drag: turn; right drag: move body or lamp; wheel: closer");
    ImGui::End();
  }

 private:
  SceneSession& session_;
  double exposure_;
  std::optional<SceneSession::Grab> held_;
};

}  // namespace

void show_scene(const SceneRunOptions& options, int width, int height, double scale) {
  SceneSession session(options.scene, options.settings);
  session.advance();
  Window window(width, height, scale);
  Texture texture;
  SceneInterface interface(session,
                           options.exposure_ev.value_or(auto_exposure_ev(session.picture())));
  session.play(options.frames > 0);
  bool reshow = true;
  int pictures = 1;
  PictureRate rate;
  double last_picture = glfwGetTime();
  bool rested = false;  // since the last picture
  while (!glfwWindowShouldClose(window.handle())) {
    glfwPollEvents();
    int pixels_wide = 0, pixels_high = 0;
    window.framebuffer(pixels_wide, pixels_high);
    if (pixels_wide < 1 || pixels_high < 1) {
      glfwWaitEventsTimeout(0.1);  // iconified
      continue;
    }
    if (reshow) {
      const bool life = session.shows_life() && !session.life().pixels.empty();
      const Image& picture = life ? session.life() : session.picture();
      texture.fill_rgba(picture.width, picture.height,
                        life ? bytes_of(picture, TonemapCurve::linear, 0)
                             : bytes_of(picture, options.curve, interface.exposure()));
    }
    window.begin_frame({});
    const Place place = place_of(session.picture());
    reshow = interface.take_input(place);
    interface.draw(place, texture, rate.a_second());
    glViewport(0, 0, pixels_wide, pixels_high);
    glClearColor(0.055f, 0.058f, 0.063f, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    window.end_frame();
    const bool last = options.frames > 0 && pictures >= options.frames;
    if (last && !options.screenshot.empty()) {
      save_image(options.screenshot, window.read_pixels(0, 0, pixels_wide, pixels_high));
    }
    window.show();
    if (last) break;
    if (session.frame() == options.pause_at) session.play(false);
    if (session.advance()) {
      reshow = true, ++pictures;
      const double now = glfwGetTime();
      if (!rested) rate.add(now - last_picture);
      last_picture = now, rested = false;
    } else if (options.frames > 0) {
      ++pictures;  // it is as good as it gets
    } else {
      rested = true;
      glfwWaitEventsTimeout(0.1);
    }
  }
  if (!options.exr.empty()) save_image(options.exr, session.picture());
}

}  // namespace haarlight::viewer
