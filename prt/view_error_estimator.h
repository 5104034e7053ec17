// How far the picture of a mesh with view factors, or of clusters, is from the exact one.

#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "prt/error_judge.h"
#include "prt/picture_sum.h"
#include "prt/sample_rows.h"
#include "prt/term_norms.h"

namespace haarlight {

/// What a row is worth changes with the view, so that no sketch of rows, made once, serves: terms
/// are added up after it. Instead a few hundred vertices are drawn at random, in proportion to what
/// the first picture shows of them and to their surface, half each (what is so large that it would
/// be drawn more than once is taken once, for certain), and their rows (of clusters, those put
/// together by their weights) are kept. A frame's estimate is the finished error of these
/// vertices, sum over k of g_k(w_o) (T d)_k, by what the picture shows of each over the chance to
/// be drawn (Horvitz and Thompson 1952), over the same sum of what they show exactly, which is off
/// alike. What vertices of clusters have yet to follow is in it.
///
/// The bound is the triangle inequality by groups of vertices, channels c and terms,
///   sum_gc (sum_k F_gkc sum_j |d_jc| || T_jgkc ||)^2,
/// F the largest factor times root of the share of the picture, over the least norm of the exact
/// picture: the norm of what is shown less that, or what the sum of its pixels says (PictureSum),
/// so that it is finite unless no light is seen. Clusters: rows are those of vectors, and F_gkc^2
/// the largest over clusters of the sum over vertices of share x g^2 x |w|^2 (Cauchy and Schwarz);
/// what is pending adds its own norm. Float rounding of both pictures is added.
class ViewErrorEstimator final : public ErrorJudge {
 public:
  /// Throws Error{invalid_argument} for a picture.
  explicit ViewErrorEstimator(const Transport& transport);
  ~ViewErrorEstimator() override;

  /// The first call reads the transport. Requires one before all that follows.
  void look(const PictureView& view) override;
  void set_pending(std::span<const double> rows) override;
  PictureErrorGuess judge(std::span<const Rgb> target, std::span<const Rgb> shown,
                          double picture_norm) override;
  void begin(std::span<const Rgb> target, std::span<const Rgb> shown) override;
  double estimate() const override;
  void take(int index, const Rgb& difference) override;

 private:
  struct Sample {
    std::uint32_t vertex = 0;
    double per_share = 0;  // times drawn over times expected, a unit of share
  };
  void draw_samples(std::span<const float> share);
  double weighted(const std::vector<RgbD>& sums) const;

  Transport transport_;
  std::size_t vertices_ = 0, terms_ = 1, groups_ = 1;
  std::vector<float> area_;                // [vertex]
  std::vector<std::uint32_t> order_;       // vertices, neighbours together
  std::vector<std::uint32_t> row_;         // [output], of a mesh
  std::vector<std::uint32_t> group_;       // of each vertex, or cluster
  std::vector<std::uint32_t> cluster_of_;  // [vertex], of clusters
  std::optional<TermNorms> norms_;
  PictureSum sum_;

  // Of the view, kept until sum_ is asked for.
  std::vector<float> share_;
  std::vector<Rgb> factor_;
  bool sum_looked_ = false;
  std::vector<Sample> samples_;
  std::optional<SampleRows> rows_;
  std::vector<double> sample_share_;
  std::vector<RgbD> sample_factor_;     // [sample][term]
  std::vector<double> most_factor_;     // F, [group][term][channel]
  std::vector<double> cluster_factor_;  // squared, [cluster][term][channel]

  // Of the frame.
  std::vector<RgbD> change_, light_;
  double target_norm_ = 0;
  std::vector<double> change_bound_, light_bound_, pending_, pending_bound_;
};

}  // namespace haarlight
