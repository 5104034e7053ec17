// How many vectors clusters get and which of their entries are kept, found from a few clusters.
// Private to cpca/.

#pragma once

#include <cstddef>
#include <vector>

#include "cpca/cluster_basis.h"

namespace haarlight {

/// What is measured of one cluster, under each of the lightings.
class VectorTuning {
 public:
  explicit VectorTuning(const std::vector<std::vector<float>>& lightings);

  /// What is kept of one cluster.
  struct Cluster {
    std::size_t count = 0;      ///< vectors
    std::vector<double> sigma;  ///< estimated
    /// Squared error left by the first s vectors, [s][lighting]; [0] is what is to be shown.
    std::vector<std::vector<double>> left;
    /// Squared error of leaving out entries below threshold level t, [s][t][lighting].
    std::vector<std::vector<std::vector<double>>> dropped;
    /// Entries of the first s vectors that fall out at level t, [s][t].
    std::vector<std::vector<double>> entries;
  };
  /// Measures a cluster of `vertices` vertices by its basis, as wide as any choice, and its
  /// estimated singular values. May be called from several threads at once.
  Cluster measured(const ClusterBasis& basis, std::size_t vertices,
                   std::vector<double> sigma) const;

  /// Forgets all clusters.
  void clear();
  void add(Cluster cluster);

  /// Largest relative picture error over the lightings if each cluster has the vectors whose
  /// singular value is at least `cut`, at most `most`.
  double basis_error(double cut, std::size_t most) const;
  /// The largest cut (of a fixed series) whose basis_error is at most `error`; 0 if none is.
  double cut_for(double error, std::size_t most) const;

  /// The largest of a series of thresholds on the root mean square of an entry over blocks of
  /// vectors, such that what falls below it changes the picture by at most `error`, of those
  /// vectors that `cut` and `most` choose; 0 if none.
  float threshold_for(double error, double cut, std::size_t most) const;

  /// Entries of those vectors that such a threshold keeps, and how many vectors they are.
  struct Kept {
    double entries = 0, vectors = 0;
  };
  Kept kept(double cut, std::size_t most, float threshold) const;

 private:
  std::size_t chosen(const Cluster& cluster, double cut, std::size_t most) const;
  double worst(const std::vector<double>& error) const;

  const std::vector<std::vector<float>>* lightings_;
  std::vector<Cluster> clusters_;
  std::vector<double> energy_;  // of the picture, [lighting]
};

/// Vectors whose singular value, of a falling list, is at least `cut`, at most `most`.
std::size_t vectors_above(const std::vector<double>& sigma, double cut, std::size_t most);

}  // namespace haarlight
