// The BRDF of a material as a function of three angles.

#pragma once

#include <array>

#include "core/rgb.h"
#include "precompute/bsdf.h"
#include "precompute/scene.h"

namespace haarlight {

/// f_r(w_i, w_o) cos theta_i of an isotropic material in two parts, as precompute/bsdf.h splits it:
///   diffuse_in(cos_i) diffuse_out(cos_o)
///   + sum over s < scalars() of lobe_s(cos_i, cos_o, phi) color_s(cos_o),   phi = phi_i - phi_o
/// Both are even in phi and finite at grazing directions. Texture factors are in the material's own
/// numbers. Mirrors and smooth metals are lobes of the least half width; what glass and thin walls
/// let through is nothing.
class IsotropicBrdf {
 public:
  explicit IsotropicBrdf(const Material& material);

  bool has_diffuse() const;
  double diffuse_in(double cosine_i) const;
  /// Without the reflectance: 1 for plain Lambert, the coat's share else.
  double diffuse_out(double cosine_o) const;
  /// Colour of the diffuse part.
  const RgbD& reflectance() const { return reflectance_; }

  /// The lobe as seen from one direction.
  struct View {
    Bsdf bsdf;
    double cosine = 1;
    std::array<RgbD, 3> color;
  };
  View view(double cosine_o) const;
  int scalars() const { return scalars_; }  ///< 0: no lobe
  std::array<double, 3> lobe(const View& view, double cosine_i, double phi) const;

  /// About half of the lobe lies within this angle of its axis, radians; pi without one.
  double half_width() const { return half_width_; }

 private:
  Scene scene_;  // the material alone
  int scalars_ = 0;
  RgbD reflectance_;
  double half_width_ = kPi;
};

/// Narrower lobes are taken as if they were as wide (radians, about 1.4 degrees): the few terms
/// that are kept of a BRDF turn too slowly to tell.
inline constexpr double kLeastHalfWidth = 0.025;

}  // namespace haarlight
