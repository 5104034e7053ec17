// Vectors of clusters, one after the other, become tiles of a transport. Private to cpca/.

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "cpca/cluster_basis.h"
#include "prt/transport_writer.h"

namespace haarlight {

/// Rows are collected until tiles are full. Each row is stored over its own root mean square, which
/// becomes its colour, so that the 255 levels that 16 rows share suit the weak ones as well; blocks
/// whose root mean square entry is below `threshold` are dropped.
class VectorWriter {
 public:
  VectorWriter(TransportWriter& writer, const HaarLayout& layout, int terms, float threshold,
               std::span<const std::vector<float>> lightings);

  /// Adds a cluster's rows, [term][vector], `vectors` of them; those that the basis lacks are 0.
  void add(const ClusterBasis& basis, std::size_t vectors);
  /// Writes full tiles, or all that is left; compresses them in parallel.
  void flush(bool all);
  /// What the rows show as they are stored, once written: [row][lighting][channel], row numbers as
  /// of the transport.
  std::span<const double> shown() const { return shown_; }

 private:
  struct Row {
    std::vector<float> values;  // [channel][coefficient]
    int channels = 1;
  };
  void write(int tile, std::span<const Row> rows);

  TransportWriter& writer_;
  const HaarLayout& layout_;
  std::size_t terms_;
  float threshold_;
  std::span<const std::vector<float>> lightings_;
  std::vector<Row> rows_;
  int next_tile_ = 0;
  std::vector<double> shown_;
};

}  // namespace haarlight
