// Polygons into triangles.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/vec.h"

namespace haarlight {

/// Cuts a polygon, convex or not, into corner count - 2 triangles over its corners' numbers
/// 0, 1, ... by clipping ears in its plane; a polygon that is no simple one is cut into a fan.
/// Fewer than three corners give nothing.
std::vector<std::array<std::uint32_t, 3>> triangulate(std::span<const Vec3> corners);

}  // namespace haarlight
