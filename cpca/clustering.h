// Points are shared out to clusters, each a flat through the origin: clustered PCA.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/progress.h"
#include "cpca/sketch.h"

namespace haarlight {

struct ClusteringOptions {
  int clusters = 400;  ///< >= 1, the most that come out; fewer if there are fewer different points,
                       ///< or if nothing is left to split off: all errors are 0
  int basis = 8;       ///< dimensions of a cluster's flat while points are shared out
  int iterations = 12;     ///< most rounds of assignment and PCA
  std::uint64_t seed = 1;  ///< of the first centres
};

struct Clustering {
  int clusters = 0;                    ///< none of them empty
  std::vector<std::uint32_t> cluster;  ///< one a point
  /// Summed squared distance of points from their cluster's flat, after every assignment and every
  /// PCA: it never rises, but for rounding.
  std::vector<double> inertia;
};

/// Alternates assignment (to the flat that is nearest, of those whose means are near) and PCA
/// (Sloan and others 2003, "iterative clustered PCA"). Begins with k-means (k-means++, Arthur and
/// Vassilvitskii 2007) of three quarters of the clusters; the others come from splitting those that
/// leave most error, which empty ones are filled by as well. Ends when nothing moves. Points at the
/// origin have a cluster of their own, the last one, where there may be two. Ties go to the smaller
/// number; the same bits on any number of threads. Throws Error{cancelled}.
Clustering cluster_points(const Sketch& points, const ClusteringOptions& options,
                          const Progress& progress);

}  // namespace haarlight
