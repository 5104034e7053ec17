// How far a frame's picture is from the exact one, without the exact one: an estimate and a bound,
// from the lighting that is left out.

#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "core/rgb.h"
#include "prt/error_tables.h"
#include "prt/transport.h"

namespace haarlight {

/// With L the target, S what is shown and d = L - S, both about the relative error
///   || picture(S) - picture(L) || / || picture(L) ||        (L2 over pixels and channels).
struct PictureErrorGuess {
  double estimate = 0;  ///< from sketches: unbiased in the squares; spread about 10 %
  double bound = 0;     ///< never below the error; infinity where nothing can be said
};

/// Both hold for the transport as it is; what its compression cost is another error, which its file
/// states (measured_error).
///
/// The estimate is || A d || / || A L ||, A = S T a sketch of T (ErrorTables), of which the lower
/// term is corrected by what is known exactly: || picture(S) || / || A S || of the last frame.
/// The bound is the triangle inequality by groups of rows g and channels c,
///   || T d ||^2 <= sum_gc (sum_j |d_jc| || T_jgc ||)^2,
/// over the larger of || picture(S) || less that, and what the exact means of the picture over the
/// groups say by themselves (Cauchy-Schwarz); the float rounding of both pictures is added. A mesh
/// is seen through weights: a pixel is a mean of vertices, so that (Jensen) its squared error is at
/// most the mean of theirs.
class ErrorEstimator {
 public:
  /// Whether there is an estimate for such a transport: rows are pixels, or vertices that look
  /// alike from everywhere.
  static bool fits(const Transport& transport);

  /// Reads the whole transport once. Throws Error{invalid_argument} unless it fits.
  explicit ErrorEstimator(const Transport& transport);

  /// Of a mesh: the sum over the picture's pixels of each vertex's weight times coverage, from the
  /// next call on (MeshPicture fragments). Not for a picture, whose pixels all count 1.
  void set_vertex_weights(std::span<const float> weights);

  /// `picture_norm` is the L2 norm, over pixels and channels, of the picture that shows `shown`.
  /// Both lightings are layout.size() coefficients. O(size()); no heap use once warm; the same bits
  /// on any number of threads.
  PictureErrorGuess judge(std::span<const Rgb> target, std::span<const Rgb> shown,
                          double picture_norm);

  // The estimate step by step, for choosing wavelets by it.

  /// Begins with the relative error of showing `shown` under `target`.
  void begin(std::span<const Rgb> target, std::span<const Rgb> shown);
  /// The estimate now; infinity for something shown under a black target.
  double estimate() const;
  /// As if coefficient `index` were shown exactly, whose part of d is `difference`.
  void take(int index, const Rgb& difference);

  const ErrorTables& tables() const { return *tables_; }

 private:
  void sum_up(std::span<const Rgb> target, std::span<const Rgb> shown, bool with_bound);
  double weighted(const std::vector<double>& sketch) const;

  std::shared_ptr<const ErrorTables> tables_;
  bool mesh_ = false;
  std::vector<std::uint32_t> row_output_;
  std::vector<double> view_mean_, view_most_;  // per group: see the source
  double calibration_ = 1;                     // || picture || over the sketch's norm

  // Of the frame: sketches of d and of the target, [group][channel][lane], and for the bound.
  std::vector<double> change_, target_;
  std::vector<double> change_bound_, target_bound_, target_sum_;  // [group][channel]
  struct Slice {                                                  // likewise, of some coefficients
    std::vector<float> change, target, change_bound, target_bound;
    std::vector<double> target_sum;
  };
  std::vector<Slice> slices_;
};

}  // namespace haarlight
