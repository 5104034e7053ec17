// How vertices are put together from the vectors of their cluster (clustered PCA).
//
//   U_k^v = tint_k^v sum over i of w_i^v P_ik      P: the vectors' sums     (Overbeck 2006, Eq. 8)

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/rgb.h"

namespace haarlight {

/// Vertices are listed cluster after cluster: a `place` is a position in that list. The transport's
/// rows are (cluster, term, vector): vector i of the S_c of cluster c and term k has output
///   first_vector[c] * terms + k * S_c + i.
/// A plain value.
struct ClusterWeights {
  std::vector<std::uint32_t> vertex;        ///< [place], each vertex once
  std::vector<std::uint32_t> first_vertex;  ///< [cluster + 1]: places
  std::vector<std::uint32_t> first_vector;  ///< [cluster + 1]; a cluster without any is black
  int bits = 16;                            ///< of a weight: 8 or 16
  std::vector<float> scale;                 ///< [vector]: what a weight of 1 stands for
  std::vector<std::int16_t> weight;         ///< [cluster][vector][vertex of the cluster]
  std::vector<std::array<std::uint16_t, 3>> tint;  ///< [place][term], in kTintUnit; empty: all 1

  static constexpr float kTintUnit = 0x1p-15f;  ///< tints are up to 2

  int clusters() const { return static_cast<int>(first_vertex.size()) - 1; }
  std::uint32_t vertices_of(std::size_t c) const { return first_vertex[c + 1] - first_vertex[c]; }
  std::uint32_t vectors_of(std::size_t c) const { return first_vector[c + 1] - first_vector[c]; }
  std::uint32_t vectors() const { return first_vector.back(); }
  /// Where the weights of each cluster begin: clusters() + 1 of them.
  std::vector<std::size_t> weight_begin() const;
  /// A tint as it is kept; components up to 2.
  static std::array<std::uint16_t, 3> tint_bits(const Rgb& tint);
  static Rgb tint_of(const std::array<std::uint16_t, 3>& bits);

  friend bool operator==(const ClusterWeights&, const ClusterWeights&) = default;
};

inline constexpr std::uint32_t kMostClusters = 1u << 20;
inline constexpr std::uint32_t kMostVectors = 256;  ///< of a cluster

/// What is wrong with weights for a mesh of so many vertices and terms, or nothing.
std::string check_cluster_weights(const ClusterWeights& weights, std::size_t vertices, int terms);

/// The bytes in a file: clusters, vectors, vertices, bits, tints (u32 each), then under zstd
/// vertices, first vertices, first vectors, scales, weights (an i8 or i16 each) and tints.
std::vector<std::byte> pack_cluster_weights(const ClusterWeights& weights);

/// Throws Error{format}, message beginning with `name`, unless the bytes unpack to weights for so
/// many vertices and terms that check_cluster_weights() finds nothing wrong with. What it asks for
/// is bounded by the size of `packed` and the number of vertices.
ClusterWeights unpack_cluster_weights(std::span<const std::byte> packed, std::size_t vertices,
                                      int terms, const std::string& name);

}  // namespace haarlight
