// How far a frame's picture is from the exact one, without the exact one: an estimate and a bound,
// from the lighting that is left out.

#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "core/rgb.h"
#include "prt/error_judge.h"
#include "prt/error_tables.h"
#include "prt/transport.h"

namespace haarlight {

/// The estimate is unbiased in the squares, with a spread of about 10 %:
/// || A d || / || A L ||, A = S T a sketch of T (ErrorTables), of which the lower
/// term is corrected by what is known exactly: || picture(S) || / || A S || of the last frame.
/// The bound is the triangle inequality by groups of rows g and channels c,
///   || T d ||^2 <= sum_gc (sum_j |d_jc| || T_jgc ||)^2,
/// over the larger of || picture(S) || less that, and what the exact means of the picture over the
/// groups say by themselves (Cauchy-Schwarz); the float rounding of both pictures is added. A mesh
/// is seen through weights: a pixel is a mean of vertices, so that (Jensen) its squared error is at
/// most the mean of theirs.
class ErrorEstimator final : public ErrorJudge {
 public:
  /// Whether there is an estimate for such a transport: rows are pixels, or vertices that look
  /// alike from everywhere.
  static bool fits(const Transport& transport);

  /// Reads the whole transport once. Throws Error{invalid_argument} unless it fits.
  explicit ErrorEstimator(const Transport& transport);

  void look(const PictureView& view) override;
  void set_pending(std::span<const double>) override {}
  PictureErrorGuess judge(std::span<const Rgb> target, std::span<const Rgb> shown,
                          double picture_norm) override;
  void begin(std::span<const Rgb> target, std::span<const Rgb> shown) override;
  double estimate() const override;
  void take(int index, const Rgb& difference) override;

  const ErrorTables& tables() const { return *tables_; }

 private:
  void sum_up(std::span<const Rgb> target, std::span<const Rgb> shown, bool with_bound);
  double weighted(const std::vector<double>& sketch) const;

  std::shared_ptr<const ErrorTables> tables_;
  bool mesh_ = false;
  std::vector<std::uint32_t> row_output_;
  std::vector<double> view_mean_, view_most_;  // per group: see the source
  double calibration_ = 1;                     // || picture || over the sketch's norm

  // Of the frame: sketches of d and of the target, [group][channel][lane], and for the bound,
  // [channel][group].
  std::vector<double> change_, target_;
  std::vector<double> change_bound_, target_bound_, target_sum_;
  struct Slice {  // likewise, of some coefficients
    std::vector<float> change, target, change_bound, target_bound;
    std::vector<double> target_sum;
  };
  std::vector<Slice> slices_;
};

}  // namespace haarlight
