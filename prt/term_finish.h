// Sums of (vertex, term) rows and a view become the radiance of vertices.

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/rgb.h"
#include "core/vec.h"
#include "prt/transport_mesh.h"
#include "prt/view_factors.h"

namespace haarlight {

/// B_v(w_o) = sum over k of g_k(w_o) U_k^v (Overbeck 2006, Eq. 9), w_o from the vertex to the eye.
/// When only the light changes, factors are kept; when only the view changes, sums are, and no
/// transport is touched. All vertices are shaded, those that look away as if seen along their
/// horizon, so that smooth silhouettes have no dark rims. The same bits on any number of threads;
/// no heap use after construction.
class TermFinish {
 public:
  /// Throws Error{invalid_argument} if there is no mesh or the factors are not for it.
  TermFinish(std::shared_ptr<const TransportMesh> mesh, std::shared_ptr<const ViewFactors> factors);

  /// From where the mesh is seen from the next shade() on; world, metres. Requires it to be finite.
  void look(const Vec3& eye);

  /// `sums` is U, [vertex][term]; `radiance` gets one entry a vertex. Call look() first.
  void shade(std::span<const Rgb> sums, std::span<Rgb> radiance) const;

  /// g as of the last look(), [vertex][term].
  std::span<const Rgb> factors() const { return factor_; }

 private:
  struct Four {
    float value[4] = {};
  };
  struct Set {
    std::uint32_t terms = 0;  // used
    int most_order = 0;
  };

  void look_slice(std::size_t begin, std::size_t end, const float* eye);

  std::shared_ptr<const TransportMesh> mesh_;
  std::shared_ptr<const ViewFactors> view_;
  std::vector<Set> set_;
  std::vector<Four> profile_;                 // as in ViewFactors, padded
  std::vector<std::array<float, 3>> normal_;  // unit
  std::vector<Rgb> factor_;
};

}  // namespace haarlight
