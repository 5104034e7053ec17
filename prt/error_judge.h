// How far a frame's picture is from the exact one, without the exact one: what all ways to say it
// have in common.

#pragma once

#include <memory>
#include <span>

#include "core/rgb.h"
#include "prt/transport.h"

namespace haarlight {

/// With L the target, S what is shown and d = L - S, both about the relative error
///   || picture(S) - picture(L) || / || picture(L) ||        (L2 over pixels and channels).
struct PictureErrorGuess {
  double estimate = 0;  ///< near the error: see the makers
  double bound = 0;     ///< never below the error; infinity where nothing can be said
};

/// What a picture of a mesh is made of, from where it is seen.
struct PictureView {
  std::span<const float> vertex_weights;  ///< see MeshPicture::vertex_weights
  std::span<const Rgb> factors;           ///< g, [vertex][term]; empty: all 1
};

/// Both hold for the transport as it is; what its compression cost is another error, which its file
/// states (measured_error).
class ErrorJudge {
 public:
  virtual ~ErrorJudge() = default;

  /// Of a mesh: from the next call on. Not for a picture, whose pixels all count 1.
  virtual void look(const PictureView& view) = 0;
  /// Of a renderer that follows its rows step by step: what it has yet to follow, a sum a row over
  /// the row's colour, [row][channel]; none of others. For the next judge().
  virtual void set_pending(std::span<const double> rows) = 0;

  /// `picture_norm` is the L2 norm, over pixels and channels, of the picture that shows `shown`.
  /// Both lightings are layout.size() coefficients. O(size()); no heap use once warm; the same bits
  /// on any number of threads.
  virtual PictureErrorGuess judge(std::span<const Rgb> target, std::span<const Rgb> shown,
                                  double picture_norm) = 0;

  // The estimate step by step, for choosing wavelets by it; nothing is pending there.

  /// Begins with the relative error of showing `shown` under `target`.
  virtual void begin(std::span<const Rgb> target, std::span<const Rgb> shown) = 0;
  /// The estimate now; infinity for something shown under a black target.
  virtual double estimate() const = 0;
  /// As if coefficient `index` were shown exactly, whose part of d is `difference`.
  virtual void take(int index, const Rgb& difference) = 0;
};

/// The judge for a transport of any kind: ErrorEstimator, or ViewErrorEstimator for factors and
/// clusters. Reads the whole transport once.
std::unique_ptr<ErrorJudge> make_error_judge(const Transport& transport);

}  // namespace haarlight
