// Rows of a mesh's transport, taken out vertex by vertex: a vertex is one point.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/rgb.h"
#include "prt/transport.h"

namespace haarlight {

/// The points that clustered PCA works on: of each vertex its rows over all terms, one after the
/// other (Liu and others 2004), since a vertex's weights are shared by its terms.
///
/// Grey rows are scaled by the length of their colour, so that a row of a bright vertex weighs
/// more, and what is left of the colour, of length sqrt(3), stays with the vertex.
class VertexRows {
 public:
  /// Throws Error{invalid_argument} unless the transport is of a mesh.
  explicit VertexRows(Transport transport);

  const Transport& transport() const { return transport_; }
  std::size_t vertices() const { return vertices_; }
  int terms() const { return transport_.info().terms; }
  /// Whether any of the vertex's rows has three channels.
  bool is_rgb(std::size_t vertex) const { return rgb_[vertex] != 0; }
  bool any_rgb() const { return any_rgb_; }
  /// Of a grey row: what its coloured sum is multiplied with. 1 for a black or an RGB row.
  Rgb tint(std::size_t vertex, int term) const;

  /// Points of `vertices`, [vertex][term][channel][coefficient]; `channels` is 1, for grey vertices
  /// alone and without their tint, or 3, tints applied.
  void read(std::span<const std::uint32_t> vertices, int channels, std::vector<float>& out) const;
  std::size_t point_size(int channels) const;

  /// A stored row of the transport by (vertex, term), vertex * terms + term.
  std::span<const std::uint32_t> row_of() const { return row_of_; }
  /// Length of a stored grey row's colour over sqrt(3).
  float weight(std::size_t row) const;

 private:
  Transport transport_;
  std::size_t vertices_ = 0;
  std::vector<std::uint32_t> row_of_;
  std::vector<std::uint8_t> rgb_;
  bool any_rgb_ = false;
};

}  // namespace haarlight
