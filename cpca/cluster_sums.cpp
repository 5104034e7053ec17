// Step 2 of relighting by clustered PCA.

#include "cpca/cluster_sums.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "cpca/weight_kernel.h"
#include "prt/apply_kernel.h"

namespace haarlight {
namespace {

constexpr auto kBlock = static_cast<std::size_t>(kBlockRows);
constexpr int kClustersAtATime = 8;

// A vector's change, and what it is ranked by.
struct Change {
  float size;
  std::uint32_t vector;
};

}  // namespace

ClusterSums::ClusterSums(const TransportInfo& info)
    : weights_(info.clusters), terms_(static_cast<std::size_t>(info.terms)) {
  if (!weights_) {
    throw Error(ErrorKind::invalid_argument,
                "the transport is of pixels or vertices, expected one of clusters");
  }
  const ClusterWeights& w = *weights_;
  const auto count = static_cast<std::size_t>(w.clusters());
  const std::vector<std::size_t> begin = w.weight_begin();
  std::size_t weights = 0, sums = 0;
  for (std::size_t c = 0; c < count; ++c) {
    Cluster cluster;
    cluster.vertices = (w.vertices_of(c) + kWeightLanes - 1) / kWeightLanes * kWeightLanes;
    cluster.weights = weights;
    cluster.sums = sums;
    weights += cluster.vertices * w.vectors_of(c);
    sums += cluster.vertices * 3 * terms_;
    clusters_.push_back(cluster);
  }
  weight_.assign(weights, 0);
  sum_.assign(sums, 0.0);
  for (std::size_t c = 0; c < count; ++c) {
    for (std::size_t i = 0; i < w.vectors_of(c); ++i) {
      std::copy_n(w.weight.begin() + static_cast<std::ptrdiff_t>(begin[c] + i * w.vertices_of(c)),
                  w.vertices_of(c),
                  weight_.begin() + static_cast<std::ptrdiff_t>(clusters_[c].weights +
                                                                i * clusters_[c].vertices));
    }
  }
  taken_.assign(std::size_t{w.vectors()} * terms_ * 3, 0.0);
  stats_.resize(count);
}

CombineStats ClusterSums::follow_cluster(const RowSums& vectors, std::size_t c, int most,
                                         std::span<Rgb> shown) {
  const ClusterWeights& w = *weights_;
  Cluster& cluster = clusters_[c];
  CombineStats stats;
  const std::size_t count = w.vectors_of(c);
  const double* totals = vectors.totals().data();
  const std::span<const Rgb> size = vectors.transport().row_color();
  const bool all = most < 1 || cluster.stale || static_cast<std::size_t>(most) >= count;
  cluster.stale = false;
  cluster.pending = false;
  thread_local std::vector<Change> changes;
  thread_local std::vector<WeightTask> tasks;
  for (std::size_t k = 0; k < terms_; ++k) {
    const std::size_t first = w.first_vector[c] * terms_ + k * count;
    double* taken = taken_.data() + 3 * first;
    const auto target = [&](std::size_t i, std::size_t ch) {
      const std::size_t row = first + i;
      return totals[row / kBlock * kBlockTotals + ch * kBlock + row % kBlock];
    };

    // Decide: the largest entries of P - Q. Weights are of one size, and so need no part in it.
    changes.clear();
    for (std::size_t i = 0; i < count; ++i) {
      const double change = std::abs(target(i, 0) - taken[3 * i]) +
                            std::abs(target(i, 1) - taken[3 * i + 1]) +
                            std::abs(target(i, 2) - taken[3 * i + 2]);
      if (change == 0) continue;
      changes.push_back(
          {static_cast<float>(change) * size[first + i].r, static_cast<std::uint32_t>(i)});
    }
    if (changes.empty()) continue;
    if (!all && changes.size() > static_cast<std::size_t>(most)) {
      std::nth_element(changes.begin(), changes.begin() + most, changes.end(),
                       [](const Change& a, const Change& b) {
                         return a.size != b.size ? a.size > b.size : a.vector < b.vector;
                       });
      changes.resize(static_cast<std::size_t>(most));
      std::sort(changes.begin(), changes.end(),
                [](const Change& a, const Change& b) { return a.vector < b.vector; });
      cluster.pending = true;
    }

    // Apply.
    tasks.clear();
    for (const Change& change : changes) {
      const std::size_t i = change.vector;
      WeightTask task;
      task.weights = weight_.data() + cluster.weights + i * cluster.vertices;
      const double unit = static_cast<double>(w.scale[w.first_vector[c] + i]) *
                          static_cast<double>(size[first + i].r);
      for (std::size_t ch = 0; ch < 3; ++ch) {
        const double delta = target(i, ch) - taken[3 * i + ch];
        taken[3 * i + ch] += delta;
        cluster.pending |= taken[3 * i + ch] != target(i, ch);
        task.factor[ch] = unit * delta;
      }
      tasks.push_back(task);
    }
    double* sums = sum_.data() + cluster.sums + k * 3 * cluster.vertices;
    if (std::all_of(taken, taken + 3 * count, [](double q) { return q == 0; })) {
      std::fill(sums, sums + 3 * cluster.vertices, 0.0);
    } else {
      add_weights(tasks, cluster.vertices, sums);
    }
    stats.changes += static_cast<int>(tasks.size());
    stats.weight_bytes += tasks.size() * cluster.vertices * sizeof(std::int16_t);
    stats.sum_bytes += 2 * 3 * cluster.vertices * sizeof(double);

    // What vertices show.
    for (std::size_t v = 0; v < w.vertices_of(c); ++v) {
      const std::size_t place = w.first_vertex[c] + v;
      Rgb out{static_cast<float>(sums[v]), static_cast<float>(sums[cluster.vertices + v]),
              static_cast<float>(sums[2 * cluster.vertices + v])};
      if (!w.tint.empty()) out = out * ClusterWeights::tint_of(w.tint[place * terms_ + k]);
      shown[w.vertex[place] * terms_ + k] = out;
    }
  }
  return stats;
}

CombineStats ClusterSums::follow(const RowSums& vectors,
                                 std::span<const std::uint8_t> changed_chunks,
                                 std::span<const std::uint8_t> seen, int most,
                                 std::span<Rgb> shown) {
  const ClusterWeights& w = *weights_;
  parallel_for(
      w.clusters(),
      [&](int i) {
        const auto c = static_cast<std::size_t>(i);
        Cluster& cluster = clusters_[c];
        stats_[c] = {};
        const std::size_t begin = w.first_vector[c] * terms_ / kChunkRows;
        const std::size_t end = (w.first_vector[c + 1] * terms_ + kChunkRows - 1) / kChunkRows;
        for (std::size_t chunk = begin; chunk < end; ++chunk) {
          cluster.pending |= changed_chunks[chunk] != 0;
        }
        if (!cluster.pending) return;
        if (!seen.empty() && !seen[c]) {
          cluster.stale = true;
        } else {
          stats_[c] = follow_cluster(vectors, c, most, shown);
        }
      },
      kClustersAtATime);
  CombineStats sum;
  settled_ = true;
  for (std::size_t c = 0; c < clusters_.size(); ++c) {
    sum.weight_bytes += stats_[c].weight_bytes;
    sum.sum_bytes += stats_[c].sum_bytes;
    sum.changes += stats_[c].changes;
    if (seen.empty() || seen[c]) settled_ &= !clusters_[c].pending;
  }
  return sum;
}

void ClusterSums::pending(const RowSums& vectors, std::vector<double>& rows) const {
  const double* totals = vectors.totals().data();
  rows.resize(taken_.size());
  for (std::size_t k = 0; k < taken_.size(); ++k) {
    const std::size_t row = k / 3;
    rows[k] = totals[row / kBlock * kBlockTotals + k % 3 * kBlock + row % kBlock] - taken_[k];
  }
}

}  // namespace haarlight
