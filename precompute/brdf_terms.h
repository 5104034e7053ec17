// How many products of incoming and outgoing factors a BRDF is worth.

#pragma once

#include "precompute/scene.h"

namespace haarlight {

/// What brdf_terms() tells apart.
inline constexpr int kMostBrdfTerms = 64;

/// The least K for which f_r(w, o) cos = sum over k < K of f_k(w) g_k(o) leaves at most `error` of
/// its norm over both hemispheres, by the singular values of its samples, texture factors left out
/// (in-out factorisation: Wang and others 2004, Liu and others 2004). 1 for diffuse materials,
/// kMostBrdfTerms + 1 for more than that, 0 for mirrors and glass, which no finite number is enough
/// for.
int brdf_terms(const Material& material, double error);

}  // namespace haarlight
