// The BRDF of a material as a function of three angles.

#include "precompute/isotropic_brdf.h"

#include <algorithm>
#include <cmath>

#include "precompute/measured_brdf.h"
#include "precompute/surface.h"

namespace haarlight {
namespace {

// cos^e falls to the half of a lobe's power at the least half width; half of GGX's normals lie
// within tan = alpha of the normal, light turns twice as far.
const double kMostExponent = -1 / std::log2(std::cos(kLeastHalfWidth)) - 1;
const double kLeastAlpha = std::tan(0.5 * kLeastHalfWidth);

Vec3 direction(double cosine, double phi) {
  const double c = std::clamp(cosine, 0.0, 1.0), sine = std::sqrt(1 - c * c);
  return {sine * std::cos(phi), sine * std::sin(phi), c};
}

// The material without textures and single directions.
Material plain(Material m) {
  m.texture = m.metallic_roughness_texture = m.normal_texture = -1;
  switch (m.model) {
    case SurfaceModel::mirror:
      m.model = SurfaceModel::phong;
      m.specular = m.albedo;
      m.albedo = {};
      m.exponent = static_cast<float>(kMostExponent);
      break;
    case SurfaceModel::phong:
      m.exponent = std::min(m.exponent, static_cast<float>(kMostExponent));
      break;
    case SurfaceModel::metallic_roughness:
      m.roughness = std::max(m.roughness, static_cast<float>(std::sqrt(kLeastAlpha)));
      break;
    case SurfaceModel::glass:
      m.model = SurfaceModel::phong;
      m.albedo = m.specular = {};
      break;
    case SurfaceModel::measured:
      break;
  }
  return m;
}

Bsdf seen_from(const Scene& scene, double cosine_o) {
  const Material& m = scene.material.front();
  SurfaceHit hit;
  hit.geometric_normal = hit.normal = {0, 0, 1};
  hit.to_viewer = direction(cosine_o, 0);
  hit.albedo = m.albedo;
  hit.metallic = m.metallic;
  hit.roughness = m.roughness;
  return bsdf_at(scene, hit);
}

}  // namespace

IsotropicBrdf::IsotropicBrdf(const Material& material) {
  scene_.material.push_back(plain(material));
  if (const MeasuredBrdf* table = scene_.material.front().measured.get()) {
    scalars_ = 3;
    half_width_ = std::max(table->half_width, kLeastHalfWidth);
    return;
  }
  const Bsdf b = seen_from(scene_, 1);
  reflectance_ = b.diffuse_reflectance;
  if (b.has_lobe()) {
    scalars_ = b.lobe == Bsdf::Lobe::phong ? 1 : 2;
    half_width_ = b.lobe_half_width();
  }
}

bool IsotropicBrdf::has_diffuse() const { return l1_norm(reflectance_) > 0; }

double IsotropicBrdf::diffuse_in(double cosine_i) const {
  return has_diffuse() ? seen_from(scene_, 1).diffuse_in(direction(cosine_i, 0)) : 0;
}

double IsotropicBrdf::diffuse_out(double cosine_o) const {
  if (!has_diffuse()) return 0;
  const Bsdf b = seen_from(scene_, cosine_o);
  if (b.coat_f0 == 0) return 1;
  return luminance(b.diffuse_out(b.to_viewer)) / luminance(b.diffuse_reflectance);
}

IsotropicBrdf::View IsotropicBrdf::view(double cosine_o) const {
  View v;
  v.cosine = cosine_o;
  if (scene_.material.front().measured) {
    v.color = {RgbD{1, 0, 0}, RgbD{0, 1, 0}, RgbD{0, 0, 1}};
    return v;
  }
  v.bsdf = seen_from(scene_, cosine_o);
  v.color = {v.bsdf.gloss_first, v.bsdf.gloss_second, RgbD{}};
  return v;
}

std::array<double, 3> IsotropicBrdf::lobe(const View& view, double cosine_i, double phi) const {
  if (const MeasuredBrdf* table = scene_.material.front().measured.get()) {
    const RgbD f = table->between(cosine_i, view.cosine, phi) * cosine_i;
    return {f.r, f.g, f.b};
  }
  const Bsdf::LobeValues v = view.bsdf.lobe_values(direction(cosine_i, phi));
  return {v.first, v.second, 0};
}

}  // namespace haarlight
