// The labelled test environment.

#include "data_gen/labels.h"

#include <algorithm>
#include <cmath>

#include "data_gen/bitmap_font.h"
#include "data_gen/environments.h"

namespace haarlight::data_gen {
namespace {

constexpr RgbD kInk{0.01, 0.01, 0.01};
constexpr RgbD kLine{0.75, 0.75, 0.75};

// Is (x, y) on the axis plane inked by `text`, centred, with its lowest row of cells at `bottom`?
bool text_covers(std::string_view text, double bottom, double x, double y) {
  const double cells = static_cast<double>(text.size()) * kGlyphAdvance - 1;
  const double column = std::floor(x / kLabelCell + 0.5 * cells);
  const double row = kGlyphHeight - 1 - std::floor((y - bottom) / kLabelCell);
  return text_cell(text, static_cast<int>(column), static_cast<int>(row));
}

// Lines every 30 degrees of height and of azimuth; the horizon is twice as wide.
bool on_grid(const Vec3& d) {
  constexpr double kStep = kPi / 6, kHalfWidth = 0.006;
  const double height = std::asin(std::clamp(d.y, -1.0, 1.0));
  if (std::abs(height) < 2 * kHalfWidth) return true;
  if (std::abs(height - kStep * std::round(height / kStep)) < kHalfWidth) return true;
  const double azimuth = std::atan2(d.x, -d.z);
  const double off = std::abs(azimuth - kStep * std::round(azimuth / kStep)) * std::hypot(d.x, d.z);
  return off < kHalfWidth && std::abs(height) < 1.3;
}

}  // namespace

RgbD label_radiance(const Vec3& direction) {
  const AxisLabel* label = &kAxisLabels[0];
  for (const AxisLabel& other : kAxisLabels) {
    if (dot(direction, other.direction) > dot(direction, label->direction)) label = &other;
  }
  const double depth = dot(direction, label->direction);
  const double x = dot(direction, label->right) / depth, y = dot(direction, label->up) / depth;
  if (x * x + y * y < kLabelDiscRadius * kLabelDiscRadius) return label->color;
  if (text_covers(label->word, kWordBottom, x, y)) return kInk;
  if (text_covers(label->axis, kAxisBottom, x, y)) return kInk;
  if (on_grid(direction)) return kLine;
  // A breath of the axis' colour, bluer above and browner below.
  const RgbD pale = RgbD{0.42, 0.42, 0.42} + label->color * 0.25;
  return pale * (direction.y >= 0 ? RgbD{0.85, 0.95, 1.05} : RgbD{0.95, 0.80, 0.65});
}

EnvironmentModel make_labels(std::uint64_t /*seed*/) {
  EnvironmentModel model;
  model.smooth = label_radiance;
  model.display_referred = true;
  return model;
}

}  // namespace haarlight::data_gen
