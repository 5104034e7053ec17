// What a surface does to light at one point, seen from one direction.
//
//   f_r cos = diffuse_out (x) diffuse_in(w)          Lambert, or Lambert below a dielectric coat
//           + gloss_first (x) lobe.first(w)          a lobe: Phong, or GGX with Fresnel split as
//           + gloss_second (x) lobe.second(w)        F = F0 (1 - s) + s, s = (1 - w.h)^5
//           + mirror and glass: at most two single directions
//
// so that a point's transport is at most three grey rows times three colours.

#pragma once

#include <array>
#include <optional>
#include <span>

#include "core/rgb.h"
#include "core/vec.h"
#include "precompute/scene.h"

namespace haarlight {

struct SurfaceHit;
struct IncomingTerm;  // precompute/incoming_term.h

/// A point's BSDF. w is the direction light comes from, o the direction it leaves to (to_viewer);
/// both unit and away from the surface. Everything is 0 for w below the shading normal's horizon,
/// except transmitted deltas. A plain value.
///
/// GGX (metallic_roughness), as in glTF 2.0, appendix B: metallic mixes a metal, F0 = base colour,
/// and a dielectric under a coat, F0 = ((ior - 1) / (ior + 1))^2. alpha = roughness^2,
/// height-correlated Smith masking, Schlick Fresnel. The lobe of each is scaled by
/// 1 + F0 (1 - E(o)) / E(o), E the lobe's albedo at F = 1, so that rough surfaces keep their energy
/// (Turquin 2019); this factor, of o alone, is the only part that is not reciprocal. The diffuse
/// part lies below the coat: (1 - metallic) base / pi times (1 - C(o)) (1 - C(w)) / (1 - C_mean),
/// C the coat's albedo, so that diffuse and coat together reflect all at base = 1 (Kelemen and
/// Szirmay-Kalos 2001). Roughness below kMirrorRoughness is a mirror (delta, Schlick Fresnel)
/// instead of a lobe. Thin-wall transmission passes straight: a delta of
/// transmission (1 - metallic) base (1 - C(o)), and the diffuse part keeps 1 - transmission.
///
/// Glass: exact unpolarised Fresnel. A triangle's outside is where its corners run
/// counter-clockwise, whatever its normals say: closed glass must be wound outwards. The weight of
/// light refracted towards the viewer has the factor (n_viewer / n_light)^2, radiance being
/// proportional to n^2: inside glass of index n it may reach n^2, and what is lost on the way in is
/// won back on the way out. A thin pane reflects R' = 2 R / (1 + R), all bounces between its faces,
/// and lets 1 - R' straight through. `albedo` tints what passes, once a surface, once a pane.
struct Bsdf {
  Vec3 geometric_normal;  ///< unit, on the viewer's side
  Vec3 normal;            ///< shading normal, unit, on the side of geometric_normal
  Vec3 to_viewer;         ///< unit

  /// Of a term of a factored BRDF: stands for the diffuse part's incoming factor. Else null.
  const IncomingTerm* term = nullptr;
  // Diffuse.
  RgbD diffuse_reflectance;  ///< (1 - metallic) base colour, or the albedo; 0: none
  double coat_f0 = 0;        ///< the coat's at normal incidence; 0: plain Lambert
  double coat_pass = 1;      ///< 1 - C_mean
  // Lobe.
  enum class Lobe { none, phong, ggx };
  Lobe lobe = Lobe::none;
  double width = 0;   ///< Phong: exponent e; GGX and coats: alpha, 0 under a mirror
  RgbD gloss_first;   ///< colour of lobe_values().first, energy compensation included
  RgbD gloss_second;  ///< colour of lobe_values().second; 0 for Phong
  // Single directions.
  struct Delta {
    Vec3 direction;            ///< where the light comes from, unit
    RgbD weight;               ///< share of its radiance that leaves towards the viewer
    bool transmitted = false;  ///< continues on the other side of the surface
    bool enters = false;  ///< transmitted into glass (thick): extinction applies until it exits,
                          ///< by a transmitted delta that does not enter
  };
  std::array<Delta, 2> delta{};
  int delta_count = 0;

  bool has_diffuse() const { return l1_norm(diffuse_reflectance) > 0; }
  bool has_lobe() const { return lobe != Lobe::none; }
  /// Only single directions: mirror or glass.
  bool is_specular() const { return delta_count > 0 && !has_diffuse() && !has_lobe(); }

  /// Outgoing factor of the diffuse part towards `o` (unit): reflectance, times the coat's if any.
  RgbD diffuse_out(const Vec3& o) const;
  /// Incoming factor, cosine and 1/pi included: max(0, n.w) / pi for Lambert, f_k for a term.
  double diffuse_in(const Vec3& w) const;

  /// Both scalars of the lobe for light from `w` leaving towards `o` (cosine n.w included). Finite
  /// at grazing directions. `second` is 0 for Phong.
  struct LobeValues {
    double first = 0, second = 0;
  };
  LobeValues lobe_values(const Vec3& w) const { return lobe_values(w, to_viewer); }
  LobeValues lobe_values(const Vec3& w, const Vec3& o) const;

  /// A direction of the lobe for to_viewer by two numbers in [0, 1): importance sampled (Phong's
  /// cosine power, GGX's visible normals), or none when it falls below the horizon (the density
  /// integrates to 1 less the chance of that).
  struct Sample {
    Vec3 direction;
    double pdf = 0;  ///< per solid angle, > 0
  };
  std::optional<Sample> sample_lobe(double u, double v) const;
  /// The density of sample_lobe() at `w`.
  double lobe_pdf(const Vec3& w) const;

  /// Reflectances by part, for choosing one at random; each in [0, 1] a channel, about right.
  RgbD diffuse_albedo() const;
  RgbD lobe_albedo() const;

  /// The angle (radians) from the lobe's axis that holds about half of it, in its narrower
  /// direction. A lobe much wider than a texel may be summed over texels, a narrower one must be
  /// sampled. pi without a lobe.
  double lobe_half_width() const;
};

/// metallic_roughness below this roughness is a mirror. Where a texture leads below it, the lobe
/// stays at it, so that the material alone says whether a surface has single directions.
inline constexpr float kMirrorRoughness = 0.03f;

/// Whether a surface of this material can have single directions: mirrors, glass, thin
/// transmission, smooth metallic_roughness.
bool has_single_directions(const Material& material);

/// Whether a surface of this material, without single directions, may have a lobe so narrow that
/// light by way of it is best looked for: GGX below a roughness of 0.5, Phong above an exponent of
/// 80 (half widths of about 0.1 radians, at grazing for GGX).
bool may_have_narrow_lobe(const Material& material);

/// The BSDF of what a ray has met.
Bsdf bsdf_at(const Scene& scene, const SurfaceHit& hit);

/// The single directions alone of a hit on a mirror or glass, where they are all there is: those of
/// bsdf_at() for a small part of its work. Of length 1 but for rounding: normalise the one taken.
struct SingleDirections {
  Vec3 geometric_normal, normal, to_viewer;  ///< as in Bsdf
  std::array<Bsdf::Delta, 2> delta{};
  int delta_count = 0;

  SingleDirections() = default;
  explicit SingleDirections(const Bsdf& bsdf) : delta(bsdf.delta), delta_count(bsdf.delta_count) {}
  /// Requires is_mirror_or_glass(material), the material of `hit`.
  SingleDirections(const Material& material, const SurfaceHit& hit);
};

inline bool is_mirror_or_glass(const Material& material) {
  return material.model == SurfaceModel::mirror || material.model == SurfaceModel::glass;
}

/// A direction about `normal` with density max(0, n.w) / pi, by two numbers in [0, 1).
Vec3 cosine_direction(const Vec3& normal, double u, double v);

/// Albedo of the GGX lobe, E = integral of D V n.w dw: for F = F0 (1 - s) + s it is
/// F0 first + second. From a table computed once, in double, within 3e-3 for alpha from
/// kMirrorRoughness^2 and cosines from 0.02; both in [0, 1], alpha = 0 a mirror.
Bsdf::LobeValues ggx_albedo(double cosine, double alpha);
/// Its cosine-weighted mean over the hemisphere.
Bsdf::LobeValues ggx_mean_albedo(double alpha);

}  // namespace haarlight
