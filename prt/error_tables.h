// What is kept of a transport to judge pictures without making them: sketches, norms and sums of
// its columns.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/huge_page_vector.h"
#include "prt/transport.h"

namespace haarlight {

/// The area of surface around each vertex, a third of each triangle, over the mean of all; 1 where
/// nothing has an area.
std::vector<float> relative_vertex_areas(const TransportMesh& mesh);

/// Rows are weighted: a pixel by 1, a vertex by the root of the area of surface around it over the
/// mean of all vertices; for norms the mean is added, lest small triangles count for nothing.
/// Below, a weighted entry is weight * colour * T, a value a channel. Rows are in groups of blocks
/// that follow each other; those of a mesh are near each other and face the same way.
///
/// The sketch of a column is S T_j, S a matrix of +-1 and 0: row i of S adds up, with random signs,
/// the i-th rows (modulo lanes) of all blocks. Signs depend on row and channel alone. For any
/// lighting x
///   E || S T x ||^2 = || T x ||^2,   relative standard deviation of the norm about
///   1 / sqrt(2 * lanes * groups and channels that matter)             (Achlioptas 2003, blockwise)
struct ErrorTables {
  /// Reads all of T once, O(stored bytes). The same bits on any number of threads. Requires one
  /// term an output.
  explicit ErrorTables(const Transport& transport);

  std::size_t lanes = kBlockRows;  ///< of a sketch's channel: 16 of a picture, 4 of a mesh
  std::size_t sketch_groups = 1;   ///< sketches that groups share: 1 of a picture
  std::size_t groups = 1;          ///< groups with norms and sums of their own
  std::size_t sketch_size() const { return sketch_groups * 3 * lanes; }

  HugePageVector<float> sketch;  ///< per coefficient: [sketch group][channel][lane]
  HugePageVector<float> norm;    ///< [channel][group]: L2 norm of weighted entries, never too small
  HugePageVector<float> sum;     ///< likewise: sum of weighted entries; empty of a mesh

  std::vector<float> area;              ///< of each row as stored: its squared weight; 0: padding
  std::vector<std::size_t> group_rows;  ///< per group: rows with a meaning
  std::size_t group_of_row(std::size_t row) const { return group_of_block_[row / kBlockRows]; }
  std::size_t sketch_of_group(std::size_t group) const { return group * sketch_groups / groups; }
  std::uint64_t bytes() const { return 4 * (sketch.size() + norm.size() + sum.size()); }

 private:
  std::vector<std::uint8_t> group_of_block_;
};

}  // namespace haarlight
