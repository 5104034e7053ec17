// Opens the window, feeds Dear ImGui.

#include "viewer/window.h"

#include <epoxy/gl.h>
// OpenGL's names come from libepoxy.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>
#include <imgui_impl_glfw.h>
#include <imgui_impl_opengl3.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/error.h"

namespace haarlight::viewer {
namespace {

constexpr double kTextPixels = 15;
constexpr std::array<const char*, 2> kFonts = {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
                                               "/usr/share/fonts/TTF/DejaVuSans.ttf"};

std::string last_glfw_error() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text ? text : "no reason given";
}

/// Dark greys, one accent; nothing rounder than it must be.
void set_style(double scale) {
  ImGui::StyleColorsDark();
  ImGuiStyle& style = ImGui::GetStyle();
  style.WindowRounding = 0;
  style.ChildRounding = 3;
  style.FrameRounding = 3;
  style.GrabRounding = 3;
  style.PopupRounding = 4;
  style.WindowBorderSize = 0;
  style.FramePadding = {7, 4};
  style.ItemSpacing = {8, 6};
  style.WindowPadding = {12, 10};
  style.ScaleAllSizes(static_cast<float>(scale));
  const ImVec4 accent(0.95f, 0.62f, 0.20f, 1);
  const auto faded = [&](float alpha) { return ImVec4(accent.x, accent.y, accent.z, alpha); };
  auto& c = style.Colors;
  c[ImGuiCol_WindowBg] = {0.105f, 0.11f, 0.12f, 1};
  c[ImGuiCol_PopupBg] = {0.13f, 0.135f, 0.15f, 0.98f};
  c[ImGuiCol_ChildBg] = {0, 0, 0, 0};
  c[ImGuiCol_Text] = {0.90f, 0.90f, 0.88f, 1};
  c[ImGuiCol_TextDisabled] = {0.58f, 0.59f, 0.60f, 1};
  c[ImGuiCol_FrameBg] = {0.19f, 0.195f, 0.21f, 1};
  c[ImGuiCol_FrameBgHovered] = {0.25f, 0.255f, 0.27f, 1};
  c[ImGuiCol_FrameBgActive] = {0.29f, 0.295f, 0.31f, 1};
  c[ImGuiCol_Button] = {0.22f, 0.225f, 0.245f, 1};
  c[ImGuiCol_ButtonHovered] = {0.30f, 0.305f, 0.33f, 1};
  c[ImGuiCol_ButtonActive] = faded(0.75f);
  c[ImGuiCol_Header] = {0.20f, 0.205f, 0.225f, 1};
  c[ImGuiCol_HeaderHovered] = {0.27f, 0.275f, 0.30f, 1};
  c[ImGuiCol_HeaderActive] = {0.31f, 0.315f, 0.34f, 1};
  c[ImGuiCol_SliderGrab] = faded(0.85f);
  c[ImGuiCol_SliderGrabActive] = accent;
  c[ImGuiCol_CheckMark] = accent;
  c[ImGuiCol_PlotLines] = accent;
  c[ImGuiCol_PlotHistogram] = accent;
  c[ImGuiCol_Separator] = {0.24f, 0.245f, 0.26f, 1};
  c[ImGuiCol_TitleBgActive] = c[ImGuiCol_TitleBg] = {0.15f, 0.155f, 0.17f, 1};
}

void load_font(double pixels) {
  ImFontAtlas& fonts = *ImGui::GetIO().Fonts;
  for (const char* file : kFonts) {
    std::error_code error;
    if (!std::filesystem::exists(file, error)) continue;
    fonts.AddFontFromFileTTF(file, static_cast<float>(std::round(pixels)));
    return;
  }
  ImFontConfig config;
  config.SizePixels = static_cast<float>(std::round(pixels));
  fonts.AddFontDefault(&config);
}

void stir_window(GLFWwindow* window) {
  static_cast<Window*>(glfwGetWindowUserPointer(window))->stir();
}

float linear_of_byte(std::uint8_t byte) {
  const double x = byte / 255.0;
  return static_cast<float>(x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4));
}

}  // namespace

Window::Window(int width, int height, double scale) {
  if (!glfwInit()) {
    throw Error(ErrorKind::missing,
                fmt::format("cannot open a window ({}), expected a display, or --headless",
                            last_glfw_error()));
  }
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  glfwWindowHint(GLFW_DEPTH_BITS, 0);
  glfwWindowHint(GLFW_STENCIL_BITS, 0);
  window_ = glfwCreateWindow(width, height, "Haarlight", nullptr, nullptr);
  if (!window_) {
    const std::string reason = last_glfw_error();
    glfwTerminate();
    throw Error(ErrorKind::missing,
                fmt::format("cannot open a window with OpenGL 3.3 ({}), expected a driver that "
                            "has it, or --headless",
                            reason));
  }
  glfwMakeContextCurrent(window_);
  glfwSwapInterval(1);
  float display = 1, ignored = 1;
  glfwGetWindowContentScale(window_, &display, &ignored);
  // Where windows are measured in units larger than pixels, the display does the scaling.
  scale_ = scale > 0 ? scale : std::clamp(static_cast<double>(display) / pixel_ratio(), 0.5, 4.0);

  glfwSetWindowUserPointer(window_, this);
  glfwSetDropCallback(window_, [](GLFWwindow* w, int count, const char** files) {
    auto* window = static_cast<Window*>(glfwGetWindowUserPointer(w));
    for (int i = 0; i < count; ++i) window->drop(files[i]);
    window->stir();
  });
  glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double, double) { stir_window(w); });
  glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int, int, int) { stir_window(w); });
  glfwSetScrollCallback(window_, [](GLFWwindow* w, double, double) { stir_window(w); });
  glfwSetKeyCallback(window_, [](GLFWwindow* w, int, int, int, int) { stir_window(w); });
  glfwSetCharCallback(window_, [](GLFWwindow* w, unsigned) { stir_window(w); });
  glfwSetFramebufferSizeCallback(window_, [](GLFWwindow* w, int, int) { stir_window(w); });
  glfwSetWindowRefreshCallback(window_, [](GLFWwindow* w) { stir_window(w); });

  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;  // viewer/preferences remembers what is to be remembered
  set_style(scale_);
  load_font(kTextPixels * scale_);
  // Chains to the callbacks above.
  ImGui_ImplGlfw_InitForOpenGL(window_, true);
  ImGui_ImplOpenGL3_Init("#version 330 core");
}

Window::~Window() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwDestroyWindow(window_);
  glfwTerminate();
}

void Window::framebuffer(int& width, int& height) const {
  glfwGetFramebufferSize(window_, &width, &height);
}

double Window::pixel_ratio() const {
  int width = 0, height = 0, units = 0, ignored = 0;
  framebuffer(width, height);
  glfwGetWindowSize(window_, &units, &ignored);
  return units > 0 && width > 0 ? static_cast<double>(width) / units : 1.0;
}

std::vector<std::filesystem::path> Window::take_dropped() { return std::exchange(dropped_, {}); }

bool Window::take_activity() { return std::exchange(activity_, false); }

void Window::begin_frame(const ScriptedPointer& pointer) {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  if (pointer.active) {
    ImGuiIO& io = ImGui::GetIO();
    io.MousePos = {pointer.x, pointer.y};
    for (int button = 0; button < 3; ++button) {
      io.MouseDown[button] = pointer.down && button == pointer.button;
    }
    io.MouseWheel += pointer.scroll;
  }
  ImGui::NewFrame();
}

void Window::end_frame() {
  ImGui::Render();
  int width = 0, height = 0;
  framebuffer(width, height);
  glViewport(0, 0, width, height);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

void Window::show() { glfwSwapBuffers(window_); }

Image Window::read_pixels(int x, int y, int width, int height) const {
  int all_width = 0, all_height = 0;
  framebuffer(all_width, all_height);
  Image out(width, height);
  std::vector<std::uint8_t> bytes(3 * out.pixels.size());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(x, all_height - y - height, width, height, GL_RGB, GL_UNSIGNED_BYTE, bytes.data());
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) {
      const std::uint8_t* p = &bytes[3 * out.index(i, height - 1 - j)];
      out.at(i, j) = {linear_of_byte(p[0]), linear_of_byte(p[1]), linear_of_byte(p[2])};
    }
  }
  return out;
}

void Window::send_key(int key, bool down, int modifiers) {
  // GLFW hands out the callback only by taking another in its place.
  const GLFWkeyfun callback = glfwSetKeyCallback(window_, nullptr);
  glfwSetKeyCallback(window_, callback);
  if (callback) callback(window_, key, 0, down ? GLFW_PRESS : GLFW_RELEASE, modifiers);
}

void Window::send_text(const std::string& text) {
  const GLFWcharfun callback = glfwSetCharCallback(window_, nullptr);
  glfwSetCharCallback(window_, callback);
  for (const char c : text) {
    if (callback) callback(window_, static_cast<unsigned char>(c));
  }
}

}  // namespace haarlight::viewer
