// The vectors of one cluster and how its vertices are put together from them.

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "cpca/sketch.h"
#include "cpca/vertex_rows.h"

namespace haarlight {

/// X, the points of n vertices, in S vectors (Overbeck 2006, Eq. 8; Liu and others 2004):
///   x_v ~ sum over i of w_iv b_i,   b_i = u_i^T X / sqrt(n),   w_iv = sqrt(n) u_iv,
/// u_i the left singular vectors of X, so that weights are 1 in the root mean square over the
/// vertices and an error of a vector's entry weighs alike in all of them. Without a mean taken off:
/// of all linear forms of S vectors this one leaves least, the mean and S - 1 others included
/// (Eckart and Young 1936).
struct ClusterBasis {
  int channels = 1;            ///< 1: grey, tints left out; 3: colours applied
  std::size_t count = 0;       ///< S; fewer than asked for if the points have no more dimensions
  std::vector<float> vector;   ///< [vector][term][channel][coefficient]
  std::vector<double> weight;  ///< [vector][vertex]
  /// What the vertices show under each lighting, exactly: [lighting][vertex][term][channel].
  std::vector<float> exact;
};

/// The basis of `vertices`, of at most `most` vectors; `lightings` are coefficients of grey
/// lightings, for ClusterBasis::exact. Memory: at most 256 points at a time, besides the basis.
///
/// Up to 256 vertices the vectors come from the points' Gram matrix, in double. Of more than that
/// the points are projected first on the leading left singular vectors of their sketch (a range
/// finder with far more samples than vectors; Halko, Martinsson and Tropp 2011), twice as many as
/// asked for and 16 more, and the vectors are the best ones in there.
ClusterBasis find_basis(const VertexRows& rows, const Sketch& sketch,
                        std::span<const std::uint32_t> vertices, std::size_t most,
                        std::span<const std::vector<float>> lightings);

/// Estimated singular values of the points, falling, over sqrt(n), from their sketch alone.
std::vector<double> estimated_sizes(const Sketch& sketch, std::span<const std::uint32_t> vertices);

}  // namespace haarlight
