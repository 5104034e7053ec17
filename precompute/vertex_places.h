// Which vertices stand at one place.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/vec.h"

namespace haarlight {

/// For each position the smallest index of those equal to it: vertices that only differ in normal,
/// texture coordinate or material share a place.
std::vector<std::uint32_t> vertex_places(std::span<const Vec3> positions);

}  // namespace haarlight
