// How many vectors clusters get and which of their entries are kept.

#include "cpca/vector_tuning.h"

#include <algorithm>
#include <cmath>

#include "prt/transport.h"

namespace haarlight {
namespace {

constexpr int kLevels = 40;       // thresholds tried, a factor sqrt(2) apart
constexpr float kLowest = 1e-7f;  // the lowest of them
constexpr int kCuts = 64;         // cuts tried, a factor 2^(1/4) apart
constexpr auto kBlock = static_cast<std::size_t>(kBlockRows);

float level_threshold(int level) { return kLowest * std::exp2(0.5f * static_cast<float>(level)); }

// The first level whose threshold is above a root mean square: entries are dropped from it on.
int level_of(float rms) {
  if (!(rms > 0)) return 0;
  const float level = 2 * std::log2(rms / kLowest);
  return std::clamp(static_cast<int>(std::floor(level)) + 1, 0, kLevels);
}

}  // namespace

VectorTuning::VectorTuning(const std::vector<std::vector<float>>& lightings)
    : lightings_(&lightings), energy_(lightings.size(), 0.0) {}

void VectorTuning::clear() {
  clusters_.clear();
  std::fill(energy_.begin(), energy_.end(), 0.0);
}

void VectorTuning::add(Cluster cluster) {
  if (cluster.count == 0) return;
  for (std::size_t l = 0; l < energy_.size(); ++l) energy_[l] += cluster.left[0][l];
  clusters_.push_back(std::move(cluster));
}

VectorTuning::Cluster VectorTuning::measured(const ClusterBasis& basis, std::size_t vertices,
                                             std::vector<double> sigma) const {
  Cluster c;
  c.count = basis.count;
  c.sigma = std::move(sigma);
  const std::size_t lights = lightings_->size(), columns = lightings_->front().size();
  if (basis.count == 0) return c;
  const std::size_t size = basis.vector.size() / basis.count, parts = size / columns;

  // Sums of vectors under each lighting, whole and by the level at which their entries fall out.
  // Blocks are taken as 16 vectors of one term; where they straddle terms in the file, entries are
  // of like size.
  std::vector<float> sums(basis.count * parts * lights, 0.0f);
  std::vector<float> by_level(basis.count * parts * lights * (kLevels + 1), 0.0f);
  c.entries.assign(basis.count + 1, std::vector<double>(kLevels + 1, 0.0));
  for (std::size_t p = 0; p < parts; ++p) {
    for (std::size_t first = 0; first < basis.count; first += kBlock) {
      const std::size_t end = std::min(first + kBlock, basis.count);
      for (std::size_t j = 0; j < columns; ++j) {
        float energy = 0;
        for (std::size_t i = first; i < end; ++i) {
          const float b = basis.vector[i * size + p * columns + j];
          energy += b * b;
        }
        if (energy == 0) continue;
        const auto level =
            static_cast<std::size_t>(level_of(std::sqrt(energy / static_cast<float>(end - first))));
        for (std::size_t i = first; i < end; ++i) {
          const float b = basis.vector[i * size + p * columns + j];
          ++c.entries[i + 1][level];
          for (std::size_t l = 0; l < lights; ++l) {
            const float part = b * (*lightings_)[l][j];
            sums[(i * parts + p) * lights + l] += part;
            by_level[((i * parts + p) * lights + l) * (kLevels + 1) + level] += part;
          }
        }
      }
    }
  }
  for (std::size_t s = 0; s < basis.count * parts * lights; ++s) {
    float* level = by_level.data() + s * (kLevels + 1);
    for (int t = 1; t <= kLevels; ++t) level[t] += level[t - 1];
  }

  for (std::size_t i = 1; i <= basis.count; ++i) {
    for (std::size_t t = 0; t <= kLevels; ++t) c.entries[i][t] += c.entries[i - 1][t];
  }

  // Errors, vector after vector. A grey sum stands for three channels whose squared colours add up
  // to 3.
  const double share = basis.channels == 1 ? 3 : 1;
  c.left.assign(basis.count + 1, std::vector<double>(lights, 0.0));
  c.dropped.assign(basis.count + 1,
                   std::vector<std::vector<double>>(kLevels, std::vector<double>(lights, 0.0)));
  std::vector<double> lost(kLevels);
  for (std::size_t l = 0; l < lights; ++l) {
    for (std::size_t v = 0; v < vertices; ++v) {
      for (std::size_t p = 0; p < parts; ++p) {
        double rest = static_cast<double>(basis.exact[(l * vertices + v) * parts + p]);
        c.left[0][l] += share * rest * rest;
        std::fill(lost.begin(), lost.end(), 0.0);
        for (std::size_t i = 0; i < basis.count; ++i) {
          const double w = basis.weight[i * vertices + v];
          const std::size_t at = (i * parts + p) * lights + l;
          rest -= w * static_cast<double>(sums[at]);
          c.left[i + 1][l] += share * rest * rest;
          const float* level = by_level.data() + at * (kLevels + 1);
          for (std::size_t t = 0; t < kLevels; ++t) {
            lost[t] += w * static_cast<double>(level[t]);
            c.dropped[i + 1][t][l] += share * lost[t] * lost[t];
          }
        }
      }
    }
  }
  return c;
}

VectorTuning::Kept VectorTuning::kept(double cut, std::size_t most, float threshold) const {
  Kept kept;
  for (const Cluster& c : clusters_) {
    const std::size_t s = chosen(c, cut, most);
    kept.vectors += static_cast<double>(s);
    for (int t = 0; t <= kLevels; ++t) {
      if (level_threshold(t) <= threshold) continue;  // they fall out
      kept.entries += c.entries[s][static_cast<std::size_t>(t)];
    }
  }
  return kept;
}

std::size_t vectors_above(const std::vector<double>& sigma, double cut, std::size_t most) {
  std::size_t count = 0;
  while (count < std::min(most, sigma.size()) && sigma[count] >= cut) ++count;
  return count;
}

std::size_t VectorTuning::chosen(const Cluster& cluster, double cut, std::size_t most) const {
  return std::min(cluster.count, vectors_above(cluster.sigma, cut, most));
}

double VectorTuning::worst(const std::vector<double>& error) const {
  double out = 0;
  for (std::size_t l = 0; l < error.size(); ++l) {
    if (energy_[l] > 0) out = std::max(out, error[l] / energy_[l]);
  }
  return std::sqrt(out);
}

double VectorTuning::basis_error(double cut, std::size_t most) const {
  std::vector<double> error(energy_.size(), 0.0);
  for (const Cluster& c : clusters_) {
    const auto& left = c.left[chosen(c, cut, most)];
    for (std::size_t l = 0; l < error.size(); ++l) error[l] += left[l];
  }
  return worst(error);
}

double VectorTuning::cut_for(double error, std::size_t most) const {
  double largest = 0;
  for (const Cluster& c : clusters_) {
    if (!c.sigma.empty()) largest = std::max(largest, c.sigma.front());
  }
  for (int step = 0; step < kCuts; ++step) {
    const double cut = largest * std::exp2(-0.25 * step);
    if (basis_error(cut, most) <= error) return cut;
  }
  return 0;
}

float VectorTuning::threshold_for(double error, double cut, std::size_t most) const {
  float best = 0;
  for (int t = 0; t < kLevels; ++t) {
    std::vector<double> sum(energy_.size(), 0.0);
    for (const Cluster& c : clusters_) {
      const auto& dropped = c.dropped[chosen(c, cut, most)][static_cast<std::size_t>(t)];
      for (std::size_t l = 0; l < sum.size(); ++l) sum[l] += dropped[l];
    }
    if (worst(sum) > error) break;
    best = level_threshold(t);
  }
  return best;
}

}  // namespace haarlight
