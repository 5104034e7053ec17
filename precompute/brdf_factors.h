// BRDFs as sums of products of what comes in and what goes out.
//
//   f_r(w_i, w_o) cos theta_i = sum over k of f_k(w_i) g_k(w_o)
//
// In-out factorisation by singular values (Wang and others 2004; Liu and others 2004; Overbeck
// 2006, section 6.2). An isotropic BRDF is a Fourier series of the angle between the directions,
//   sum over m of a_m(theta_i, theta_o) cos m (phi_i - phi_o),
// and each order is by itself a matrix over two angles: its singular vectors times cos m phi and
// sin m phi are the BRDF's own. That is exact, takes N^2 samples for each order instead of N^4, and
// its terms of order m > 0 come in pairs; as long as no pair is torn the sum of K terms is as
// isotropic as the BRDF, whatever frame a vertex has.

#pragma once

#include <memory>
#include <vector>

#include "core/rgb.h"
#include "precompute/scene.h"

namespace haarlight {

/// One term. Profiles run over t = sqrt(1 - cos theta) as in ViewFactors.
struct BrdfTerm {
  int order = 0;                 ///< m: cos(m phi); -m: sin(m phi)
  std::vector<double> incoming;  ///< of f_k, cosine included, sr^-1
  std::vector<RgbD> outgoing;    ///< of g_k; mean square over the hemisphere (projected) and
                                 ///< channels 1, so that sums of f_k rows err as the picture does
};

struct BrdfFactors {
  /// The first term is the diffuse part without its colour, the rest are the lobe's; else all are
  /// of the whole BRDF. So it is where the diffuse colour varies, and for materials without a lobe.
  bool diffuse_apart = false;
  std::vector<BrdfTerm> term;
  /// g_k is scaled down by direction where the terms together would give back more of an even
  /// light than the BRDF does.
  double error = 0;  ///< of leaving out the other terms: relative L2 norm over both hemispheres,
                     ///< solid angle of w_i times projected solid angle of w_o
};

/// The singular values of a BRDF and what belongs to them.
class BrdfSpectrum {
 public:
  /// Samples the material's BRDF (its textures left out) so finely that its lobe is resolved, in
  /// double, on all threads; the same bits on any number of them.
  BrdfSpectrum(const Material& material, bool diffuse_apart);
  ~BrdfSpectrum();
  BrdfSpectrum(BrdfSpectrum&&) noexcept;

  bool has_diffuse() const;
  /// What the row of a diffuse part that is apart is multiplied with, so that its outgoing factor
  /// is of mean square 1: 1 for plain Lambert.
  double diffuse_scale() const;
  /// Terms that are not rounding: singular values above max(rows, columns) u times the largest.
  int most_terms() const;
  /// What the best `terms` terms leave, pairs whole: see BrdfFactors::error.
  double error(int terms) const;
  /// The least number that leaves at most `error`, or most + 1.
  int terms_for(double error, int most) const;
  /// The best `terms` terms, or fewer: see most_terms().
  BrdfFactors take(int terms, int resolution) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// What brdf_terms() tells apart.
inline constexpr int kMostBrdfTerms = 64;

/// The least K that leaves at most `error` (see BrdfFactors), texture factors left out. 1 for
/// diffuse materials, kMostBrdfTerms + 1 for more than that, 0 for mirrors and glass, which no
/// finite number is enough for.
int brdf_terms(const Material& material, double error);

/// A profile at t, linear between its samples; t is taken into [0, 1].
double profile_at(const std::vector<double>& profile, double t);

}  // namespace haarlight
