// What a surface does to light at one point, seen from one direction.

#include "precompute/bsdf.h"

#include <algorithm>
#include <cmath>

#include "precompute/fresnel.h"
#include "precompute/ggx.h"
#include "precompute/incoming_term.h"
#include "precompute/measured_brdf.h"
#include "precompute/surface.h"

namespace haarlight {
namespace {

Vec3 reflect(const Vec3& n, const Vec3& o) { return 2 * dot(n, o) * n - o; }

Vec3 at_length(const Bsdf&, const Vec3& direction) { return normalize(direction); }
Vec3 at_length(const SingleDirections&, const Vec3& direction) { return direction; }

// By the smooth normal, or the true one where the smooth one would reflect into the surface.
template <typename Point>
Vec3 reflected(const Point& b) {
  const Vec3 smooth = reflect(b.normal, b.to_viewer);
  if (dot(smooth, b.geometric_normal) > 0) return at_length(b, smooth);
  return at_length(b, reflect(b.geometric_normal, b.to_viewer));
}

// Of length 1 but for rounding.
Vec3 refract(const Vec3& n, const Vec3& o, double eta, double cosine_beyond) {
  return (eta * dot(n, o) - cosine_beyond) * n - eta * o;
}

template <typename Point>
void add_delta(Point& b, const Bsdf::Delta& delta) {
  if (l1_norm(delta.weight) > 0) b.delta[static_cast<std::size_t>(b.delta_count++)] = delta;
}

RgbD one() { return {1, 1, 1}; }

void add_phong(Bsdf& b, const Material& material, const RgbD& albedo) {
  b.diffuse_reflectance = albedo;
  b.gloss_first = RgbD(material.specular);
  if (l1_norm(b.gloss_first) > 0) {
    b.lobe = Bsdf::Lobe::phong;
    b.width = static_cast<double>(material.exponent);
  }
}

void add_metallic_roughness(Bsdf& b, const Material& material, const SurfaceHit& hit,
                            const RgbD& base) {
  const double metallic = static_cast<double>(hit.metallic);
  const bool smooth = material.roughness < kMirrorRoughness;
  const double roughness = static_cast<double>(std::max(hit.roughness, kMirrorRoughness));
  const double alpha = smooth ? 0 : roughness * roughness;
  const double cosine = dot(b.normal, b.to_viewer);

  // F = F0 (1 - s) + s has a coat even at ior = 1; 0 would say that there is none.
  const double ior = static_cast<double>(material.ior);
  const double root = (ior - 1) / (ior + 1);
  b.coat_f0 = std::max(root * root, 1e-6);
  b.coat_pass = 1 - coat_mean_albedo(alpha, b.coat_f0);
  b.width = alpha;
  const RgbD below = base * (1 - metallic);
  const double transmission = static_cast<double>(material.transmission);
  b.diffuse_reflectance = below * (1 - transmission);

  // Both parts of the mix, dielectric and metal, each with its F0 (1 - s) + s and its compensation.
  const auto mix = [&](const auto& of_f0) {
    return of_f0(one() * b.coat_f0) * (1 - metallic) + of_f0(base) * metallic;
  };
  if (smooth) {
    const double s = schlick(cosine);
    add_delta(b, {reflected(b), mix([&](const RgbD& f0) { return f0 * (1 - s) + one() * s; })});
  } else {
    const Bsdf::LobeValues e = ggx_albedo(cosine, alpha);
    const double lost = (1 - e.first - e.second) / (e.first + e.second);
    b.lobe = Bsdf::Lobe::ggx;
    b.gloss_first = mix([&](const RgbD& f0) { return f0 * (one() + f0 * lost); });
    b.gloss_second = mix([&](const RgbD& f0) { return one() + f0 * lost; });
  }
  if (transmission > 0) {
    const double pass = 1 - coat_albedo(cosine, alpha, b.coat_f0);
    add_delta(b, {-b.to_viewer, below * (transmission * pass), true});
  }
}

template <typename Point>
void add_glass(Point& b, const Material& material, bool outside, const RgbD& tint) {
  const double ior = std::max(static_cast<double>(material.ior), 1.0);
  const double cosine = dot(b.normal, b.to_viewer);
  if (material.thin) {
    const double r = refraction(cosine, 1 / ior).reflectance;
    const double both = 2 * r / (1 + r);
    add_delta(b, {reflected(b), one() * both});
    add_delta(b, {-b.to_viewer, tint * (1 - both), true});
    return;
  }
  const double eta = outside ? 1 / ior : ior;
  const Refraction bent = refraction(cosine, eta);
  add_delta(b, {reflected(b), one() * bent.reflectance});
  if (bent.reflectance >= 1) return;
  Vec3 through = refract(b.normal, b.to_viewer, eta, bent.cosine_beyond);
  if (!(dot(through, b.geometric_normal) < 0)) {  // the smooth normal would turn it back
    const double true_cosine = dot(b.geometric_normal, b.to_viewer);
    const Refraction flat = refraction(true_cosine, eta);
    if (flat.reflectance >= 1) return;
    through = refract(b.geometric_normal, b.to_viewer, eta, flat.cosine_beyond);
  }
  add_delta(b, {at_length(b, through), tint * ((1 - bent.reflectance) * eta * eta), true, outside});
}

// (e + 2) / (2 pi) cos^e with cos = 1 - chord^2 / 2: exact where the power is steep.
double phong_power(const Vec3& mirror, const Vec3& w, double exponent) {
  const Vec3 chord = w - mirror;
  const double below = 0.5 * dot(chord, chord);
  return below < 1 ? std::exp(exponent * std::log1p(-below)) : 0;
}

}  // namespace

RgbD Bsdf::diffuse_out(const Vec3& o) const {
  if (coat_f0 == 0) return diffuse_reflectance;
  return diffuse_reflectance * (1 - coat_albedo(dot(normal, o), width, coat_f0));
}

double Bsdf::diffuse_in(const Vec3& w) const {
  if (term) return term->value(Frame(normal).to_local(w));
  const double cosine = dot(normal, w);
  if (!(cosine > 0)) return 0;
  if (coat_f0 == 0) return cosine / kPi;
  // Nothing gets below a coat that reflects all.
  if (!(coat_pass > 1e-9)) return 0;
  return cosine / kPi * (1 - coat_albedo(cosine, width, coat_f0)) / coat_pass;
}

Bsdf::LobeValues Bsdf::lobe_values(const Vec3& w, const Vec3& o) const {
  switch (lobe) {
    case Lobe::phong: {
      const double cosine = dot(normal, w);
      if (!(cosine > 0)) return {};
      return {(width + 2) / (2 * kPi) * phong_power(reflect(normal, o), w, width) * cosine, 0};
    }
    case Lobe::ggx: {
      double half_cosine = 0;
      const double value = ggx_times_cosine(normal, w, o, width, half_cosine);
      const double s = schlick(half_cosine);
      return {value * (1 - s), value * s};
    }
    case Lobe::none:
      break;
  }
  return {};
}

std::optional<Bsdf::Sample> Bsdf::sample_lobe(double u, double v) const {
  std::optional<Vec3> direction;
  if (lobe == Lobe::phong) {
    // 1 - cos alpha by expm1, so that sharp lobes keep their shape.
    const double below = -std::expm1(std::log1p(-v) / (width + 1));
    const double across = std::sqrt(below * (2 - below));
    const Frame frame(normalize(reflect(normal, to_viewer)));
    const Vec3 w =
        frame.to_world({across * std::cos(2 * kPi * u), across * std::sin(2 * kPi * u), 1 - below});
    if (dot(normal, w) > 0) direction = normalize(w);
  } else if (lobe == Lobe::ggx) {
    direction = ggx_sample(normal, to_viewer, width, u, v);
  }
  if (!direction) return std::nullopt;
  const double pdf = lobe_pdf(*direction);
  if (!(pdf > 0)) return std::nullopt;
  return Sample{*direction, pdf};
}

double Bsdf::lobe_pdf(const Vec3& w) const {
  switch (lobe) {
    case Lobe::phong:
      if (!(dot(normal, w) > 0)) return 0;
      return (width + 1) / (2 * kPi) * phong_power(reflect(normal, to_viewer), w, width);
    case Lobe::ggx:
      return ggx_pdf(normal, w, to_viewer, width);
    case Lobe::none:
      break;
  }
  return 0;
}

RgbD Bsdf::diffuse_albedo() const { return diffuse_out(to_viewer); }

RgbD Bsdf::lobe_albedo() const {
  if (lobe == Lobe::none) return {};
  if (lobe == Lobe::phong) return gloss_first;
  const LobeValues e = ggx_albedo(dot(normal, to_viewer), width);
  return gloss_first * e.first + gloss_second * e.second;
}

double Bsdf::lobe_half_width() const {
  switch (lobe) {
    case Lobe::phong:  // half of the power cosine lies below cos^(e + 1) = 1 / 2
      return std::acos(std::exp2(-1 / (width + 1)));
    case Lobe::ggx:
      // Half of the normals are within tan = alpha; light turns twice as far in the plane of the
      // view, and o.h times that across it. Seen at grazing, o.h is about alpha.
      return 2 * std::atan(width) * std::max(dot(normal, to_viewer), width);
    case Lobe::none:
      break;
  }
  return kPi;
}

bool has_single_directions(const Material& material) {
  switch (material.model) {
    case SurfaceModel::phong:
    case SurfaceModel::measured:
      return false;
    case SurfaceModel::metallic_roughness:
      return material.transmission > 0 || material.roughness < kMirrorRoughness;
    case SurfaceModel::mirror:
    case SurfaceModel::glass:
      break;
  }
  return true;
}

bool may_have_narrow_lobe(const Material& material) {
  if (has_single_directions(material)) return false;
  switch (material.model) {
    case SurfaceModel::phong:
      return l1_norm(RgbD(material.specular)) > 0 && material.exponent > 80;
    case SurfaceModel::metallic_roughness:
      return material.roughness < 0.5f || material.metallic_roughness_texture >= 0;
    case SurfaceModel::measured:
    case SurfaceModel::mirror:
    case SurfaceModel::glass:
      break;
  }
  return false;
}

Bsdf bsdf_at(const Scene& scene, const SurfaceHit& hit) {
  const Material& material = scene.material[hit.material];
  Bsdf b;
  b.geometric_normal = hit.geometric_normal;
  b.normal = hit.normal;
  b.to_viewer = hit.to_viewer;
  const RgbD albedo(hit.albedo);
  switch (material.model) {
    case SurfaceModel::phong:
      add_phong(b, material, albedo);
      break;
    case SurfaceModel::metallic_roughness:
      add_metallic_roughness(b, material, hit, albedo);
      break;
    case SurfaceModel::mirror:
      add_delta(b, {reflected(b), albedo});
      break;
    case SurfaceModel::glass:
      add_glass(b, material, hit.outside, albedo);
      break;
    case SurfaceModel::measured:
      b.diffuse_reflectance = albedo;
      if (material.measured)
        b.diffuse_reflectance = b.diffuse_reflectance * material.measured->albedo;
      break;
  }
  return b;
}

SingleDirections::SingleDirections(const Material& material, const SurfaceHit& hit)
    : geometric_normal(hit.geometric_normal), normal(hit.normal), to_viewer(hit.to_viewer) {
  const RgbD albedo(hit.albedo);
  if (material.model == SurfaceModel::mirror) {
    add_delta(*this, {reflected(*this), albedo});
  } else {
    add_glass(*this, material, hit.outside, albedo);
  }
}

Vec3 cosine_direction(const Vec3& normal, double u, double v) {
  const double radius = std::sqrt(v);
  return Frame(normal).to_world(
      {radius * std::cos(2 * kPi * u), radius * std::sin(2 * kPi * u), std::sqrt(1 - v)});
}

}  // namespace haarlight
