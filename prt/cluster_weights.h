// How vertices are put together from the vectors of their cluster (clustered PCA).
//
//   U_v = sum over s of w_s(v) P_s(cluster of v)       (Overbeck 2006, Eq. 8)

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace haarlight {

/// A plain value. The transport's rows are (cluster, vector, term): output
/// (cluster * basis + vector) * terms + term.
struct ClusterWeights {
  int clusters = 1;
  int basis = 1;  ///< vectors a cluster, S; the mean, if there is one, among them
  std::vector<std::uint32_t> cluster;  ///< one a vertex
  std::vector<float> weight;           ///< [vertex][vector]

  friend bool operator==(const ClusterWeights&, const ClusterWeights&) = default;
};

inline constexpr int kMostClusters = 1 << 20;
inline constexpr int kMostBasis = 256;

/// What is wrong with weights for a mesh of so many vertices, or nothing.
std::string check_cluster_weights(const ClusterWeights& weights, std::size_t vertices);

/// The bytes in a file: four counts, then clusters and weights under zstd.
std::vector<std::byte> pack_cluster_weights(const ClusterWeights& weights);

/// Throws Error{format}, message beginning with `name`, unless the bytes unpack to weights for so
/// many vertices that check_cluster_weights() finds nothing wrong with. What it asks for is bounded
/// by the size of `packed` and the number of vertices.
ClusterWeights unpack_cluster_weights(std::span<const std::byte> packed, std::size_t vertices,
                                      const std::string& name);

}  // namespace haarlight
