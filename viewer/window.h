// The window: GLFW, an OpenGL 3.3 core context and Dear ImGui on top of it.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/image.h"

struct GLFWwindow;

namespace haarlight::viewer {

/// Input that a script puts in place of a person's.
struct ScriptedPointer {
  bool active = false;
  float x = 0, y = 0;
  bool down = false;
  int button = 0;  ///< left, right, middle
  float scroll = 0;
};

/// One a program. Throws Error{missing} where there is no display or no OpenGL 3.3.
class Window {
 public:
  /// `scale` of text and widgets; 0: as the display says.
  Window(int width, int height, double scale);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  GLFWwindow* handle() const { return window_; }
  double scale() const { return scale_; }
  /// Size of the framebuffer in pixels.
  void framebuffer(int& width, int& height) const;
  /// Framebuffer pixels in a unit of the window.
  double pixel_ratio() const;

  /// Files that were dropped since the last call.
  std::vector<std::filesystem::path> take_dropped();
  void drop(const std::filesystem::path& file) { dropped_.push_back(file); }
  void stir() { activity_ = true; }
  /// Whether something came in since the last call.
  bool take_activity();

  void begin_frame(const ScriptedPointer& pointer);
  void end_frame();  ///< draws the widgets; show() puts all on the screen
  void show();
  /// What was drawn, from the top left, linear in [0, 1] as save_image takes it for PNG.
  Image read_pixels(int x, int y, int width, int height) const;

  /// Sends a key through the callbacks that GLFW would call.
  void send_key(int key, bool down, int modifiers);
  void send_text(const std::string& text);

 private:
  GLFWwindow* window_ = nullptr;
  double scale_ = 1;
  std::vector<std::filesystem::path> dropped_;
  bool activity_ = true;
};

}  // namespace haarlight::viewer
