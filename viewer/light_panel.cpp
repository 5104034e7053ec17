// Draws and edits the light.

#include "viewer/light_panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "wavelet/projection.h"

namespace haarlight::viewer {
namespace {

constexpr int kMapHeight = 128;
constexpr int kRimPoints = 48;

ImTextureID texture_id(const Texture& texture) {
  return reinterpret_cast<ImTextureID>(static_cast<std::intptr_t>(texture.id()));
}

Vec3 map_direction(double u, double v) {
  return *projection_direction(Projection::latlong, std::clamp(u, 0.0, 1.0),
                               std::clamp(v, 0.0, 1.0));
}

double angle_between(const Vec3& a, const Vec3& b) {
  return std::acos(std::clamp(dot(a, b), -1.0, 1.0));
}

/// Points of a disc's rim on the map.
std::array<ImVec2, kRimPoints> rim(const DiscLight& disc, const ImVec2& corner, float width,
                                   float height) {
  const Vec3 helper = std::abs(disc.direction.y) < 0.9 ? Vec3{0, 1, 0} : Vec3{1, 0, 0};
  const Vec3 side = normalize(cross(helper, disc.direction)), up = cross(disc.direction, side);
  std::array<ImVec2, kRimPoints> points;
  for (int i = 0; i < kRimPoints; ++i) {
    const double t = 2 * kPi * i / kRimPoints;
    const PicturePoint at =
        projection_point(Projection::latlong,
                         disc.direction * std::cos(disc.half_angle) +
                             (side * std::cos(t) + up * std::sin(t)) * std::sin(disc.half_angle));
    points[static_cast<std::size_t>(i)] = {corner.x + width * static_cast<float>(at.u),
                                           corner.y + height * static_cast<float>(at.v)};
  }
  return points;
}

/// Scale and colour of a lamp: the largest channel, and the rest relative to it.
float strength(const Rgb& c) { return std::max({c.r, c.g, c.b, 1e-6f}); }

}  // namespace

void LightPanel::draw_map(float width, float height, float scale, ViewSettings& settings) {
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  ImGui::InvisibleButton("map", {width, height});
  const bool hovered = ImGui::IsItemHovered(), active = ImGui::IsItemActive();
  ImDrawList& draw = *ImGui::GetWindowDrawList();
  const ImVec2 end(corner.x + width, corner.y + height);
  if (map_.empty()) {
    draw.AddRectFilled(corner, end, IM_COL32(20, 21, 23, 255), 3);
  } else {
    draw.AddImage(texture_id(map_), corner, end);
  }

  const ImVec2 mouse = ImGui::GetIO().MousePos;
  const Vec3 under = map_direction((mouse.x - corner.x) / width, (mouse.y - corner.y) / height);
  const auto lamp = [&](int i) -> DiscLight& {
    return settings.discs[static_cast<std::size_t>(i)];
  };
  if (hovered && ImGui::IsMouseClicked(0)) {
    // The rim resizes, the inside moves; the lamp chosen last goes first.
    selected_ = -1;
    drag_ = Drag::none;
    const double grip = 0.06;
    for (int i = 0; i < settings.disc_count; ++i) {
      const double away = angle_between(under, lamp(i).direction);
      if (away > lamp(i).half_angle + grip) continue;
      selected_ = i;
      drag_ = std::abs(away - lamp(i).half_angle) < std::min(grip, 0.5 * lamp(i).half_angle)
                  ? Drag::resize
                  : Drag::move;
    }
  }
  if (hovered && ImGui::IsMouseDoubleClicked(0) && selected_ < 0 &&
      settings.disc_count < kMaxDiscs) {
    selected_ = settings.disc_count++;
    lamp(selected_) = DiscLight{under, 0.2, {20, 20, 20}};
    drag_ = Drag::move;
  }
  if (!active) drag_ = Drag::none;
  if (active && selected_ >= 0 && selected_ < settings.disc_count &&
      (ImGui::GetIO().MouseDelta.x != 0 || ImGui::GetIO().MouseDelta.y != 0)) {
    if (drag_ == Drag::move) lamp(selected_).direction = under;
    if (drag_ == Drag::resize) {
      lamp(selected_).half_angle =
          std::clamp(angle_between(under, lamp(selected_).direction), kMinDiscHalfAngle, 1.5);
    }
  }

  draw.PushClipRect(corner, end, true);
  for (int i = 0; i < settings.disc_count; ++i) {
    const auto points = rim(lamp(i), corner, width, height);
    const ImU32 color = i == selected_ ? IM_COL32(242, 158, 51, 255) : IM_COL32(240, 240, 240, 200);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const ImVec2& a = points[k];
      const ImVec2& b = points[(k + 1) % points.size()];
      // A line that would run across the whole map goes around behind it instead.
      if (std::abs(a.x - b.x) < 0.5f * width) draw.AddLine(a, b, color, 1.5f * scale);
    }
  }
  draw.PopClipRect();
  if (settings.disc_count == 0) {
    const char* hint = "double click: a lamp";
    const ImVec2 size = ImGui::CalcTextSize(hint);
    const ImVec2 at(corner.x + 6 * scale, end.y - size.y - 4 * scale);
    draw.AddRectFilled({at.x - 3 * scale, at.y - 1}, {at.x + size.x + 3 * scale, at.y + size.y + 1},
                       IM_COL32(0, 0, 0, 130), 3);
    draw.AddText(at, IM_COL32(230, 230, 230, 255), hint);
  }
}

void LightPanel::draw_lamps(ViewSettings& settings, float scale,
                            const std::function<void(const char*)>& mark) {
  if (ImGui::Button("Add lamp") && settings.disc_count < kMaxDiscs) {
    selected_ = settings.disc_count++;
    settings.discs[static_cast<std::size_t>(selected_)] =
        DiscLight{normalize({0.5, 0.7, -0.5}), 0.2, {20, 20, 20}};
  }
  mark("add lamp");
  if (selected_ < 0 || selected_ >= settings.disc_count) return;
  DiscLight& disc = settings.discs[static_cast<std::size_t>(selected_)];
  ImGui::SameLine();
  if (ImGui::Button("Remove")) {
    const auto first = settings.discs.begin() + selected_;
    std::move(first + 1, settings.discs.begin() + settings.disc_count, first);
    --settings.disc_count;
    // What is past the end counts when settings are compared.
    settings.discs[static_cast<std::size_t>(settings.disc_count)] = {};
    selected_ = -1;
    return;
  }
  mark("remove lamp");
  ImGui::SameLine();
  float size = static_cast<float>(disc.half_angle * 180 / kPi);
  ImGui::SetNextItemWidth(-1);
  if (ImGui::SliderFloat("##size", &size, 0.6f, 85, "%.1f deg", ImGuiSliderFlags_Logarithmic)) {
    disc.half_angle = std::max(kMinDiscHalfAngle, static_cast<double>(size) * kPi / 180);
  }
  mark("lamp size");
  const float scale_of = strength(disc.radiance);
  float color[3] = {disc.radiance.r / scale_of, disc.radiance.g / scale_of,
                    disc.radiance.b / scale_of};
  float radiance = scale_of;
  bool changed = ImGui::ColorEdit3("##colour", color,
                                   ImGuiColorEditFlags_NoInputs | ImGuiColorEditFlags_Float);
  ImGui::SameLine();
  ImGui::SetNextItemWidth(-1);
  changed |= ImGui::SliderFloat("##radiance", &radiance, 0.1f, 10000, "radiance %.1f",
                                ImGuiSliderFlags_Logarithmic);
  mark("lamp radiance");
  if (changed) disc.radiance = {radiance * color[0], radiance * color[1], radiance * color[2]};
  (void)scale;
}

void LightPanel::draw(const ViewFrame& frame, bool new_frame, double exposure_ev,
                      const LightPanelSize& size, float scale, ViewSettings& settings,
                      const std::function<void(const char*)>& mark) {
  const float width = size.width;
  const bool redraw =
      new_frame || exposure_ev != drawn_ev_ || unfolding_ != drawn_ || coverage_ != drawn_coverage_;
  if (frame.number > 0 && frame.lighting_filled && redraw) {
    const int n = frame.target.n;
    if (!unfolded_ || unfolding_ != drawn_ || unfolded_->face_size() != n) {
      unfolded_.emplace(unfolding_, n, unfolding_ == Unfolding::cross ? 192 : kMapHeight);
    }
    if (!flat_ || flat_->face_size() != n) flat_.emplace(Unfolding::latlong, n, kMapHeight);
    const auto fill = [&](const UnfoldedCube& cube, const Cubemap& map,
                          const std::vector<std::uint16_t>& touched, Texture& texture) {
      draw_cubemap(cube, map, exposure_ev, touched, rgba_);
      texture.fill_rgba(cube.width(), cube.height(), rgba_);
    };
    fill(*flat_, frame.target, {}, map_);
    fill(*unfolded_, frame.target, {}, target_);
    fill(*unfolded_, frame.shown, coverage_ ? frame.touched : std::vector<std::uint16_t>{}, shown_);
    drawn_ev_ = exposure_ev;
    drawn_ = unfolding_;
    drawn_coverage_ = coverage_;
  }

  draw_map(width, size.map_height, scale, settings);
  mark("map");
  draw_lamps(settings, scale, mark);

  ImGui::Spacing();
  ImGui::TextDisabled("shown");
  ImGui::SameLine(0.5f * width + 4 * scale);
  ImGui::TextDisabled("exact");
  const float half = 0.5f * width - 2 * scale;
  // Not of `half`: a scroll bar that comes must not change heights, or it would go again.
  const float full = 0.5f * size.full_width - 2 * scale;
  const float high = unfolded_ ? full * static_cast<float>(unfolded_->height()) /
                                     static_cast<float>(unfolded_->width())
                               : 0.5f * full;
  if (!shown_.empty()) {
    ImGui::Image(texture_id(shown_), {half, high});
    ImGui::SameLine(0, 4 * scale);
    ImGui::Image(texture_id(target_), {half, high});
  }
  int unfolding = static_cast<int>(unfolding_);
  ImGui::RadioButton("lat-long", &unfolding, 0);
  ImGui::SameLine();
  ImGui::RadioButton("cube", &unfolding, 1);
  mark("cube");
  unfolding_ = static_cast<Unfolding>(unfolding);
  ImGui::SameLine();
  ImGui::Checkbox("wavelets", &coverage_);
  if (ImGui::IsItemHovered()) {
    ImGui::SetTooltip("in orange: where the wavelets of this frame lie");
  }
}

}  // namespace haarlight::viewer
