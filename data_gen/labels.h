// The labelled test environment: what is drawn where, so that tests can state it.

#pragma once

#include <array>
#include <string_view>

#include "core/rgb.h"
#include "core/vec.h"

namespace haarlight::data_gen {

/// One axis as someone in the middle sees it who looks along `direction` with `up` upwards; `right`
/// is cross(direction, up). Looking up or down, the head is tilted from the front, so that front
/// is at the lower edge when looking up and at the upper edge when looking down.
struct AxisLabel {
  Vec3 direction, up, right;
  std::string_view word, axis;  ///< written above and below the disc
  RgbD color;                   ///< of the disc
};

inline constexpr std::array<AxisLabel, 6> kAxisLabels{{
    {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, "RIGHT", "+X", {0.9, 0.05, 0.05}},
    {{-1, 0, 0}, {0, 1, 0}, {0, 0, -1}, "LEFT", "-X", {0.05, 0.75, 0.8}},
    {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}, "UP", "+Y", {0.1, 0.7, 0.05}},
    {{0, -1, 0}, {0, 0, -1}, {1, 0, 0}, "DOWN", "-Y", {0.8, 0.1, 0.75}},
    {{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}, "BACK", "+Z", {0.1, 0.15, 0.9}},
    {{0, 0, -1}, {0, 1, 0}, {1, 0, 0}, "FRONT", "-Z", {0.95, 0.7, 0.05}},
}};

/// On the plane at distance 1 along the axis, x to the right and y up: the disc has this radius,
/// a letter's cell this size, and the words' lower left corners stand at these heights.
inline constexpr double kLabelDiscRadius = 0.16;
inline constexpr double kLabelCell = 0.045;
inline constexpr double kWordBottom = 0.26;
inline constexpr double kAxisBottom = -0.26 - 7 * kLabelCell;

/// Radiance of the labelled environment from a unit direction; within [0, 1].
RgbD label_radiance(const Vec3& direction);

}  // namespace haarlight::data_gen
