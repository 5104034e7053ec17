// Checking, packing and unpacking the weights of clustered PCA.

#include "prt/cluster_weights.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "core/error.h"
#include "prt/packing.h"

namespace haarlight {
namespace {

using Counts = std::array<std::uint32_t, 4>;  // clusters, basis, vertices, 0
constexpr std::size_t kCountsBytes = sizeof(Counts);

}  // namespace

std::string check_cluster_weights(const ClusterWeights& w, std::size_t vertices) {
  if (w.clusters < 1 || w.clusters > kMostClusters || w.basis < 1 || w.basis > kMostBasis) {
    return fmt::format("{} clusters of {} vectors, expected 1 to {} of 1 to {}", w.clusters,
                       w.basis, kMostClusters, kMostBasis);
  }
  if (w.cluster.size() != vertices ||
      w.weight.size() != vertices * static_cast<std::size_t>(w.basis)) {
    return fmt::format("clusters of {} vertices and {} weights, expected {} vertices of {} each",
                       w.cluster.size(), w.weight.size(), vertices, w.basis);
  }
  for (std::size_t v = 0; v < vertices; ++v) {
    if (w.cluster[v] >= static_cast<std::uint32_t>(w.clusters)) {
      return fmt::format("vertex {} is of cluster {}, expected one below {}", v, w.cluster[v],
                         w.clusters);
    }
  }
  for (const float weight : w.weight) {
    if (!std::isfinite(weight)) return "a weight of a cluster is not finite";
  }
  return {};
}

std::vector<std::byte> pack_cluster_weights(const ClusterWeights& w) {
  std::vector<std::byte> plain((w.cluster.size() + w.weight.size()) * 4);
  put(put(plain.data(), w.cluster), w.weight);
  std::vector<std::byte> packed = compress_bytes(plain, kCountsBytes);
  const Counts counts{static_cast<std::uint32_t>(w.clusters), static_cast<std::uint32_t>(w.basis),
                      static_cast<std::uint32_t>(w.cluster.size()), 0};
  std::memcpy(packed.data(), counts.data(), kCountsBytes);
  return packed;
}

ClusterWeights unpack_cluster_weights(std::span<const std::byte> packed, std::size_t vertices,
                                      const std::string& name) {
  const auto damaged = [&name](const std::string& what) {
    return Error(ErrorKind::format, fmt::format("{}: {}", name, what));
  };
  if (packed.size() < kCountsBytes) throw damaged("clusters are cut short");
  Counts counts;
  std::memcpy(counts.data(), packed.data(), kCountsBytes);
  const auto [clusters, basis, of_vertices, zero] = counts;
  if (clusters < 1 || clusters > static_cast<std::uint32_t>(kMostClusters) || basis < 1 ||
      basis > static_cast<std::uint32_t>(kMostBasis) || of_vertices != vertices || zero != 0) {
    throw damaged(fmt::format("{} clusters of {} vectors for {} vertices do not fit a mesh of {}",
                              clusters, basis, of_vertices, vertices));
  }
  const std::size_t weights = vertices * basis;
  const std::vector<std::byte> plain = decompress_bytes(
      packed.subspan(kCountsBytes), (vertices + weights) * 4, weights * 4, name, "clusters");
  ClusterWeights w;
  w.clusters = static_cast<int>(clusters);
  w.basis = static_cast<int>(basis);
  take(take(plain.data(), w.cluster, vertices), w.weight, weights);
  const std::string wrong = check_cluster_weights(w, vertices);
  if (!wrong.empty()) throw damaged(wrong);
  return w;
}

}  // namespace haarlight
