// The inner loop of putting vertices together: sums of a cluster's vertices += weights * deltas.
// Private to cpca/ and bench/.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace haarlight {

/// Vertices of a cluster are padded to a multiple of this.
inline constexpr std::size_t kWeightLanes = 8;

/// One vector's weights, as many as there are vertices, and what one of them stands for, RGB.
struct WeightTask {
  const std::int16_t* weights;
  double factor[3];
};

/// sums[channel * vertices + v] += sum over tasks of weights[v] * factor[channel], each vertex
/// adding its tasks in the order given. `vertices` is a multiple of kWeightLanes. Picks the version
/// for the machine once; the portable one is what the others are tested against.
void add_weights(std::span<const WeightTask> tasks, std::size_t vertices, double* sums);
void add_weights_portable(std::span<const WeightTask> tasks, std::size_t vertices, double* sums);

}  // namespace haarlight
