// Equation 4 for the points of a picture, patch by patch.

#pragma once

#include <functional>
#include <span>
#include <vector>

#include "caching/record_blocks.h"
#include "caching/record_index.h"
#include "caching/surface_points.h"

namespace haarlight {

/// Patches of the picture are this wide and high, pixels.
inline constexpr int kPatch = 16;

/// Adds an index's records to the sums of all points of a picture, in the order of `rows`. Points
/// of a patch that lie close together and face the same way are taken together: the index is asked
/// once for all of them. `use` is called for records that reach a
/// point, by any thread and more than once. `per_unit` as in surface_coordinates(). The same bits
/// on any number of threads.
void add_patches(const RecordIndex& index, std::span<const SurfaceRow> rows, double per_unit,
                 const RecordReach& reach, const std::function<void(std::uint32_t)>& use,
                 std::vector<std::vector<RecordSum>>& sums);

}  // namespace haarlight
