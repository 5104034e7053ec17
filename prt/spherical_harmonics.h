// Real spherical harmonics, and lighting projected onto them: the basis of low-frequency PRT
// (Sloan, Kautz, Snyder 2002), with which wavelets are compared.

#pragma once

#include <span>
#include <vector>

#include "core/rgb.h"
#include "core/vec.h"
#include "wavelet/haar.h"

namespace haarlight {

inline constexpr int kMaxShOrder = 16;

/// Degrees 0 to order - 1: order^2 functions, number l^2 + l + m for degree l and -l <= m <= l.
constexpr int sh_count(int order) { return order * order; }
/// The degree of a function, which is its band.
int sh_degree(int function);

/// All functions at a unit direction into `values`, sh_count(order) of them. Orthonormal over the
/// sphere; without the Condon-Shortley phase. The polar axis is +Y. Requires 1 <= order <=
/// kMaxShOrder.
void spherical_harmonics(int order, const Vec3& direction, std::span<double> values);

/// The functions on a cube map, sampled at the middles of texels.
class ShProjection {
 public:
  /// Throws Error{invalid_argument} unless 1 <= order <= kMaxShOrder.
  ShProjection(const HaarLayout& layout, int order);

  int order() const { return order_; }
  /// Haar coefficients of a function's texels: its column of a transport is T * this.
  std::span<const float> haar(int function) const;
  /// l_k = integral of L Y_k over the sphere (W m^-2), of lighting as Haar coefficients.
  void project(std::span<const Rgb> lighting, std::span<RgbD> out) const;

 private:
  int order_;
  std::size_t size_;
  std::vector<float> haar_, haar_solid_;  // [function][coefficient], of Y and of Y times texel
};

}  // namespace haarlight
