// The sky as light that has been reflected sees it: squares of texels, in phases.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "precompute/direction_table.h"
#include "precompute/sparse_directions.h"
#include "wavelet/haar.h"

namespace haarlight {

/// Directions of the squares, the built-in lightings in them, and the way from squares to texels.
/// Immutable.
class IndirectSky {
 public:
  /// `resolution`: squares along an edge of a cube face, a power of two, at most table.n.
  IndirectSky(const DirectionTable& table, int resolution);

  const HaarLayout& layout() const { return layout_; }
  const SparseDirections& directions() const { return directions_; }
  std::size_t phases() const { return static_cast<std::size_t>(directions_.phases()); }
  std::size_t slots() const { return directions_.slots(); }
  /// Sums of a row: phase * slots() + slot.
  std::size_t row_size() const { return phases() * slots(); }

  /// Built-in lightings, and black ones up to a multiple of four.
  std::size_t lights() const { return lights_; }
  /// [packet][light][8]: radiance of a phase's squares.
  const float* light_of(std::size_t phase) const {
    return light_.data() + phase * lights_ * slots();
  }
  /// [light]: radiance of a texel.
  const float* light_in(std::size_t texel) const { return light_texels_.data() + texel * lights_; }

  /// picture[l] += what a row of texels shows under light l, as seen by squares.
  void add_picture(const float* texels, float* picture) const;
  /// texels[k] += scale * share of texel k in its square * the square's sum, sums as in row_size().
  void add_sums(const float* sums, float scale, float* texels) const;

 private:
  HaarLayout layout_;
  SparseDirections directions_;
  std::size_t side_, width_;          // squares along an edge; texels along one's
  std::vector<std::uint32_t> place_;  // of squares, face by face and line by line: in a row
  std::vector<float> share_;          // per texel
  std::size_t lights_ = 0;
  std::vector<float> light_;          // [phase][packet][light][8]
  std::vector<float> light_squares_;  // [packet of squares line by line][light][8]
  std::vector<float> light_texels_;   // [texel][light]
};

}  // namespace haarlight
