// What is kept of a transport to judge pictures without making them: sketches, norms and sums of
// its columns.

#pragma once

#include <cstddef>
#include <vector>

#include "core/huge_page_vector.h"
#include "prt/transport.h"

namespace haarlight {

/// Rows are weighted: a pixel by 1, a vertex by the root of the area of surface around it over the
/// mean of all vertices. Below, a weighted entry is weight * colour * T, a value a channel.
///
/// The sketch of a column is S T_j, S a matrix of +-1 and 0: row i of S adds up, with random signs,
/// the i-th rows of all blocks of 16. Signs depend on row and channel alone. For any lighting x
///   E || S T x ||^2 = || T x ||^2,   relative standard deviation of the norm about
///   1 / sqrt(2 * 16 * channels that matter)                           (Achlioptas 2003, blockwise)
struct ErrorTables {
  static constexpr std::size_t kLanes = kBlockRows;
  static constexpr std::size_t kSketch = 3 * kLanes;  ///< [channel][lane]

  /// Reads all of T once, O(stored bytes). The same bits on any number of threads. Requires one
  /// term an output.
  explicit ErrorTables(const Transport& transport);

  std::size_t sketch_groups = 1;  ///< groups of chunks with a sketch of their own: 1 of a picture
  std::size_t norm_groups = 1;    ///< groups of chunks with norms and sums of their own
  /// Per coefficient: [sketch group][channel][lane].
  HugePageVector<float> sketch;
  /// Per coefficient: [norm group][channel]: L2 norm of the weighted entries, never too small.
  HugePageVector<float> norm;
  /// Likewise: sum of the weighted entries.
  HugePageVector<float> sum;
  std::vector<float> row_weight;     ///< of each row as stored, 0 for padding
  std::vector<double> group_weight;  ///< per norm group: sum of squared weights
  std::vector<std::size_t> group_rows;  ///< per norm group: rows with a meaning

  std::size_t sketch_group(int chunk) const { return group(chunk, sketch_groups); }
  std::size_t norm_group(int chunk) const { return group(chunk, norm_groups); }
  std::uint64_t bytes() const { return 4 * (sketch.size() + norm.size() + sum.size()); }

 private:
  std::size_t group(int chunk, std::size_t groups) const {
    return static_cast<std::size_t>(chunk) * groups / chunks_;
  }
  std::size_t chunks_ = 1;
};

}  // namespace haarlight
