// Plots of the last frames.

#include "viewer/history.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace haarlight::viewer {
namespace {

constexpr ImU32 kOrange = IM_COL32(242, 158, 51, 255);
constexpr ImU32 kBlue = IM_COL32(92, 160, 224, 255);
constexpr ImU32 kGreen = IM_COL32(120, 190, 110, 255);
constexpr ImU32 kGrey = IM_COL32(150, 152, 155, 255);
constexpr ImU32 kDim = IM_COL32(64, 66, 70, 255);
constexpr ImU32 kText = IM_COL32(225, 225, 220, 255);
constexpr ImU32 kGround = IM_COL32(20, 21, 23, 255);

struct Box {
  float x, y, width, height;
};

/// Title and ground of a plot; what is left below the title.
Box frame_plot(float x, float y, float width, float height, const char* title) {
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const float line = ImGui::GetTextLineHeightWithSpacing();
  draw.AddText({x, y}, kGrey, title);
  draw.AddRectFilled({x, y + line}, {x + width, y + height}, kGround, 3);
  return {x, y + line, width, height - line};
}

void put_text(float x, float y, ImU32 color, const std::string& text) {
  ImGui::GetWindowDrawList()->AddText({x, y}, color, text.c_str());
}

float text_width(const std::string& text) { return ImGui::CalcTextSize(text.c_str()).x; }

/// A round number at or above `value`: 1, 2 or 5 times a power of ten.
double round_up(double value) {
  if (!(value > 1e-9)) return 1e-9;
  const double power = std::pow(10, std::floor(std::log10(value)));
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (digit * power >= value * (1 - 1e-9)) return digit * power;
  }
  return 10 * power;
}

/// One curve, newest at the right; values below 0 are gaps.
template <typename Value>
void curve(const Box& box, std::size_t count, double top, ImU32 color, float thick,
           const Value& value) {
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const float step = box.width / static_cast<float>(History::kFrames - 1);
  ImVec2 before;
  bool joined = false;
  for (std::size_t i = 0; i < count; ++i) {
    const double v = value(i);
    if (v < 0) {
      joined = false;
      continue;
    }
    const ImVec2 at(box.x + box.width - static_cast<float>(i) * step,
                    box.y + box.height -
                        static_cast<float>(std::clamp(v / top, 0.0, 1.0)) * (box.height - 2) - 1);
    if (joined) draw.AddLine(before, at, color, thick);
    before = at;
    joined = true;
  }
}

}  // namespace

const History::Entry& History::at(std::size_t back) const {
  return entries_[(count_ - 1 - back) % kFrames];
}

void History::add(const ViewFrame& frame) {
  Entry& e = entries_[count_++ % kFrames];
  const FrameMetrics& m = frame.metrics;
  e.lighting_error = static_cast<float>(m.lighting_error);
  e.image_error = m.image_rel_rmse ? static_cast<float>(*m.image_rel_rmse) : -1.0f;
  e.light_ms = static_cast<float>(frame.light_ms);
  e.update_ms = static_cast<float>(m.update_ms);
  e.apply_ms = static_cast<float>(m.apply_ms);
  e.finish_ms = static_cast<float>(m.finish_ms);
  e.resets = static_cast<std::uint16_t>(frame.resets.to_ulong());
  e.touched = 0;
  e.updates = frame.band_updates;
  bands_ = frame.band_count;
  for (int b = 0; b < bands_; ++b) {
    if (e.updates[static_cast<std::size_t>(b)] > 0) {
      e.touched = static_cast<std::uint16_t>(e.touched | 1u << b);
    }
  }
}

void History::draw_errors(float x, float y, float width, float height, float scale) const {
  const Box box = frame_plot(x, y, width, height, "error");
  double top = 1e-6;
  for (std::size_t i = 0; i < size(); ++i) {
    top = std::max(
        {top, static_cast<double>(at(i).lighting_error), static_cast<double>(at(i).image_error)});
  }
  top = round_up(top);
  curve(box, size(), top, kOrange, 1.6f * scale,
        [&](std::size_t i) { return static_cast<double>(at(i).lighting_error); });
  curve(box, size(), top, kBlue, 1.6f * scale,
        [&](std::size_t i) { return static_cast<double>(at(i).image_error); });
  put_text(box.x + 5 * scale, box.y + 3 * scale, kGrey, fmt::format("{:g}", top));
  if (size() == 0) return;
  const std::string lighting = fmt::format("lighting {:.4f}", at(0).lighting_error);
  const float right = box.x + box.width - 6 * scale;
  put_text(right - text_width(lighting), box.y + 3 * scale, kOrange, lighting);
  const std::string image = at(0).image_error >= 0
                                ? fmt::format("picture {:.4f}", at(0).image_error)
                                : std::string("picture: compare (C)");
  put_text(right - text_width(image), box.y + 3 * scale + ImGui::GetTextLineHeight(),
           at(0).image_error >= 0 ? kBlue : kDim, image);
}

void History::draw_times(float x, float y, float width, float height, float scale) const {
  const Box box = frame_plot(x, y, width, height, "time of a frame, ms");
  double top = 1;
  for (std::size_t i = 0; i < size(); ++i) {
    const Entry& e = at(i);
    top = std::max(top, static_cast<double>(e.light_ms + e.update_ms + e.apply_ms + e.finish_ms));
  }
  // One slow frame, as the exact one at the start, must not flatten all others.
  if (size() > 8) {
    std::array<float, kFrames> sums{};
    for (std::size_t i = 0; i < size(); ++i) {
      const Entry& e = at(i);
      sums[i] = e.light_ms + e.update_ms + e.apply_ms + e.finish_ms;
    }
    const auto high = sums.begin() + static_cast<std::ptrdiff_t>(size() * 95 / 100);
    std::nth_element(sums.begin(), high, sums.begin() + static_cast<std::ptrdiff_t>(size()));
    top = std::max(1e-2, 1.25 * static_cast<double>(*high));
  }
  top = round_up(top);
  if (top > 16.7) {
    const float limit = box.y + box.height * (1 - static_cast<float>(16.7 / top));
    ImGui::GetWindowDrawList()->AddLine({box.x, limit}, {box.x + box.width, limit}, kDim);
  }
  // Stacked: deciding, applying, finishing, making the light.
  struct Part {
    const char* name;
    ImU32 color;
    float Entry::*value;
  };
  const Part parts[] = {{"decide", kGreen, &Entry::update_ms},
                        {"apply", kOrange, &Entry::apply_ms},
                        {"finish", kBlue, &Entry::finish_ms},
                        {"light", kGrey, &Entry::light_ms}};
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const float step = box.width / static_cast<float>(kFrames);
  draw.PushClipRect({box.x, box.y}, {box.x + box.width, box.y + box.height}, true);
  for (std::size_t i = 0; i < size(); ++i) {
    float low = box.y + box.height;
    const float right = box.x + box.width - static_cast<float>(i) * step;
    for (const Part& part : parts) {
      const float high = low - box.height * at(i).*part.value / static_cast<float>(top);
      draw.AddRectFilled({right - step, high}, {right, low}, part.color);
      low = high;
    }
  }
  draw.PopClipRect();
  put_text(box.x + 5 * scale, box.y + 3 * scale, kText, fmt::format("{:g}", top));
  if (size() == 0) return;
  float at_y = box.y + 3 * scale;
  for (const Part& part : parts) {
    const std::string text = fmt::format("{} {:.2f}", part.name, at(0).*part.value);
    const float left = box.x + box.width - 6 * scale - text_width(text);
    draw.AddRectFilled({left - 3 * scale, at_y},
                       {left + text_width(text) + 3 * scale, at_y + ImGui::GetTextLineHeight()},
                       IM_COL32(20, 21, 23, 190));
    put_text(left, at_y, part.color, text);
    at_y += ImGui::GetTextLineHeight();
  }
}

// Overbeck 2006, Figure 9: a row a band, a column a frame; dark where the band was reset.
void History::draw_bands(float x, float y, float width, float height, float scale) const {
  const Box box = frame_plot(x, y, width, height, "bands, coarse to fine:");
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  float legend = box.x + text_width("bands, coarse to fine:") + 8 * scale;
  for (const auto& [color, word] : {std::pair{kOrange, "incremental"}, std::pair{kBlue, "reset"}}) {
    put_text(legend, y, color, word);
    legend += text_width(word) + 8 * scale;
  }
  if (bands_ == 0 || size() == 0) return;
  const float row = box.height / static_cast<float>(bands_);
  const float step = box.width / static_cast<float>(kFrames);
  for (int b = 0; b < bands_; ++b) {
    const float top = box.y + static_cast<float>(b) * row;
    for (std::size_t i = 0; i < size(); ++i) {
      const bool reset = at(i).resets >> b & 1, touched = at(i).touched >> b & 1;
      if (!reset && !touched) continue;
      const float right = box.x + box.width - static_cast<float>(i) * step;
      draw.AddRectFilled({right - step, top + 1}, {right, top + row - 1}, reset ? kBlue : kOrange);
    }
  }
}

// Overbeck 2006, Figure 4: how many of the frame's wavelets each band got.
void History::draw_updates(float x, float y, float width, float height, float scale) const {
  const Box box = frame_plot(x, y, width, height, "updates a band");
  if (bands_ == 0 || size() == 0) return;
  const Entry& now = at(0);
  const int most = std::max(1, *std::max_element(now.updates.begin(), now.updates.end()));
  const float row = box.height / static_cast<float>(bands_);
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const float line = ImGui::GetTextLineHeight();
  const float digits = text_width("00000") + 8 * scale;
  for (int b = 0; b < bands_; ++b) {
    const int count = now.updates[static_cast<std::size_t>(b)];
    const float top = box.y + static_cast<float>(b) * row;
    draw.AddRectFilled(
        {box.x, top + 1},
        {box.x + (box.width - digits) * static_cast<float>(count) / static_cast<float>(most),
         top + row - 1},
        now.resets >> b & 1 ? kBlue : kOrange);
    const std::string text = std::to_string(count);
    put_text(box.x + box.width - 5 * scale - text_width(text), top + 0.5f * (row - line), kText,
             text);
  }
}

void History::draw(float width, float height, float scale) const {
  const ImVec2 at_corner = ImGui::GetCursorScreenPos();
  const float gap = 12 * scale, unit = (width - 3 * gap) / 10;
  float x = at_corner.x;
  draw_errors(x, at_corner.y, 2.7f * unit, height, scale);
  x += 2.7f * unit + gap;
  draw_times(x, at_corner.y, 2.7f * unit, height, scale);
  x += 2.7f * unit + gap;
  draw_bands(x, at_corner.y, 3.0f * unit, height, scale);
  x += 3.0f * unit + gap;
  draw_updates(x, at_corner.y, 1.6f * unit, height, scale);
}

}  // namespace haarlight::viewer
