// What the terms of a factored BRDF are worth towards each direction of view.
//
//   f_r(w_i, w_o) cos = sum over k of f_k(w_i) g_k(w_o)
//
// f_k is in the rows of the transport, one a vertex and term; g_k is here (in-out factorisation:
// Wang and others 2004, Liu and others 2004; Overbeck 2006, Eq. 9).

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/rgb.h"
#include "core/vec.h"

namespace haarlight {

/// Sets of factors g_k, and which of them each vertex has. BRDFs are isotropic, so that a factor is
/// a profile over the angle from the normal, theta, times one of the circle's:
///   g(o) = profile(theta) cos(m phi)   order m >= 0
///   g(o) = profile(theta) sin(m phi)   order -m < 0
/// o in the coordinates of Frame(normal of the vertex), core/frame.h: f_k was made in the same.
/// A profile has `resolution` samples, linear between them, over t = sqrt(1 - cos theta), from 0
/// (along the normal) to 1 (at the horizon): the radius of Lambert's equal-area map of the
/// hemisphere, even in solid angle and free of poles. Factors are of mean square about 1 over the
/// hemisphere (projected solid angle), so that errors of all terms weigh alike. A plain value.
struct ViewFactors {
  int terms = 1;                      ///< a set, as of the transport
  int resolution = 2;                 ///< samples of a profile, [2, kMostViewResolution]
  std::vector<int> order;             ///< [set][term]: m, or -m for a sine
  std::vector<Rgb> profile;           ///< [set][term][sample]; all 0: the set has fewer terms
  std::vector<std::uint32_t> set_of;  ///< one a vertex

  std::size_t sets() const { return order.size() / static_cast<std::size_t>(terms); }
  std::span<const Rgb> profile_of(std::size_t set, std::size_t term) const {
    const auto n = static_cast<std::size_t>(resolution);
    return std::span(profile).subspan((set * static_cast<std::size_t>(terms) + term) * n, n);
  }
  friend bool operator==(const ViewFactors&, const ViewFactors&) = default;
};

inline constexpr int kMostViewResolution = 4096;
inline constexpr int kMostViewOrder = 1024;
inline constexpr std::size_t kMostViewSets = 65536;

/// g of one set and term towards `local`, unit, in the coordinates of Frame(normal). Directions
/// below the horizon are taken at it. In double, for tests and tools; prt/term_finish.h is the one
/// for frames.
RgbD view_factor(const ViewFactors& factors, std::size_t set, std::size_t term, const Vec3& local);

/// What is wrong with factors for a mesh of so many vertices, or nothing.
std::string check_view_factors(const ViewFactors& factors, std::size_t vertices);

/// The bytes in a file: four counts, then orders, profiles and sets under zstd.
std::vector<std::byte> pack_view_factors(const ViewFactors& factors);

/// Throws Error{format}, message beginning with `name`, unless the bytes unpack to factors of
/// `terms` terms for so many vertices that check_view_factors() finds nothing wrong with. What it
/// asks for is bounded by the number of vertices and the size of `packed`.
ViewFactors unpack_view_factors(std::span<const std::byte> packed, int terms, std::size_t vertices,
                                const std::string& name);

}  // namespace haarlight
