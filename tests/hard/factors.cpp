// Rows 20 and 21: BRDFs of low rank, and singular values far below the largest.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "precompute/brdf_factors.h"
#include "precompute/bsdf.h"
#include "precompute/random.h"
#include "precompute/surface.h"
#include "tests/hard/hard_case.h"

namespace haarlight {
namespace {

using namespace hard;

constexpr int kResolution = 4096;
constexpr double u = 0x1p-24;

Material phong(float exponent, const Rgb& diffuse, const Rgb& specular) {
  Material m;
  m.albedo = diffuse;
  m.specular = specular;
  m.exponent = exponent;
  return m;
}

// f_r cos by way of the point's BSDF, in coordinates whose z is the normal.
RgbD brdf_cos(const Scene& scene, const Vec3& w, const Vec3& o) {
  const Material& material = scene.material.front();
  SurfaceHit hit;
  hit.geometric_normal = hit.normal = {0, 0, 1};
  hit.to_viewer = o;
  hit.albedo = material.albedo;
  hit.metallic = material.metallic, hit.roughness = material.roughness;
  const Bsdf b = bsdf_at(scene, hit);
  RgbD f = b.diffuse_out(o) * b.diffuse_in(w);
  if (b.has_lobe()) {
    const Bsdf::LobeValues v = b.lobe_values(w);
    f += v.first * b.gloss_first + v.second * b.gloss_second;
  }
  return f;
}

// `color` is that of a diffuse part that is apart, whose term is without it.
RgbD product(const BrdfFactors& factors, const RgbD& color, const Vec3& w, const Vec3& o) {
  RgbD sum;
  const auto t_of = [](const Vec3& d) { return std::sqrt(std::max(0.0, 1 - d.z)); };
  for (const BrdfTerm& term : factors.term) {
    const auto circle = [&](const Vec3& d) {
      const double phi = std::atan2(d.y, d.x);
      return term.order >= 0 ? std::cos(term.order * phi) : std::sin(-term.order * phi);
    };
    const double at = std::min(t_of(o), 1.0) * (kResolution - 1);
    const std::size_t i = std::min(static_cast<std::size_t>(at), std::size_t{kResolution - 2});
    const double share = at - static_cast<double>(i);
    const RgbD out = term.outgoing[i] * (1 - share) + term.outgoing[i + 1] * share;
    sum += profile_at(term.incoming, t_of(w)) * circle(w) * circle(o) * out;
  }
  return sum * color;
}

// Even over the hemisphere.
Vec3 even_direction(double a, double z) {
  const double sine = std::sqrt(std::max(0.0, 1 - z * z));
  return {sine * std::cos(2 * kPi * a), sine * std::sin(2 * kPi * a), z};
}

struct Errors {
  double largest = 0;   // of the product, over the largest BRDF value met
  double relative = 0;  // L2: solid angle of w times projected solid angle of o
  double bad = 0;       // values that are not finite
};

Errors errors_of(const Material& material, const BrdfFactors& factors, int points) {
  const RgbD color = factors.diffuse_apart ? RgbD(material.albedo) : RgbD{1, 1, 1};
  constexpr double kShift[4] = {0.1, 0.2, 0.3, 0.4};
  Scene scene;
  scene.material.push_back(material);
  Errors e;
  double off = 0, all = 0, largest = 0, most = 0;
  for (int i = 0; i < points; ++i) {
    const EvenPoint p = even_point(static_cast<std::uint64_t>(i), kShift);
    const Vec3 w = even_direction(p.value[0], p.value[1]);
    const Vec3 o = even_direction(p.value[2], std::sqrt(p.value[3]));
    const RgbD right = brdf_cos(scene, w, o), difference = product(factors, color, w, o) - right;
    e.bad += !is_finite(difference);
    off += dot(Vec3{difference.r, difference.g, difference.b},
               Vec3{difference.r, difference.g, difference.b});
    all += dot(Vec3{right.r, right.g, right.b}, Vec3{right.r, right.g, right.b});
    most = std::max({most, std::abs(difference.r), std::abs(difference.g), std::abs(difference.b)});
    largest = std::max({largest, right.r, right.g, right.b});
  }
  e.largest = largest > 0 ? most / largest : most;
  e.relative = all > 0 ? std::sqrt(off / all) : 0;
  return e;
}

TEST(HardCases, Row20_RankDeficientBrdf) {
  property(
      "BRDFs of rank 1 and 0: the terms' product is the BRDF within 10 max(m, n) u; all finite");
  // At least 64 samples an angle, 10 x 64 u = 3.8e-5; profiles of 4096 samples add 1e-7. More terms
  // are asked for than there are: what is rounding must not become a term.
  double worst = 0, bad = 0, ranks = 0;
  const Material black = phong(10, {}, {}), grey = phong(10, {0.5f, 0.5f, 0.5f}, {});
  const Material red = phong(10, {0.8f, 0, 0}, {});
  for (const Material& material : {black, grey, red}) {
    for (const bool apart : {false, true}) {
      const BrdfSpectrum spectrum(material, apart);
      const BrdfFactors factors = spectrum.take(20, kResolution);
      ranks += factors.term.size() > 1;
      bad += !std::isfinite(spectrum.error(1)) || !std::isfinite(factors.error);
      const Errors e = errors_of(material, factors, 20000);
      worst = std::max(worst, e.largest), bad += e.bad;
    }
  }
  // Rank 1 beside a lobe that is all but nothing.
  const Material faint = phong(4, {0.5f, 0.5f, 0.5f}, {1e-12f, 1e-12f, 1e-12f});
  const BrdfSpectrum spectrum(faint, false);
  const Errors e = errors_of(faint, spectrum.take(20, kResolution), 20000);
  worst = std::max(worst, e.largest), bad += e.bad;
  at_most("product: error of the largest value", worst, 10 * 64 * u);
  at_most("ranks above 1", ranks, 0);
  at_most("values that are not finite", bad, 0);
}

TEST(HardCases, Row21_SmallSingularValues) {
  property(
      "singular values below sqrt(u) s1 = 2.4e-4 s1 are right: what K terms leave is as stated");
  // A covariance in float loses what is below 2.4e-4 of the largest; from singular values in double
  // the tail is right to 10 n u = 4e-5 of it. Sampled with 20,000 even points: within 10 %.
  double met = 0, off = 0, rises = 0;
  for (const float exponent : {3.0f, 6.0f}) {
    const Material material = phong(exponent, {}, {0.5f, 0.5f, 0.5f});
    const BrdfSpectrum spectrum(material, false);
    for (int k = 1; k < spectrum.most_terms() && k < 60; ++k) {
      rises += spectrum.error(k + 1) > spectrum.error(k) * (1 + 1e-9);
      const double stated = spectrum.error(k);
      if (!(stated < 2.4e-4 && stated > 1e-5)) continue;
      const Errors e = errors_of(material, spectrum.take(k, kResolution), 20000);
      ++met;
      off = std::max(off, std::abs(e.relative / stated - 1));
    }
  }
  at_least("numbers of terms that leave 1e-5 to 2.4e-4", met, 2);
  at_most("stated error against sampled", off, 0.1);
  at_most("terms that make it worse", rises, 0);
}

}  // namespace
}  // namespace haarlight
