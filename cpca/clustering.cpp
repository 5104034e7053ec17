// Clustered PCA: assignment and PCA in turns.

#include "cpca/clustering.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/error.h"
#include "core/hash_bits.h"
#include "core/parallel.h"
#include "core/simd.h"
#include "cpca/principal.h"

namespace haarlight {
namespace {

constexpr int kSlice = 256;         // points a thread takes at a time
constexpr int kMeansRounds = 4;     // of k-means, before PCA
constexpr int kCandidates = 12;     // flats that a point is measured against
constexpr double kNothing = 1e-11;  // squared, relative: what rounding to float leaves of a point
constexpr std::uint32_t kNone = 0xffffffffu;

// Differences first: lengths of differences that are small against their terms stay right.
HAARLIGHT_MULTIVERSION float squared_distance(const float* a, const float* b, std::size_t dims) {
  float lane[16] = {};
  for (std::size_t d = 0; d < dims; d += 16) {
    for (std::size_t l = 0; l < 16; ++l) {
      const float difference = a[d + l] - b[d + l];
      lane[l] += difference * difference;
    }
  }
  float sum = 0;
  for (const float l : lane) sum += l;
  return sum;
}

HAARLIGHT_MULTIVERSION float dot(const float* a, const float* b, std::size_t dims) {
  float lane[16] = {};
  for (std::size_t d = 0; d < dims; d += 16) {
    for (std::size_t l = 0; l < 16; ++l) lane[l] += a[d + l] * b[d + l];
  }
  float sum = 0;
  for (const float l : lane) sum += l;
  return sum;
}

HAARLIGHT_MULTIVERSION void take_off(float* from, const float* along, float by, std::size_t dims) {
  for (std::size_t d = 0; d < dims; ++d) from[d] -= by * along[d];
}

double squared_length(const float* a, std::size_t dims) {
  double sum = 0;
  for (std::size_t d = 0; d < dims; ++d) sum += static_cast<double>(a[d]) * a[d];
  return sum;
}

// What is left of a point beside a flat: each axis is taken off what the ones before left.
double residual(const float* point, const std::vector<float>& axes, std::size_t dims,
                std::vector<float>& left) {
  left.assign(point, point + dims);
  for (std::size_t at = 0; at < axes.size(); at += dims) {
    const float* axis = axes.data() + at;
    take_off(left.data(), axis, dot(left.data(), axis, dims), dims);
  }
  return squared_length(left.data(), dims);
}

class Clusterer {
 public:
  Clusterer(const Sketch& points, const ClusteringOptions& options, const Progress& progress)
      : points_(points),
        options_(options),
        progress_(progress),
        dims_(static_cast<std::size_t>(points.dims)) {}

  Clustering run();

 private:
  const float* point(std::size_t lit) const { return points_.point(lit_[lit]); }
  void for_points(const std::function<void(std::size_t)>& body) const;
  void seed(std::size_t count);
  void means();
  void assign_to_means();
  void gather();
  void fit(std::size_t cluster);
  void fit_all();
  std::size_t assign_to_flats();
  bool split(std::size_t from, std::size_t to);
  void split_worst(std::size_t most);
  double inertia() const { return std::accumulate(left_.begin(), left_.end(), 0.0); }
  void report(double share) const;

  const Sketch& points_;
  const ClusteringOptions& options_;
  const Progress& progress_;
  std::size_t dims_;
  std::size_t wanted_ = 0;                // clusters
  std::vector<std::uint32_t> lit_;        // points that are not the origin
  std::vector<std::uint32_t> of_;         // cluster of each of them
  std::vector<double> left_;              // squared distance from its flat
  std::vector<float> mean_;               // [cluster][dimension]
  std::vector<std::vector<float>> flat_;  // [cluster]: orthonormal axes, [axis][dimension]
  std::vector<std::vector<std::uint32_t>> members_;
};

void Clusterer::report(double share) const {
  if (progress_ && !progress_(share)) {
    throw Error(ErrorKind::cancelled, "compression stopped on request");
  }
}

void Clusterer::for_points(const std::function<void(std::size_t)>& body) const {
  const int slices = static_cast<int>((lit_.size() + kSlice - 1) / kSlice);
  parallel_for(slices, [&](int slice) {
    const std::size_t begin = static_cast<std::size_t>(slice) * kSlice;
    const std::size_t end = std::min(begin + kSlice, lit_.size());
    for (std::size_t i = begin; i < end; ++i) body(i);
  });
}

// k-means++: the next centre is a point, drawn by its squared distance from those there are.
void Clusterer::seed(std::size_t count) {
  std::vector<float> nearest(lit_.size(), std::numeric_limits<float>::max());
  of_.assign(lit_.size(), 0);
  mean_.clear();
  std::size_t chosen = mix_bits(options_.seed, 0) % lit_.size();
  for (std::uint32_t c = 0;; ++c) {
    mean_.insert(mean_.end(), point(chosen), point(chosen) + dims_);
    const float* center = mean_.data() + c * dims_;
    for_points([&](std::size_t i) {
      const float d = squared_distance(point(i), center, dims_);
      if (d < nearest[i]) {
        nearest[i] = d;
        of_[i] = c;
      }
    });
    if (c + 1 == count) break;
    double sum = 0;
    for (const float d : nearest) sum += static_cast<double>(d);
    if (sum == 0) break;  // every point is a centre
    const double drawn = static_cast<double>(mix_bits(options_.seed, c + 1) >> 11) * 0x1p-53 * sum;
    double passed = 0;
    std::size_t last = 0;
    for (chosen = 0; chosen < nearest.size(); ++chosen) {
      if (nearest[chosen] == 0) continue;
      last = chosen;
      passed += static_cast<double>(nearest[chosen]);
      if (passed > drawn) break;
    }
    chosen = last;
  }
  flat_.resize(mean_.size() / dims_);
}

void Clusterer::gather() {
  members_.assign(flat_.size(), {});
  for (std::size_t i = 0; i < of_.size(); ++i) {
    members_[of_[i]].push_back(static_cast<std::uint32_t>(i));
  }
}

void Clusterer::means() {
  mean_.assign(flat_.size() * dims_, 0.0f);
  parallel_for(static_cast<int>(flat_.size()), [&](int cluster) {
    const auto c = static_cast<std::size_t>(cluster);
    if (members_[c].empty()) return;
    std::vector<double> sum(dims_, 0.0);
    for (const std::uint32_t i : members_[c]) {
      for (std::size_t d = 0; d < dims_; ++d) sum[d] += static_cast<double>(point(i)[d]);
    }
    for (std::size_t d = 0; d < dims_; ++d) {
      mean_[c * dims_ + d] = static_cast<float>(sum[d] / static_cast<double>(members_[c].size()));
    }
  });
}

void Clusterer::assign_to_means() {
  for_points([&](std::size_t i) {
    float best = squared_distance(point(i), mean_.data() + of_[i] * dims_, dims_);
    for (std::uint32_t c = 0; c < flat_.size(); ++c) {
      if (members_[c].empty()) continue;
      const float d = squared_distance(point(i), mean_.data() + c * dims_, dims_);
      if (d < best) {
        best = d;
        of_[i] = c;
      }
    }
  });
}

// The flat that leaves the members least, and what it leaves them.
void Clusterer::fit(std::size_t c) {
  const auto n = static_cast<Eigen::Index>(members_[c].size());
  const auto d = static_cast<Eigen::Index>(dims_);
  Eigen::MatrixXd x(n, d);
  for (Eigen::Index i = 0; i < n; ++i) {
    const float* p = point(members_[c][static_cast<std::size_t>(i)]);
    for (Eigen::Index j = 0; j < d; ++j) x(i, j) = static_cast<double>(p[j]);
  }
  const Eigen::Index most = options_.basis;
  Eigen::MatrixXd axes;
  if (n <= d) {
    const Principal principal = principal_of_gram(x * x.transpose(), most);
    axes = x.transpose() * principal.left;
    for (Eigen::Index i = 0; i < axes.cols(); ++i) axes.col(i).normalize();
  } else {
    axes = principal_of_gram(x.transpose() * x, most).left;
  }
  flat_[c].resize(static_cast<std::size_t>(axes.cols()) * dims_);
  for (Eigen::Index i = 0; i < axes.cols(); ++i) {
    for (Eigen::Index j = 0; j < d; ++j) {
      flat_[c][static_cast<std::size_t>(i) * dims_ + static_cast<std::size_t>(j)] =
          static_cast<float>(axes(j, i));
    }
  }
  std::vector<float> scratch;
  for (const std::uint32_t i : members_[c]) {
    left_[i] = residual(point(i), flat_[c], dims_, scratch);
  }
}

void Clusterer::fit_all() {
  parallel_for(static_cast<int>(flat_.size()), [&](int c) {
    const auto cluster = static_cast<std::size_t>(c);
    if (!members_[cluster].empty()) fit(cluster);
  });
}

// Each point goes to the flat that leaves it least, of those with the nearest means, unless its own
// does. Returns how many went.
std::size_t Clusterer::assign_to_flats() {
  std::vector<std::uint8_t> went(lit_.size(), 0);
  for_points([&](std::size_t i) {
    thread_local std::vector<float> scratch;
    std::pair<float, std::uint32_t> near[kCandidates];
    int count = 0;
    for (std::uint32_t c = 0; c < flat_.size(); ++c) {
      if (members_[c].empty() || c == of_[i]) continue;
      const std::pair<float, std::uint32_t> here{
          squared_distance(point(i), mean_.data() + c * dims_, dims_), c};
      int at = count < kCandidates ? count++ : kCandidates;
      if (at == kCandidates) {
        if (!(here < near[kCandidates - 1])) continue;
        at = kCandidates - 1;
      }
      for (; at > 0 && here < near[at - 1]; --at) near[at] = near[at - 1];
      near[at] = here;
    }
    const double nothing = kNothing * squared_length(point(i), dims_);
    for (int n = 0; n < count; ++n) {
      const double d = residual(point(i), flat_[near[n].second], dims_, scratch);
      if (d + nothing < left_[i]) {
        left_[i] = d;
        of_[i] = near[n].second;
        went[i] = 1;
      }
    }
  });
  return static_cast<std::size_t>(std::count(went.begin(), went.end(), 1));
}

// Halves a cluster where what its flat leaves differs most. False if nothing is left.
bool Clusterer::split(std::size_t from, std::size_t to) {
  const std::vector<std::uint32_t> all = members_[from];
  const std::size_t n = all.size();
  if (n < 2) return false;
  std::vector<float> rest(n * dims_), scratch;
  double total = 0, size = 0;
  for (std::size_t i = 0; i < n; ++i) {
    total += residual(point(all[i]), flat_[from], dims_, scratch);
    size += squared_length(point(all[i]), dims_);
    std::copy(scratch.begin(), scratch.end(),
              rest.begin() + static_cast<std::ptrdiff_t>(i * dims_));
  }
  if (total <= kNothing * size) return false;
  // Along the direction in which the rests are largest, by a few rounds of the power method from
  // the largest one.
  std::size_t largest = 0;
  for (std::size_t i = 1; i < n; ++i) {
    if (left_[all[i]] > left_[all[largest]]) largest = i;
  }
  std::vector<float> axis(rest.begin() + static_cast<std::ptrdiff_t>(largest * dims_),
                          rest.begin() + static_cast<std::ptrdiff_t>((largest + 1) * dims_));
  for (int round = 0; round < 8; ++round) {
    std::vector<float> next(dims_, 0.0f);
    for (std::size_t i = 0; i < n; ++i) {
      take_off(next.data(), rest.data() + i * dims_,
               -dot(rest.data() + i * dims_, axis.data(), dims_), dims_);
    }
    const double length = std::sqrt(squared_length(next.data(), dims_));
    if (!(length > 0)) break;
    for (float& a : next) a = static_cast<float>(a / length);
    axis.swap(next);
  }
  std::vector<std::pair<float, std::uint32_t>> order(n);
  for (std::size_t i = 0; i < n; ++i) {
    order[i] = {dot(rest.data() + i * dims_, axis.data(), dims_), all[i]};
  }
  std::sort(order.begin(), order.end());
  members_[from].clear();
  members_[to].clear();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t side = i < n / 2 ? from : to;
    members_[side].push_back(order[i].second);
    of_[order[i].second] = static_cast<std::uint32_t>(side);
  }
  for (const std::size_t side : {from, to}) {
    std::sort(members_[side].begin(), members_[side].end());
    fit(side);
  }
  return true;
}

// Splits up to `most` clusters, those with most error first, into empty and new ones.
void Clusterer::split_worst(std::size_t most) {
  std::vector<std::size_t> empty;
  for (std::size_t c = flat_.size(); c-- > 0;) {
    if (members_[c].empty()) empty.push_back(c);
  }
  std::vector<std::pair<double, std::size_t>> worst;
  for (std::size_t c = 0; c < flat_.size(); ++c) {
    double sum = 0;
    for (const std::uint32_t i : members_[c]) sum += left_[i];
    worst.push_back({-sum, c});
  }
  std::sort(worst.begin(), worst.end());
  // Refused ones, with nothing left to split, use up their turn: no endless relocation.
  const std::size_t turns = std::min(most + empty.size(), worst.size());
  for (std::size_t i = 0; i < turns; ++i) {
    std::size_t to = flat_.size();
    const bool fills = !empty.empty();
    if (fills) {
      to = empty.back();
    } else if (flat_.size() >= wanted_) {
      return;
    } else {
      flat_.emplace_back();
      members_.emplace_back();
    }
    if (split(worst[i].second, to)) {
      if (fills) empty.pop_back();
    } else if (!fills) {
      flat_.pop_back();
      members_.pop_back();
    }
  }
}

Clustering Clusterer::run() {
  Clustering out;
  for (std::size_t i = 0; i < points_.count(); ++i) {
    const float* p = points_.point(i);
    if (std::any_of(p, p + dims_, [](float x) { return x != 0; })) {
      lit_.push_back(static_cast<std::uint32_t>(i));
    }
  }
  out.cluster.assign(points_.count(), 0);
  if (lit_.empty()) {
    out.clusters = points_.count() > 0 ? 1 : 0;
    return out;
  }
  // Dark points have one of the clusters, or where there is but one their place in it.
  const bool dark = lit_.size() < points_.count() && options_.clusters > 1;
  const auto asked = static_cast<std::size_t>(options_.clusters) - (dark ? 1 : 0);
  wanted_ = std::min(asked, lit_.size());
  left_.assign(lit_.size(), 0.0);

  // Where flats begin: k-means.
  // Splits, which make the last quarter, come with iterations.
  seed(options_.iterations > 0 ? std::max<std::size_t>(1, wanted_ - wanted_ / 4) : wanted_);
  report(0.15);
  for (int round = 0; round < kMeansRounds; ++round) {
    gather();
    means();
    assign_to_means();
    report(0.15 + 0.15 * (round + 1) / kMeansRounds);
  }
  gather();
  means();
  fit_all();
  out.inertia.push_back(inertia());

  // PCA and assignment in turns; in the first half of the rounds the worst are split.
  for (int round = 0; round < options_.iterations; ++round) {
    const int splitting = std::max(1, options_.iterations / 2 - round);
    split_worst(
        (wanted_ - std::min(wanted_, flat_.size()) + static_cast<std::size_t>(splitting) - 1) /
        static_cast<std::size_t>(splitting));
    means();
    const std::size_t went = assign_to_flats();
    out.inertia.push_back(inertia());
    gather();
    fit_all();
    out.inertia.push_back(inertia());
    report(0.3 + 0.7 * (round + 1) / options_.iterations);
    if (went == 0 && flat_.size() >= wanted_) break;
  }

  // Numbered by their first point, the empty ones left out.
  std::vector<std::uint32_t> name(flat_.size(), kNone);
  for (std::size_t i = 0; i < lit_.size(); ++i) {
    std::uint32_t& n = name[of_[i]];
    if (n == kNone) n = static_cast<std::uint32_t>(out.clusters++);
    out.cluster[lit_[i]] = n;
  }
  if (dark) {
    const auto last = static_cast<std::uint32_t>(out.clusters++);
    std::vector<std::uint8_t> is_lit(points_.count(), 0);
    for (const std::uint32_t i : lit_) is_lit[i] = 1;
    for (std::size_t i = 0; i < is_lit.size(); ++i) {
      if (!is_lit[i]) out.cluster[i] = last;
    }
  }
  return out;
}

}  // namespace

Clustering cluster_points(const Sketch& points, const ClusteringOptions& options,
                          const Progress& progress) {
  return Clusterer(points, options, progress).run();
}

}  // namespace haarlight
