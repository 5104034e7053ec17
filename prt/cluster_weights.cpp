// Checking, packing and unpacking the weights of clustered PCA.

#include "prt/cluster_weights.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "prt/packing.h"

namespace haarlight {
namespace {

// clusters, vectors, vertices, bits, tints, weights (two words)
using Counts = std::array<std::uint32_t, 7>;
constexpr std::size_t kCountsBytes = sizeof(Counts);

// Starts of runs: from 0 to `end`, never falling.
bool are_starts(const std::vector<std::uint32_t>& first, std::size_t end) {
  return first.size() >= 2 && first.front() == 0 && first.back() == end &&
         std::is_sorted(first.begin(), first.end());
}

std::size_t weight_count(const ClusterWeights& w) {
  std::size_t count = 0;
  for (std::size_t c = 0; c + 1 < w.first_vertex.size(); ++c) {
    count += std::size_t{w.vertices_of(c)} * w.vectors_of(c);
  }
  return count;
}

}  // namespace

std::vector<std::size_t> ClusterWeights::weight_begin() const {
  std::vector<std::size_t> begin{0};
  for (std::size_t c = 0; c + 1 < first_vertex.size(); ++c) {
    begin.push_back(begin.back() + std::size_t{vertices_of(c)} * vectors_of(c));
  }
  return begin;
}

std::array<std::uint16_t, 3> ClusterWeights::tint_bits(const Rgb& t) {
  const auto bits = [](float x) {
    return static_cast<std::uint16_t>(std::lround(std::clamp(x / kTintUnit, 0.0f, 65535.0f)));
  };
  return {bits(t.r), bits(t.g), bits(t.b)};
}

Rgb ClusterWeights::tint_of(const std::array<std::uint16_t, 3>& bits) {
  return {kTintUnit * static_cast<float>(bits[0]), kTintUnit * static_cast<float>(bits[1]),
          kTintUnit * static_cast<float>(bits[2])};
}

std::string check_cluster_weights(const ClusterWeights& w, std::size_t vertices, int terms) {
  const std::size_t clusters = w.first_vertex.size() - 1;
  if (w.first_vertex.size() < 2 || clusters > kMostClusters ||
      w.first_vector.size() != clusters + 1 || w.vertex.size() != vertices ||
      !are_starts(w.first_vertex, vertices) || !are_starts(w.first_vector, w.scale.size())) {
    return fmt::format(
        "{} vertices, {} starts of clusters and {} of vectors do not fit {} vertices and {} scales",
        w.vertex.size(), w.first_vertex.size(), w.first_vector.size(), vertices, w.scale.size());
  }
  for (std::size_t c = 0; c < clusters; ++c) {
    if (w.vectors_of(c) > kMostVectors) {
      return fmt::format("cluster {} has {} vectors, expected at most {}", c, w.vectors_of(c),
                         kMostVectors);
    }
  }
  std::vector<std::uint8_t> seen(vertices, 0);
  for (const std::uint32_t v : w.vertex) {
    if (v >= vertices || seen[v]) {
      return fmt::format("vertex {} is in two clusters or not there, expected each of {} once", v,
                         vertices);
    }
    seen[v] = 1;
  }
  if (w.bits != 8 && w.bits != 16) {
    return fmt::format("weights have {} bits, expected 8 or 16", w.bits);
  }
  if (w.weight.size() != weight_count(w)) {
    return fmt::format("{} weights, expected {}", w.weight.size(), weight_count(w));
  }
  for (const float s : w.scale) {
    if (!std::isfinite(s) || s < 0) return "a scale of a cluster's weights is not a number >= 0";
  }
  const int most = w.bits == 8 ? 127 : 32767;
  for (const std::int16_t x : w.weight) {
    if (x > most || x < -most) return fmt::format("a weight does not fit {} bits", w.bits);
  }
  if (!w.tint.empty() && w.tint.size() != vertices * static_cast<std::size_t>(terms)) {
    return fmt::format("{} tints, expected none or {} for each of {} vertices", w.tint.size(),
                       terms, vertices);
  }
  return {};
}

std::vector<std::byte> pack_cluster_weights(const ClusterWeights& w) {
  const std::size_t weight_bytes = static_cast<std::size_t>(w.bits) / 8;
  std::vector<std::byte> plain(
      4 * (w.vertex.size() + w.first_vertex.size() + w.first_vector.size() + w.scale.size()) +
      weight_bytes * w.weight.size() + 6 * w.tint.size());
  std::byte* at = put(put(plain.data(), w.vertex), w.first_vertex);
  at = put(put(at, w.first_vector), w.scale);
  if (w.bits == 8) {
    at = put(at, std::vector<std::int8_t>(w.weight.begin(), w.weight.end()));
  } else {
    // Low bytes are noise and high ones are alike: apart they pack better.
    std::vector<std::uint8_t> low, high;
    for (const std::int16_t x : w.weight) {
      low.push_back(static_cast<std::uint8_t>(x & 0xff));
      high.push_back(static_cast<std::uint8_t>((x >> 8) & 0xff));
    }
    at = put(put(at, high), low);
  }
  put(at, w.tint);
  std::vector<std::byte> packed = compress_bytes(plain, kCountsBytes);
  const Counts counts{static_cast<std::uint32_t>(w.clusters()),
                      w.vectors(),
                      static_cast<std::uint32_t>(w.vertex.size()),
                      static_cast<std::uint32_t>(w.bits),
                      static_cast<std::uint32_t>(w.tint.size()),
                      static_cast<std::uint32_t>(w.weight.size() & 0xffffffffu),
                      static_cast<std::uint32_t>(w.weight.size() >> 32)};
  std::memcpy(packed.data(), counts.data(), kCountsBytes);
  return packed;
}

ClusterWeights unpack_cluster_weights(std::span<const std::byte> packed, std::size_t vertices,
                                      int terms, const std::string& name) {
  const auto damaged = [&name](const std::string& what) {
    return Error(ErrorKind::format, fmt::format("{}: {}", name, what));
  };
  if (packed.size() < kCountsBytes) throw damaged("clusters are cut short");
  Counts counts;
  std::memcpy(counts.data(), packed.data(), kCountsBytes);
  const std::size_t clusters = counts[0], vectors = counts[1], tints = counts[4];
  const std::size_t weights = counts[5] | std::size_t{counts[6]} << 32;
  if (clusters < 1 || clusters > kMostClusters || vectors > clusters * kMostVectors ||
      counts[2] != vertices || (counts[3] != 8 && counts[3] != 16) ||
      weights > vertices * kMostVectors || tints > vertices * static_cast<std::size_t>(terms)) {
    throw damaged(
        fmt::format("{} clusters of {} vectors, {} weights and {} tints for {} vertices do not fit "
                    "a mesh of {}",
                    clusters, vectors, weights, tints, counts[2], vertices));
  }
  const std::size_t weight_bytes = weights * (counts[3] / 8);
  const std::size_t starts = 4 * (vertices + 2 * (clusters + 1) + vectors);
  const std::vector<std::byte> plain = decompress_bytes(
      packed.subspan(kCountsBytes), starts + weight_bytes + 6 * tints,
      4 * (2 * (clusters + 1) + vectors) + weight_bytes + 6 * tints, name, "clusters");
  ClusterWeights w;
  w.bits = static_cast<int>(counts[3]);
  const std::byte* at = take(plain.data(), w.vertex, vertices);
  at = take(take(at, w.first_vertex, clusters + 1), w.first_vector, clusters + 1);
  at = take(at, w.scale, vectors);
  w.weight.resize(weights);
  if (w.bits == 8) {
    std::vector<std::int8_t> narrow;
    at = take(at, narrow, weights);
    std::copy(narrow.begin(), narrow.end(), w.weight.begin());
  } else {
    std::vector<std::uint8_t> low, high;
    at = take(take(at, high, weights), low, weights);
    for (std::size_t i = 0; i < weights; ++i) {
      w.weight[i] = static_cast<std::int16_t>(static_cast<std::uint16_t>(low[i] | high[i] << 8));
    }
  }
  take(at, w.tint, tints);
  const std::string wrong = check_cluster_weights(w, vertices, terms);
  if (!wrong.empty()) throw damaged(wrong);
  return w;
}

}  // namespace haarlight
