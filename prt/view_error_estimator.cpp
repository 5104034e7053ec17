// Errors of a few vertices in full, and norms of all.

#include "prt/view_error_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "prt/error_tables.h"

namespace haarlight {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kMostSamples = 512, kMostSums = 4096, kLeastSamples = 64;
// Classes are groups times terms. The more, the sharper the bound, and the longer it takes.
constexpr std::size_t kNormBytes = 40u << 20, kMostClasses = 1024, kMostGroups = 256;
// Rounding of a pixel from vertices, see prt/error_estimator.cpp; of a vertex from K terms, a
// product and sums each.
constexpr double kPixelRounding = 64 * 0x1p-24, kUnit = 0x1p-24;
// Of a picture's sum: doubles of one sign or another; shares are floats, of exact sums of floats.
constexpr double kSumRounding = 1e-9, kShareRounding = 4 * kUnit;

double squared(double x) { return x * x; }
double channel(const RgbD& c, std::size_t ch) { return ch == 0 ? c.r : ch == 1 ? c.g : c.b; }

// Adds to chances so that they are in proportion to sizes, at most 1, and `wanted` in all: what is
// larger than its part is certain, and others share what is left.
void add_chances(std::span<const std::uint32_t> vertices, std::span<const float> size,
                 double wanted, std::vector<double>& chance) {
  std::vector<float> sorted;
  for (const std::uint32_t v : vertices) {
    if (size[v] > 0) sorted.push_back(size[v]);
  }
  std::sort(sorted.begin(), sorted.end());
  double rest = 0;
  for (const float s : sorted) rest += static_cast<double>(s);
  double left = std::min(wanted, static_cast<double>(sorted.size()));
  while (!sorted.empty() && static_cast<double>(sorted.back()) * left > rest) {
    rest -= static_cast<double>(sorted.back());
    left -= 1;
    sorted.pop_back();
  }
  const double most = sorted.empty() ? 0 : static_cast<double>(sorted.back());
  const double a_unit = rest > 0 ? left / rest : 0;
  for (const std::uint32_t v : vertices) {
    const auto own = static_cast<double>(size[v]);
    if (own > 0) chance[v] += own > most ? 1 : std::min(1.0, own * a_unit);
  }
}

}  // namespace

ViewErrorEstimator::ViewErrorEstimator(const Transport& transport)
    : transport_(transport), sum_(transport) {
  const TransportInfo& info = transport.info();
  if (!info.mesh) {
    throw Error(ErrorKind::invalid_argument,
                "the transport is of a picture, expected one of a mesh or of clusters");
  }
  vertices_ = info.mesh->position.size();
  terms_ = static_cast<std::size_t>(info.terms);
  area_ = relative_vertex_areas(*info.mesh);
  const auto columns = static_cast<std::size_t>(transport.layout().size());
  const std::size_t classes = std::min(kNormBytes / (3 * sizeof(float) * columns), kMostClasses);
  groups_ = std::clamp<std::size_t>(classes / terms_, 1, kMostGroups);
  const auto rows = static_cast<std::size_t>(transport.rows());
  std::vector<std::uint32_t> class_of(rows, kNoOutput);
  std::vector<float> weight_of(rows, 0.0f);
  const auto group_of = [&](std::size_t i, std::size_t count) {
    return static_cast<std::uint32_t>(std::min(i * groups_ / count, groups_ - 1));
  };
  if (info.clusters) {
    const ClusterWeights& w = *info.clusters;
    const auto clusters = static_cast<std::size_t>(w.clusters());
    order_ = w.vertex;
    cluster_of_.resize(vertices_);
    for (std::size_t c = 0; c < clusters; ++c) {
      group_.push_back(group_of(c, clusters));
      for (std::size_t p = w.first_vertex[c]; p < w.first_vertex[c + 1]; ++p) {
        cluster_of_[w.vertex[p]] = static_cast<std::uint32_t>(c);
      }
      const std::size_t vectors = w.vectors_of(c);
      for (std::size_t i = 0; i < terms_ * vectors; ++i) {
        const std::size_t row = w.first_vector[c] * terms_ + i;
        class_of[row] = static_cast<std::uint32_t>(group_.back() * terms_ + i / vectors);
        weight_of[row] = static_cast<float>(w.vertices_of(c));
      }
    }
  } else {
    row_.assign(vertices_ * terms_, kNoOutput);
    for (std::size_t row = 0; row < rows; ++row) {
      const std::uint32_t output = transport.row_output()[row];
      if (output == kNoOutput) continue;
      row_[output] = static_cast<std::uint32_t>(row);
      if (output % terms_ == 0) order_.push_back(static_cast<std::uint32_t>(output / terms_));
    }
    group_.resize(vertices_);
    for (std::size_t i = 0; i < order_.size(); ++i) group_[order_[i]] = group_of(i, order_.size());
    for (std::size_t o = 0; o < row_.size(); ++o) {
      if (row_[o] == kNoOutput) continue;
      class_of[row_[o]] = static_cast<std::uint32_t>(group_[o / terms_] * terms_ + o % terms_);
      weight_of[row_[o]] = area_[o / terms_] + 1;
    }
  }
  norms_.emplace(transport, class_of, weight_of, groups_ * terms_);
}

ViewErrorEstimator::~ViewErrorEstimator() = default;

// Systematic: along the order, so that the samples are spread over the surface.
void ViewErrorEstimator::draw_samples(std::span<const float> share) {
  const auto wanted = static_cast<double>(
      std::min(order_.size(), std::clamp(kMostSums / terms_, kLeastSamples, kMostSamples)));
  std::vector<double> chance(vertices_, 0.0);
  add_chances(order_, share, 0.5 * wanted, chance);
  add_chances(order_, area_, 0.5 * wanted, chance);
  double reached = 0.5;  // of the places drawn at, one apart
  std::vector<RowSum> sums;
  for (const std::uint32_t v : order_) {
    const double expected = std::min(chance[v], 1.0);
    if (expected >= 1) {
      samples_.push_back({v, 1.0});
      continue;
    }
    reached += expected;
    if (reached < 1) continue;
    reached -= 1;
    samples_.push_back({v, 1 / expected});
  }
  const TransportInfo& info = transport_.info();
  std::vector<std::uint32_t> place_of(info.clusters ? vertices_ : 0);
  for (std::size_t p = 0; p < place_of.size(); ++p) {
    place_of[order_[p]] = static_cast<std::uint32_t>(p);
  }
  const std::vector<std::size_t> begin =
      info.clusters ? info.clusters->weight_begin() : std::vector<std::size_t>();
  for (const Sample& sample : samples_) {
    for (std::size_t k = 0; k < terms_; ++k) {
      RowSum& sum = sums.emplace_back();
      if (!info.clusters) {
        const std::uint32_t row = row_[sample.vertex * terms_ + k];
        if (row == kNoOutput) continue;
        sum = {row, {1.0f}, transport_.row_color()[row]};
        continue;
      }
      const ClusterWeights& w = *info.clusters;
      const std::size_t c = cluster_of_[sample.vertex], place = place_of[sample.vertex];
      const std::size_t vectors = w.vectors_of(c);
      sum.first_row = static_cast<std::uint32_t>(w.first_vector[c] * terms_ + k * vectors);
      for (std::size_t i = 0; i < vectors; ++i) {
        const std::size_t at = begin[c] + i * w.vertices_of(c) + place - w.first_vertex[c];
        sum.weight.push_back(static_cast<float>(w.weight[at]) * w.scale[w.first_vector[c] + i] *
                             transport_.row_color()[sum.first_row + i].r);
      }
      if (!w.tint.empty()) sum.color = ClusterWeights::tint_of(w.tint[place * terms_ + k]);
    }
  }
  rows_.emplace(transport_, std::move(sums));
}

void ViewErrorEstimator::look(const PictureView& view) {
  if (!rows_) draw_samples(view.vertex_weights);
  share_.assign(view.vertex_weights.begin(), view.vertex_weights.end());
  factor_.assign(view.factors.begin(), view.factors.end());
  sum_looked_ = false;
  const auto factor = [&](std::size_t v, std::size_t k) {
    return view.factors.empty() ? RgbD{1, 1, 1} : RgbD(view.factors[v * terms_ + k]);
  };
  sample_share_.clear();
  sample_factor_.clear();
  for (const Sample& sample : samples_) {
    sample_share_.push_back(sample.per_share *
                            static_cast<double>(view.vertex_weights[sample.vertex]));
    for (std::size_t k = 0; k < terms_; ++k) sample_factor_.push_back(factor(sample.vertex, k));
  }

  // F squared, then its root.
  most_factor_.assign(groups_ * terms_ * 3, 0.0);
  const TransportInfo& info = transport_.info();
  if (info.clusters) {
    const ClusterWeights& w = *info.clusters;
    const std::vector<std::size_t> begin = w.weight_begin();
    cluster_factor_.assign(static_cast<std::size_t>(w.clusters()) * terms_ * 3, 0.0);
    for (std::size_t c = 0; c < static_cast<std::size_t>(w.clusters()); ++c) {
      const std::size_t count = w.vertices_of(c);
      double* of_cluster = cluster_factor_.data() + c * terms_ * 3;
      for (std::size_t p = 0; p < count; ++p) {
        const std::size_t place = w.first_vertex[c] + p, v = w.vertex[place];
        const auto share = static_cast<double>(view.vertex_weights[v]);
        if (share == 0) continue;
        double size = 0;
        for (std::size_t i = 0; i < w.vectors_of(c); ++i) {
          size += squared(static_cast<double>(w.weight[begin[c] + i * count + p]) *
                          static_cast<double>(w.scale[w.first_vector[c] + i]));
        }
        for (std::size_t k = 0; k < terms_; ++k) {
          RgbD g = factor(v, k);
          if (!w.tint.empty()) g = g * RgbD(ClusterWeights::tint_of(w.tint[place * terms_ + k]));
          for (std::size_t ch = 0; ch < 3; ++ch) {
            of_cluster[3 * k + ch] += share * size * squared(channel(g, ch));
          }
        }
      }
      for (std::size_t i = 0; i < 3 * terms_; ++i) {
        double& most = most_factor_[group_[c] * terms_ * 3 + i];
        if (count > 0) most = std::max(most, of_cluster[i] / static_cast<double>(count));
      }
    }
  } else {
    for (std::size_t v = 0; v < vertices_; ++v) {
      const auto share = static_cast<double>(view.vertex_weights[v]);
      if (share == 0) continue;
      for (std::size_t k = 0; k < terms_; ++k) {
        const RgbD g = factor(v, k);
        for (std::size_t ch = 0; ch < 3; ++ch) {
          double& most = most_factor_[(group_[v] * terms_ + k) * 3 + ch];
          most =
              std::max(most, share * squared(channel(g, ch)) / (static_cast<double>(area_[v]) + 1));
        }
      }
    }
  }
  for (double& most : most_factor_) most = std::sqrt(most) * (1 + 1e-6);
}

void ViewErrorEstimator::set_pending(std::span<const double> rows) {
  pending_.assign(rows.begin(), rows.end());
}

double ViewErrorEstimator::weighted(const std::vector<RgbD>& sums) const {
  double total = 0;
  for (std::size_t s = 0; s < sample_share_.size(); ++s) {
    RgbD out;
    for (std::size_t k = 0; k < terms_; ++k) {
      out += sample_factor_[s * terms_ + k] * sums[s * terms_ + k];
    }
    total += sample_share_[s] * (squared(out.r) + squared(out.g) + squared(out.b));
  }
  return std::sqrt(total);
}

void ViewErrorEstimator::begin(std::span<const Rgb> target, std::span<const Rgb> shown) {
  rows_->multiply(target, shown, change_, light_);
  target_norm_ = weighted(light_);
}

double ViewErrorEstimator::estimate() const {
  const double change = weighted(change_);
  if (change == 0) return 0;
  return target_norm_ > 0 ? change / target_norm_ : kInfinity;
}

void ViewErrorEstimator::take(int index, const Rgb& difference) {
  rows_->take_away(index, difference, change_);
}

PictureErrorGuess ViewErrorEstimator::judge(std::span<const Rgb> target, std::span<const Rgb> shown,
                                            double picture_norm) {
  PictureErrorGuess guess;
  begin(target, shown);
  if (!pending_.empty()) rows_->add_rows(pending_, change_);
  guess.estimate = estimate();

  // What is pending, class by class.
  norms_->bound(target, shown, change_bound_, light_bound_);
  pending_bound_.assign(most_factor_.size(), 0.0);
  if (!pending_.empty()) {
    const ClusterWeights& w = *transport_.info().clusters;
    for (std::size_t c = 0; c < static_cast<std::size_t>(w.clusters()); ++c) {
      const std::size_t vectors = w.vectors_of(c), first = w.first_vector[c] * terms_;
      for (std::size_t i = 0; i < 3 * terms_ * vectors; ++i) {
        const std::size_t row = first + i / 3, k = i / 3 / vectors;
        const auto color = static_cast<double>(transport_.row_color()[row].r);
        pending_bound_[(group_[c] * terms_ + k) * 3 + i % 3] +=
            cluster_factor_[(c * terms_ + k) * 3 + i % 3] *
            squared(color * pending_[3 * first + i]);
      }
    }
  }
  double most = 0, sizes = 0;
  for (std::size_t g = 0; g < groups_; ++g) {
    for (std::size_t ch = 0; ch < 3; ++ch) {
      double change = 0, size = 0;
      for (std::size_t k = 0; k < terms_; ++k) {
        const std::size_t i = (g * terms_ + k) * 3 + ch;
        change += most_factor_[i] * change_bound_[i] + std::sqrt(pending_bound_[i]);
        size +=
            most_factor_[i] * (change_bound_[i] + light_bound_[i]) + std::sqrt(pending_bound_[i]);
      }
      most += squared(change);
      sizes += squared(size);
    }
  }
  most = std::sqrt(most) * (1 + 1e-9);
  // Of either picture: sums of terms that may cancel, relative to their sizes.
  const double sums = (static_cast<double>(terms_) + 8) * kUnit * std::sqrt(sizes);
  double least = (picture_norm * (1 - kPixelRounding) - most - 2 * sums) * (1 - kPixelRounding);
  if (least < most) {
    // A bound above 1 by what is shown: what is not shown has a sum, too.
    if (!sum_looked_) sum_.look({share_, factor_});
    sum_looked_ = true;
    const double by_sum =
        sum_.least_norm(target) * (1 - kSumRounding) - sums - kShareRounding * std::sqrt(sizes);
    least = std::max(least, by_sum * (1 - kPixelRounding));
  }
  if (most == 0 && picture_norm == 0) {
    guess.bound = 0;
  } else if (!(least > 0)) {
    guess.bound = kInfinity;
  } else {
    guess.bound = (most + 2 * sums + kPixelRounding * (picture_norm + least + most)) / least;
  }
  return guess;
}

}  // namespace haarlight
