// Haar wavelets on a cube map: how coefficients are numbered, the bands, and the transform.

#pragma once

#include <span>

#include "core/rgb.h"

namespace haarlight {

/// Half-open range [begin, end) of coefficient indices.
struct IndexRange {
  int begin = 0;
  int end = 0;
  int size() const { return end - begin; }
};

/// Numbering of the Haar coefficients of a cube map of 6 faces of n x n texels.
///
/// Coefficients run coarse to fine with all six faces together, so that a band is one contiguous
/// range. Bands as in Overbeck et al. 2006, section 5.1: wavelets of equal area, the scaling
/// functions with the coarsest.
///   band 0   the 6 scaling functions, [0, 6), and the 18 wavelets of area n^2, [6, 24)
///   band b   wavelets of area n^2 / 4^b, [6 * 4^b, 6 * 4^(b+1))
/// Within a level the order is (face, orientation, y, x), x fastest, orientations horizontal,
/// vertical, diagonal: the differences along x, along y and along both.
class HaarLayout {
 public:
  static constexpr int kMaxBands = 10;

  /// `face_size` is n, in texels. Throws Error{invalid_argument} unless n is a power of two in
  /// [1, 1024].
  explicit HaarLayout(int face_size);

  int face_size() const { return face_size_; }
  int band_count() const { return band_count_; }            ///< max(1, log2 n)
  int size() const { return 6 * face_size_ * face_size_; }  ///< number of coefficients
  IndexRange band(int b) const;                             ///< requires 0 <= b < band_count()
  int band_of(int index) const;                             ///< requires 0 <= index < size()
  /// Texels under a wavelet (or scaling function) of band b: n^2 / 4^b.
  int area(int b) const;

  friend bool operator==(const HaarLayout&, const HaarLayout&) = default;

 private:
  int face_size_;
  int band_count_;
};

/// Forward transform: texel values -> coefficients, both of length layout.size().
///
/// `texels` is [face][y][x] (see wavelet/cubemap.h). The basis is orthonormal in the plain sum over
/// texels; one level takes a 2 x 2 block
///     a b      s = (a+b+c+d)/2   h = (a-b+c-d)/2
///     c d      v = (a+b-c-d)/2   d = (a-b-c+d)/2
/// and goes on with s. So with L^ and T^ the transforms of L and T
///     sum_k T[k] L[k] = sum_j T^[j] L^[j]                                      (Parseval)
/// Solid angle is therefore not applied here; it belongs to the transport and is applied there
/// exactly once. Halving is exact, so only additions round: 2 per level and axis.
///
/// Spans must not overlap. No heap use after the first call on a thread at a size. Throws
/// Error{invalid_argument} on a length that is not layout.size(). Light (Rgb) is transformed in
/// double and rounded once, since a bright sun beside a dark texel cancels; denormals count as 0.
/// Source: the nonstandard 2D Haar basis on cube faces as in Ng, Ramamoorthi and Hanrahan 2003;
/// the orthonormal scaling is ours.
void haar_forward(const HaarLayout& layout, std::span<const float> texels,
                  std::span<float> coefficients);
void haar_forward(const HaarLayout& layout, std::span<const double> texels,
                  std::span<double> coefficients);
void haar_forward(const HaarLayout& layout, std::span<const Rgb> texels,
                  std::span<Rgb> coefficients);

/// Inverse of haar_forward. Same shapes, same errors.
void haar_inverse(const HaarLayout& layout, std::span<const float> coefficients,
                  std::span<float> texels);
void haar_inverse(const HaarLayout& layout, std::span<const double> coefficients,
                  std::span<double> texels);
void haar_inverse(const HaarLayout& layout, std::span<const Rgb> coefficients,
                  std::span<Rgb> texels);

}  // namespace haarlight
