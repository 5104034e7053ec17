// The GGX microfacet lobe: distribution, masking, visible normals, tabulated albedo.

#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "core/frame.h"
#include "core/vec.h"

namespace haarlight {

/// D V n.w for unit w and o about the unit normal n: GGX distribution, height-correlated Smith
/// masking (Heitz 2014); 0 unless both are above the horizon, finite at grazing. alpha > 0.
/// `half_cosine` is set to w.h.
double ggx_times_cosine(const Vec3& n, const Vec3& w, const Vec3& o, double alpha,
                        double& half_cosine);

/// Density at w, per solid angle, of the light direction over visible normals (Heitz 2018).
double ggx_pdf(const Vec3& n, const Vec3& w, const Vec3& o, double alpha);

/// A direction of that density by two numbers in [0, 1), by a spherical cap (Dupuy and Benyoub
/// 2023); none below the horizon.
std::optional<Vec3> ggx_sample(const Vec3& n, const Vec3& o, double alpha, double u, double v);

/// What a coat of reflectance f0 at normal incidence reflects in all, the lobe's compensation
/// 1 + f0 (1 - E) / E included, and its cosine-weighted mean over the hemisphere. [0, 1].
/// alpha = 0: Schlick's Fresnel itself.
double coat_albedo(double cosine, double alpha, double f0);
double coat_mean_albedo(double alpha, double f0);

/// The table behind ggx_albedo() for one alpha: first and second in turn at cosines (i / 63)^2.
/// Linear interpolation over the square root of the cosine is ggx_albedo() itself, alpha > 0.
inline constexpr std::size_t kAlbedoNodes = 64;
void ggx_albedo_nodes(double alpha, std::span<float, 2 * kAlbedoNodes> nodes);

}  // namespace haarlight
