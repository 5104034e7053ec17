// Step 2 of relighting by clustered PCA: vertices follow their clusters' vectors.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/huge_page_vector.h"
#include "core/rgb.h"
#include "prt/cluster_weights.h"
#include "prt/row_sums.h"

namespace haarlight {

/// What a frame of step 2 did.
struct CombineStats {
  std::uint64_t weight_bytes = 0;  ///< of weights read
  std::uint64_t sum_bytes = 0;     ///< of vertices' sums read and written
  int changes = 0;                 ///< vectors' changes taken, over all clusters and terms
};

/// U = W P of each cluster and term (Overbeck 2006, Eq. 10), by the basic incremental algorithm
/// (section 3): P is what step 1 says, Q what vertices stand for, and a frame takes the `most`
/// largest entries of P - Q of a cluster and term. Entries that are right are never taken, so that
/// a resting light is followed exactly after at most S / most frames, and nothing is done then.
///
/// An entry's change is a double, and Q the sum of those handed out: where one was rounded, the
/// next frame hands out what is missing. Sums are doubles too, with the bound of RowSums, and
/// exactly +0 while all of Q is zero. Vertices of a cluster are together, each cluster has one
/// owner, so the result is the same bits on any number of threads.
class ClusterSums {
 public:
  /// `info` is of kind clusters; throws Error{invalid_argument} for another.
  explicit ClusterSums(const TransportInfo& info);

  /// Follows the sums of `vectors` in the clusters where they changed (flags of chunks) or were not
  /// reached, except those that `seen` (flags of clusters; empty: all) leaves out, which are
  /// brought up to date at once when they are seen again. most < 1: all entries. Writes what
  /// vertices show, [vertex][term], where that changed. No heap use once warm.
  CombineStats follow(const RowSums& vectors, std::span<const std::uint8_t> changed_chunks,
                      std::span<const std::uint8_t> seen, int most, std::span<Rgb> shown);

  /// Whether vertices of all seen clusters show W P exactly.
  bool settled() const { return settled_; }
  /// P - Q: what vertices have yet to follow of the sums of `vectors`, [row][channel], over the
  /// row's colour.
  void pending(const RowSums& vectors, std::vector<double>& rows) const;
  const ClusterWeights& weights() const { return *weights_; }

 private:
  struct Cluster {
    std::size_t vertices = 0;  // padded
    std::size_t weights = 0;   // where its weights begin in weight_
    std::size_t sums = 0;      // where [term][channel][vertex] begins in sum_
    bool pending = true;       // Q is not P, or may not be
    bool stale = false;        // was left out since
  };
  struct Scratch;
  CombineStats follow_cluster(const RowSums& vectors, std::size_t c, int most,
                              std::span<Rgb> shown);

  std::shared_ptr<const ClusterWeights> weights_;
  std::size_t terms_ = 1;
  std::vector<Cluster> clusters_;
  HugePageVector<std::int16_t> weight_;  // padded
  HugePageVector<double> sum_;
  std::vector<double> taken_;        // Q: [row][channel], over the row's colour
  std::vector<CombineStats> stats_;  // a cluster
  bool settled_ = true;
};

}  // namespace haarlight
