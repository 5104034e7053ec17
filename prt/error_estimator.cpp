// Sketches and norms of columns, times the lighting that is left out.

#include "prt/error_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/parallel.h"
#include "core/simd.h"

namespace haarlight {
namespace {

constexpr int kColumnsOfSlice = 256;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A slice's sums of up to 256 floats, none negative, each product rounded: 257 x 2^-24 < 2e-5.
constexpr double kSumRounding = 1 + 2e-5;
// Sums of a table: 256 floats a lane and chunk, 2e-5 of what they would be without signs, which is
// at most the norm times the root of their number.
constexpr double kTableRounding = 2e-5;
// Rounding of finished pixels, of either picture and relative to it: two float operations for a
// pixel; a dozen, on values that may cancel in differences of corners, for one of a mesh.
constexpr double kPixelRounding = 2 * 0x1p-24, kMeshPixelRounding = 64 * 0x1p-24;

// out[group][channel][lane] += column[group][channel][lane] * x[channel].
HAARLIGHT_MULTIVERSION void add_sketch(const float* column, const float* x, std::size_t lanes,
                                       std::size_t size, float* out) {
  for (std::size_t first = 0; first < size; first += 3 * lanes) {
    for (std::size_t ch = 0; ch < 3; ++ch) {
      const std::size_t at = first + ch * lanes;
      for (std::size_t i = 0; i < lanes; ++i) out[at + i] += column[at + i] * x[ch];
    }
  }
}

// Sums over columns, [channel][group]. No `sum` column: no sums.
struct BoundSums {
  float *change, *light;
  double* sum;
};

HAARLIGHT_MULTIVERSION void add_bounds(const float* norm, const float* sum, const float* change,
                                       const float* light, std::size_t groups,
                                       const BoundSums& out) {
  for (std::size_t ch = 0; ch < 3; ++ch) {
    const float most = std::abs(change[ch]), bright = std::abs(light[ch]);
    const auto exact = static_cast<double>(light[ch]);
    const std::size_t first = ch * groups;
    for (std::size_t g = 0; g < groups; ++g) {
      out.change[first + g] += most * norm[first + g];
      out.light[first + g] += bright * norm[first + g];
    }
    if (!sum) continue;
    for (std::size_t g = 0; g < groups; ++g) {
      out.sum[first + g] += exact * static_cast<double>(sum[first + g]);
    }
  }
}

double squared(double x) { return x * x; }

}  // namespace

bool ErrorEstimator::fits(const Transport& transport) {
  const TransportInfo& info = transport.info();
  return info.terms == 1 && !info.view && !info.clusters;
}

ErrorEstimator::ErrorEstimator(const Transport& transport) {
  if (!fits(transport)) {
    throw Error(ErrorKind::invalid_argument,
                "the transport has view factors or clusters, expected rows that are pixels or "
                "vertices: its picture's error cannot be estimated");
  }
  tables_ = std::make_shared<const ErrorTables>(transport);
  mesh_ = transport.kind() == TransportKind::mesh;
  const ErrorTables& t = *tables_;
  if (mesh_) row_output_.assign(transport.row_output().begin(), transport.row_output().end());
  view_mean_.assign(t.sketch_groups, 1.0);
  view_most_.assign(t.groups, 1.0);
  change_.resize(t.sketch_size());
  target_.resize(t.sketch_size());
  change_bound_.resize(3 * t.groups);
  target_bound_.resize(3 * t.groups);
  target_sum_.resize(3 * t.groups);
  const int slices = (transport.layout().size() + kColumnsOfSlice - 1) / kColumnsOfSlice;
  slices_.resize(static_cast<std::size_t>(slices));
  for (Slice& s : slices_) {
    s.change.resize(change_.size());
    s.target.resize(target_.size());
    s.change_bound.resize(change_bound_.size());
    s.target_bound.resize(target_bound_.size());
    s.target_sum.resize(target_sum_.size());
  }
}

// A pixel's error is at most that of its vertices, each by its share of the picture. Weighted rows
// hold root(area) x error; what is missing is the share over the area: on average over a group for
// the estimate, at most for the bound.
void ErrorEstimator::look(const PictureView& view) {
  const std::span<const float> weights = view.vertex_weights;
  if (!mesh_) return;
  const ErrorTables& t = *tables_;
  std::vector<double>&share = target_sum_, &area = view_mean_;  // scratch; no heap
  std::fill(share.begin(), share.end(), 0.0);
  std::fill(area.begin(), area.end(), 0.0);
  std::fill(view_most_.begin(), view_most_.end(), 0.0);
  for (std::size_t row = 0; row < row_output_.size(); ++row) {
    if (row_output_[row] == kNoOutput) continue;
    const std::size_t g = t.group_of_row(row);
    const auto w = static_cast<double>(weights[row_output_[row]]);
    const auto a = static_cast<double>(t.area[row]);
    share[t.sketch_of_group(g)] += w;
    area[t.sketch_of_group(g)] += a;
    view_most_[g] = std::max(view_most_[g], w / (a + 1));
  }
  for (std::size_t g = 0; g < area.size(); ++g)
    view_mean_[g] = area[g] > 0 ? share[g] / area[g] : 0;
  calibration_ = 1;
}

void ErrorEstimator::sum_up(std::span<const Rgb> target, std::span<const Rgb> shown,
                            bool with_bound) {
  const ErrorTables& t = *tables_;
  parallel_for(static_cast<int>(slices_.size()), [&](int slice) {
    Slice& s = slices_[static_cast<std::size_t>(slice)];
    for (auto* sums : {&s.change, &s.target, &s.change_bound, &s.target_bound}) {
      std::fill(sums->begin(), sums->end(), 0.0f);
    }
    std::fill(s.target_sum.begin(), s.target_sum.end(), 0.0);
    const auto begin = static_cast<std::size_t>(slice) * kColumnsOfSlice;
    const std::size_t end = std::min(begin + kColumnsOfSlice, target.size());
    for (std::size_t j = begin; j < end; ++j) {
      const Rgb d = target[j] - shown[j];
      const float change[3] = {d.r, d.g, d.b};
      const float light[3] = {target[j].r, target[j].g, target[j].b};
      const bool lit = !(target[j] == Rgb{}), changed = !(target[j] == shown[j]);
      if (!lit && !changed) continue;
      const float* column = t.sketch.data() + j * t.sketch_size();
      if (changed) add_sketch(column, change, t.lanes, t.sketch_size(), s.change.data());
      if (lit) add_sketch(column, light, t.lanes, t.sketch_size(), s.target.data());
      if (!with_bound) continue;
      const std::size_t at = j * t.groups * 3;
      add_bounds(t.norm.data() + at, mesh_ ? nullptr : t.sum.data() + at, change, light, t.groups,
                 {s.change_bound.data(), s.target_bound.data(), s.target_sum.data()});
    }
  });
  for (auto* sums : {&change_, &target_, &change_bound_, &target_bound_, &target_sum_}) {
    std::fill(sums->begin(), sums->end(), 0.0);
  }
  const auto add = [](const auto& from, std::vector<double>& to) {
    for (std::size_t i = 0; i < to.size(); ++i) to[i] += static_cast<double>(from[i]);
  };
  for (const Slice& s : slices_) {
    add(s.change, change_);
    add(s.target, target_);
    if (!with_bound) continue;
    add(s.change_bound, change_bound_);
    add(s.target_bound, target_bound_);
    add(s.target_sum, target_sum_);
  }
}

double ErrorEstimator::weighted(const std::vector<double>& sketch) const {
  double sum = 0;
  const std::size_t size = 3 * tables_->lanes;
  for (std::size_t g = 0; g < view_mean_.size(); ++g) {
    double group = 0;
    for (std::size_t i = 0; i < size; ++i) group += squared(sketch[g * size + i]);
    sum += view_mean_[g] * group;
  }
  return std::sqrt(sum);
}

double ErrorEstimator::estimate() const {
  const double change = weighted(change_);
  if (change == 0) return 0;
  const double target = calibration_ * weighted(target_);
  return target > 0 ? change / target : kInfinity;
}

void ErrorEstimator::begin(std::span<const Rgb> target, std::span<const Rgb> shown) {
  sum_up(target, shown, false);
}

void ErrorEstimator::take(int index, const Rgb& difference) {
  const ErrorTables& t = *tables_;
  const float* column = t.sketch.data() + static_cast<std::size_t>(index) * t.sketch_size();
  const float x[3] = {difference.r, difference.g, difference.b};
  for (std::size_t k = 0; k < change_.size(); ++k) {
    change_[k] -= static_cast<double>(column[k] * x[k / t.lanes % 3]);
  }
}

PictureErrorGuess ErrorEstimator::judge(std::span<const Rgb> target, std::span<const Rgb> shown,
                                        double picture_norm) {
  sum_up(target, shown, true);
  PictureErrorGuess guess;
  guess.estimate = estimate();

  // How far the sketch is off for what is shown, which is known: kept for the next frame.
  std::vector<double>& of_shown = target_;
  for (std::size_t k = 0; k < of_shown.size(); ++k) of_shown[k] -= change_[k];
  const double sketched = weighted(of_shown);
  if (sketched > 0 && picture_norm > 0) calibration_ = picture_norm / sketched;

  // The largest that the difference, the least that the exact picture can be.
  const ErrorTables& t = *tables_;
  double most = 0, by_means = 0;
  for (std::size_t g = 0; g < t.groups; ++g) {
    for (std::size_t ch = 0; ch < 3; ++ch) {
      const std::size_t k = ch * t.groups + g;
      if (change_bound_[k] > 0) most += view_most_[g] * squared(kSumRounding * change_bound_[k]);
      if (mesh_ || t.group_rows[g] == 0) continue;
      const double rows = static_cast<double>(t.group_rows[g]);
      const double slack = kTableRounding * std::sqrt(rows) * kSumRounding * target_bound_[k];
      by_means += squared(std::max(0.0, std::abs(target_sum_[k]) - slack)) / rows;
    }
  }
  most = std::sqrt(most);
  const double rounding = mesh_ ? kMeshPixelRounding : kPixelRounding;
  const double least =
      std::max(std::sqrt(by_means), picture_norm * (1 - rounding) - most) * (1 - rounding);
  if (most == 0 && picture_norm == 0) {
    guess.bound = 0;
  } else if (!(least > 0)) {
    guess.bound = kInfinity;
  } else {
    guess.bound = (most + rounding * (picture_norm + least + most)) / least;
  }
  return guess;
}

}  // namespace haarlight
