// Hemispherical harmonics: Gautron, Krivanek, Pattanaik and Bouatouch 2004.

#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "core/vec.h"

namespace haarlight {

/// Bands l = 0 ... kHarmonicBands - 1 of a basis that is orthonormal over the upper hemisphere:
///   H_l^m = K~_l^m P_l^|m|(2 cos theta - 1) times sqrt(2) cos(m phi), 1, or sqrt(2) sin(|m| phi)
/// for m above, equal to, below 0; K~ = sqrt((2 l + 1) (l - |m|)! / (2 pi (l + |m|)!)). P without
/// the Condon-Shortley phase. Function (l, m) is number l (l + 1) + m.
inline constexpr int kHarmonicBands = 10;
inline constexpr std::size_t kHarmonics =
    static_cast<std::size_t>(kHarmonicBands) * static_cast<std::size_t>(kHarmonicBands);
using Harmonics = std::array<float, kHarmonics>;

/// All functions in a unit direction of the upper half (z up). Below it they are not defined;
/// directions a little below count as on the horizon.
Harmonics hemispherical_harmonics(const Vec3& direction);

/// Coefficients of a function that is even in y (its coefficients of m < 0 are 0) turned about z by
/// the angle whose cosine and sine are given.
Harmonics turned_about_z(const Harmonics& even, double cosine, double sine);

}  // namespace haarlight
