// Points of tens of thousands of dimensions, in a few hundred.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/progress.h"
#include "cpca/vertex_rows.h"

namespace haarlight {

/// One row a vertex, [vertex][dimension].
struct Sketch {
  int dims = 0;
  std::vector<float> value;
  std::size_t count() const { return value.size() / static_cast<std::size_t>(dims); }
  const float* point(std::size_t i) const {
    return value.data() + i * static_cast<std::size_t>(dims);
  }
  float* point(std::size_t i) { return value.data() + i * static_cast<std::size_t>(dims); }
};

/// Projects every vertex's point on `dims` random directions of signs, 1 / sqrt(dims) each: squared
/// lengths and distances are kept in the mean, to a relative standard error of at most
/// sqrt(2 / dims) (Achlioptas 2003). Of grey vertices colours count as their length. The transport
/// is streamed once; dims is a multiple of 64. A vertex without transport is at exactly 0. The same
/// bits on any number of threads. Throws Error{cancelled}.
Sketch sketch_rows(const VertexRows& rows, int dims, std::uint64_t seed, const Progress& progress);

}  // namespace haarlight
