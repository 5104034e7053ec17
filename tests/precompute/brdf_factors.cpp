// In-out factorisation: sums of products against the BRDFs themselves.

#include "precompute/brdf_factors.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "data_gen/merl.h"
#include "precompute/bsdf.h"
#include "precompute/isotropic_brdf.h"
#include "precompute/material_import.h"
#include "precompute/measured_brdf.h"
#include "precompute/random.h"
#include "precompute/surface.h"
#include "tests/core/temporary_folder.h"

namespace haarlight {
namespace {

constexpr int kResolution = 256;

Material lambert(const Rgb& albedo) {
  Material m;
  m.albedo = albedo;
  return m;
}

Material phong(float exponent, const Rgb& diffuse = {}, const Rgb& specular = {0.5f, 0.6f, 0.7f}) {
  Material m;
  m.albedo = diffuse;
  m.specular = specular;
  m.exponent = exponent;
  return m;
}

Material ggx(float roughness, float metallic, const Rgb& base = {0.9f, 0.6f, 0.2f}) {
  Material m;
  m.model = SurfaceModel::metallic_roughness;
  m.albedo = base;
  m.roughness = roughness;
  m.metallic = metallic;
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

double circle(const BrdfTerm& term, const Vec3& d) {
  const double phi = std::atan2(d.y, d.x);
  return term.order >= 0 ? std::cos(term.order * phi) : std::sin(-term.order * phi);
}

double t_of(const Vec3& d) { return std::sqrt(std::max(0.0, 1 - d.z)); }

double incoming(const BrdfTerm& term, const Vec3& w) {
  return profile_at(term.incoming, t_of(w)) * circle(term, w);
}

RgbD outgoing(const BrdfTerm& term, const Vec3& o) {
  const double at = std::min(t_of(o), 1.0) * (kResolution - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), std::size_t{kResolution - 2});
  const double share = at - static_cast<double>(i);
  return (term.outgoing[i] * (1 - share) + term.outgoing[i + 1] * share) * circle(term, o);
}

RgbD product(const BrdfFactors& factors, const Vec3& w, const Vec3& o) {
  RgbD sum;
  for (const BrdfTerm& term : factors.term) sum += incoming(term, w) * outgoing(term, o);
  return sum;
}

// Even over the hemisphere in solid angle, and in projected solid angle.
Vec3 even_direction(double u, double v) {
  const double sine = std::sqrt(std::max(0.0, 1 - v * v));
  return {sine * std::cos(2 * kPi * u), sine * std::sin(2 * kPi * u), v};
}

double square(const RgbD& c) { return c.r * c.r + c.g * c.g + c.b * c.b; }

// The error that the factors state, by points of their own: even w, o by projected solid angle.
double sampled_error(const Material& material, const BrdfFactors& factors, int points) {
  constexpr double kShift[4] = {0.1, 0.2, 0.3, 0.4};
  Scene scene;
  scene.material.push_back(material);
  double off = 0, all = 0;
  for (int i = 0; i < points; ++i) {
    const EvenPoint p = even_point(static_cast<std::uint64_t>(i), kShift);
    const Vec3 w = even_direction(p.value[0], p.value[1]);
    const Vec3 o = even_direction(p.value[2], std::sqrt(p.value[3]));
    const RgbD f = brdf_cos(scene, w, o);
    off += square(f - product(factors, w, o));
    all += square(f);
  }
  return std::sqrt(off / all);
}

TEST(BrdfFactors, LambertIsOneTermThatLooksAlikeFromEverywhere) {
  const BrdfSpectrum spectrum(lambert({0.3f, 0.5f, 0.7f}), false);
  EXPECT_EQ(spectrum.most_terms(), 1);
  EXPECT_LE(spectrum.error(1), 1e-7);  // the root of a few roundings
  const BrdfFactors factors = spectrum.take(8, kResolution);
  ASSERT_EQ(factors.term.size(), 1u);
  EXPECT_TRUE(factors.diffuse_apart);  // the colour is the row's
  EXPECT_EQ(factors.term[0].order, 0);
  for (std::size_t i = 0; i < kResolution; ++i) {
    const double t = static_cast<double>(i) / (kResolution - 1);
    EXPECT_EQ(factors.term[0].outgoing[i], (RgbD{1, 1, 1}));
    EXPECT_NEAR(factors.term[0].incoming[i], (1 - t * t) / kPi, 1e-15);
  }
  EXPECT_EQ(brdf_terms(lambert({0.3f, 0.5f, 0.7f}), 1e-3), 1);
  EXPECT_EQ(brdf_terms(lambert({0, 0, 0}), 1e-3), 1);
}

TEST(BrdfFactors, ErrorsAreWhatSamplesOfTheProductSay) {
  struct Case {
    Material material;
    std::vector<int> terms;
    const char* name;
    int points = 20000;
  };
  for (const Case& c :
       {Case{phong(2), {1, 3, 9}, "phong 2", 20000}, Case{phong(12), {1, 4, 25}, "phong 12", 20000},
        Case{phong(60, {0.3f, 0.2f, 0.1f}, {0.2f, 0.2f, 0.2f}),
             {4, 16, 64},
             "diffuse, phong 60",
             20000},
        Case{ggx(0.8f, 1), {1, 4, 16}, "rough metal", 20000},
        Case{ggx(0.5f, 0), {1, 4, 16}, "coated diffuse", 300000}}) {
    for (const bool apart : {false, true}) {
      const BrdfSpectrum spectrum(c.material, apart);
      double last = 1;
      for (const int terms : c.terms) {
        const BrdfFactors factors = spectrum.take(terms, kResolution);
        EXPECT_LE(factors.term.size(), static_cast<std::size_t>(terms));
        EXPECT_EQ(factors.diffuse_apart, apart);
        if (apart) continue;  // its colour is not in the factors
        const double stated = factors.error, seen = sampled_error(c.material, factors, c.points);
        // 20,000 even points of a smooth integrand in four dimensions: about 1 %, and as good for
        // 300,000 of one with the coat's peaks near the horizon; where little is left, the
        // profiles' 256 samples show at 2e-3.
        EXPECT_NEAR(seen, stated, 0.02 * stated + 2e-3) << c.name << ", " << terms << " terms";
        EXPECT_LE(stated, last) << c.name;
        last = stated;
      }
    }
  }
}

// Pairs are whole: the sum does not know in which frame it was made.
TEST(BrdfFactors, SumsAreIsotropicWhateverTheNumberOfTerms) {
  const BrdfSpectrum spectrum(phong(20, {0.2f, 0.2f, 0.2f}), false);
  for (int terms = 1; terms <= 12; ++terms) {
    const BrdfFactors factors = spectrum.take(terms, kResolution);
    int sum = 0;
    for (const BrdfTerm& term : factors.term) sum += term.order;
    EXPECT_EQ(sum, 0) << terms;
    constexpr double kShift[4] = {};
    for (int i = 1; i < 50; ++i) {
      const EvenPoint p = even_point(static_cast<std::uint64_t>(i), kShift);
      const Vec3 w = even_direction(p.value[0], p.value[1]),
                 o = even_direction(p.value[2], p.value[3]);
      const double angle = 0.37 * i;
      const auto turned = [&](const Vec3& d) {
        return Vec3{d.x * std::cos(angle) - d.y * std::sin(angle),
                    d.x * std::sin(angle) + d.y * std::cos(angle), d.z};
      };
      const RgbD a = product(factors, w, o), b = product(factors, turned(w), turned(o));
      EXPECT_LE(l1_norm(a - b), 1e-12);
    }
  }
}

// g is of mean square 1, f carries the weight: errors of rows are errors of the picture.
TEST(BrdfFactors, OutgoingFactorsAreOrthonormalOverTheHemisphere) {
  const BrdfFactors factors = BrdfSpectrum(ggx(0.6f, 1), false).take(9, kResolution);
  ASSERT_GE(factors.term.size(), 8u);
  constexpr double kShift[4] = {};
  constexpr int kPoints = 20000;
  for (std::size_t a = 0; a < factors.term.size(); ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      double sum = 0;
      for (int i = 0; i < kPoints; i += 4) {
        const EvenPoint p = even_point(static_cast<std::uint64_t>(i), kShift);
        const Vec3 o = even_direction(p.value[2], std::sqrt(p.value[3]));
        const RgbD x = outgoing(factors.term[a], o), y = outgoing(factors.term[b], o);
        sum += (x.r * y.r + x.g * y.g + x.b * y.b) / 3;
      }
      // 5,000 even points in two dimensions.
      EXPECT_NEAR(4 * sum / kPoints, a == b ? 1 : 0, 0.02) << a << " " << b;
    }
  }
}

// HARD_CASES 20: what is left of a matrix of rank one is rounding, and no term is made of it.
TEST(BrdfFactors, RoundingIsNoTerm) {
  Material coated = ggx(1, 0, {0.8f, 0.8f, 0.8f});
  for (const bool apart : {false, true}) {
    const BrdfSpectrum spectrum(coated, apart);
    const BrdfFactors all = spectrum.take(spectrum.most_terms(), kResolution);
    for (const BrdfTerm& term : all.term) {
      for (const double f : term.incoming) ASSERT_TRUE(std::isfinite(f));
      for (const RgbD& g : term.outgoing) ASSERT_TRUE(is_finite(g));
    }
  }
  // A lobe that is black is none.
  EXPECT_EQ(BrdfSpectrum(phong(10, {0.5f, 0.5f, 0.5f}, {0, 0, 0}), false).most_terms(), 1);
  EXPECT_EQ(BrdfSpectrum(phong(10, {0, 0, 0}, {0, 0, 0}), false).most_terms(), 0);
}

// HARD_CASES 23, 24: no terms make energy, and grazing directions are finite.
TEST(BrdfFactors, AlbedoStaysBelowOneAndGrazingIsFinite) {
  for (const Material& m : {phong(1e4f, {}, {1, 1, 1}), phong(8, {}, {1, 1, 1}),
                            ggx(0.4f, 1, {1, 1, 1}), ggx(0.5f, 0, {1, 1, 1})}) {
    const BrdfSpectrum spectrum(m, false);
    const BrdfFactors factors = spectrum.take(kMostBrdfTerms, kResolution);
    for (const double cosine : {1.0, 0.9, 0.6, 0.3, 0.1, 0x1p-24, 0.0}) {
      const Vec3 o = even_direction(0.1, cosine);
      // Terms of other orders integrate to 0 over the circle.
      double albedo = 0;
      constexpr int kSteps = 1000;
      for (const BrdfTerm& term : factors.term) {
        if (term.order != 0) continue;
        double in = 0;
        for (int i = 0; i < kSteps; ++i) {
          const double t = (i + 0.5) / kSteps;
          in += 2 * kPi * profile_at(term.incoming, t) * 2 * t / kSteps;
        }
        albedo += in * outgoing(term, o).g;
      }
      ASSERT_TRUE(std::isfinite(albedo));
      // Few terms ring about the exact albedo, by what an order-10 expansion cannot follow near
      // the horizon, which the projected solid angle does not see; elsewhere 1 %.
      if (cosine >= 0.3) {
        EXPECT_LT(albedo, 1.01) << m.exponent << " " << m.roughness << " " << cosine;
      }
      for (const BrdfTerm& term : factors.term) {
        EXPECT_TRUE(is_finite(outgoing(term, o)));
        EXPECT_TRUE(std::isfinite(incoming(term, o)));
      }
      EXPECT_EQ(incoming(factors.term[0], even_direction(0.1, 0)), 0);
    }
  }
}

TEST(BrdfFactors, SameBitsOnAnyNumberOfThreads) {
  const int before = thread_count();
  std::vector<BrdfFactors> made;
  for (const int threads : {1, 7}) {
    set_thread_count(threads);
    made.push_back(BrdfSpectrum(ggx(0.5f, 1), false).take(16, kResolution));
  }
  set_thread_count(before);
  ASSERT_EQ(made[0].term.size(), made[1].term.size());
  for (std::size_t k = 0; k < made[0].term.size(); ++k) {
    EXPECT_EQ(made[0].term[k].incoming, made[1].term[k].incoming);
    EXPECT_EQ(made[0].term[k].outgoing, made[1].term[k].outgoing);
  }
}

TEST(BrdfFactors, NumberOfTermsFollowsTheErrorWanted) {
  const BrdfSpectrum spectrum(phong(8, {}, {1, 1, 1}), false);
  for (const double wanted : {0.5, 0.2, 0.05}) {
    const int terms = spectrum.terms_for(wanted, kMostBrdfTerms);
    EXPECT_LE(spectrum.error(terms), wanted);
    EXPECT_GT(spectrum.error(terms - 1), wanted);
    EXPECT_EQ(brdf_terms(phong(8, {}, {1, 1, 1}), wanted), terms);
  }
  EXPECT_EQ(brdf_terms(phong(1000, {}, {1, 1, 1}), 0.01), kMostBrdfTerms + 1);
  Material mirror;
  mirror.model = SurfaceModel::mirror;
  EXPECT_EQ(brdf_terms(mirror, 0.1), 0);
}

Material measured(const MeasuredBrdf& brdf) {
  Material m;
  m.model = SurfaceModel::measured;
  m.albedo = {1, 1, 1};
  m.measured = std::make_shared<const MeasuredBrdf>(brdf);
  return m;
}

TEST(MeasuredBrdf, MaterialsKeepNormalsAndHolesAndNotTheirColour) {
  const TemporaryFolder folder;
  data_gen::write_merl(folder.path() / "a.binary", {}, {4, 3, 2});
  Scene scene;
  scene.texture.push_back(Image(2, 1));
  scene.texture[0].pixels = {{0.2f, 0.3f, 0.4f}, {0.5f, 0.6f, 0.7f}};
  scene.texture.push_back(Image(1, 1));
  scene.alpha = {{0.25f, 0.75f}};  // of the first; the other has none
  Material leaf;
  leaf.name = "leaf";
  leaf.texture = 0;
  leaf.map.second = true;
  leaf.alpha_cutoff = 0.5f;
  leaf.normal_texture = 1;
  leaf.normal_scale = 0.7f;
  Material wall = leaf;
  wall.alpha_cutoff = 0;
  scene.material = {leaf, wall};
  for (std::size_t m = 0; m < 2; ++m) {
    set_measured(scene, m, folder.path() / "a.binary");
    EXPECT_EQ(scene.material[m].model, SurfaceModel::measured);
    EXPECT_EQ(scene.material[m].name, "leaf");
    EXPECT_EQ(scene.material[m].normal_texture, 1);
    EXPECT_EQ(scene.material[m].normal_scale, 0.7f);
  }
  const Material& cut = scene.material[0];
  EXPECT_EQ(cut.alpha_cutoff, 0.5f);
  ASSERT_EQ(cut.texture, 2);
  EXPECT_TRUE(cut.map.second);
  EXPECT_EQ(scene.texture[2].pixels, (std::vector<Rgb>{{1, 1, 1}, {1, 1, 1}}));
  ASSERT_EQ(scene.alpha.size(), 3u);
  EXPECT_EQ(scene.alpha[2], scene.alpha[0]);
  EXPECT_EQ(scene.material[1].texture, -1);
  EXPECT_EQ(scene.report.measured_textures, 2);
}

TEST(MeasuredBrdf, TablesAreReadAsTheyWereMade) {
  const TemporaryFolder folder;
  const data_gen::Lacquer lacquer;
  data_gen::write_merl(folder.path() / "a.binary", lacquer);
  const MeasuredBrdf brdf = read_merl(folder.path() / "a.binary");
  EXPECT_EQ(brdf.half_cells, 90);
  EXPECT_EQ(brdf.azimuth_cells, 180);
  EXPECT_GT(brdf.negative, 0u);
  double most = 0;
  for (const double half : {0.01, 0.05, 0.2, 0.5}) {
    for (const double difference : {0.1, 0.4, 0.9}) {
      const RgbD wanted = lacquer.at(half, difference), found = brdf.at(half, difference, 1.0);
      most = std::max(most, l1_norm(wanted - found) / l1_norm(wanted));
    }
  }
  // Linear over cells of at most 1.5 degrees (0.026 rad) at theta_h = 0.5: cos^60 there has second
  // derivative below 60^2 of its value, times 0.026^2 / 8: 0.3; of the little that it is beside
  // the diffuse part. Measured: 0.004.
  EXPECT_LT(most, 0.01);
  // Symmetric: seen from light's side, turned either way.
  for (const double phi : {0.3, 1.5, 2.9}) {
    const RgbD a = brdf.between(0.7, 0.4, phi), b = brdf.between(0.4, 0.7, phi),
               c = brdf.between(0.7, 0.4, -phi);
    EXPECT_LE(l1_norm(a - b), 1e-6 * l1_norm(a));
    EXPECT_LE(l1_norm(a - c), 1e-6 * l1_norm(a));
  }
  // The half vector and the difference of two directions, by hand: light along the normal, view 60
  // degrees off: theta_h = theta_d = 30 degrees.
  const RgbD found = brdf.between(1, 0.5, 0.8), wanted = lacquer.at(kPi / 6, kPi / 6);
  EXPECT_LE(l1_norm(found - wanted), 0.02 * l1_norm(wanted));
  EXPECT_EQ(brdf.between(0, 0.5, 1), RgbD{});
  EXPECT_EQ(brdf.between(0.5, -0.1, 1), RgbD{});
}

TEST(MeasuredBrdf, FactorsAreThoseOfTheFunctionInTheTable) {
  const TemporaryFolder folder;
  const data_gen::Lacquer lacquer;
  data_gen::write_merl(folder.path() / "a.binary", lacquer, {60, 45, 60});
  const BrdfFactors factors =
      BrdfSpectrum(measured(read_merl(folder.path() / "a.binary")), false).take(16, kResolution);
  constexpr double kShift[4] = {0.1, 0.2, 0.3, 0.4};
  double off = 0, all = 0;
  for (int i = 0; i < 30000; ++i) {
    const EvenPoint p = even_point(static_cast<std::uint64_t>(i), kShift);
    const Vec3 w = even_direction(p.value[0], p.value[1]);
    const Vec3 o = even_direction(p.value[2], std::sqrt(p.value[3]));
    const Vec3 h = normalize(w + o);
    const RgbD f =
        lacquer.at(std::acos(std::min(h.z, 1.0)), std::acos(std::min(dot(w, h), 1.0))) * w.z;
    off += square(f - product(factors, w, o));
    all += square(f);
  }
  // The table is off by its cells, most at the horizon, where cells are half unmeasured.
  EXPECT_NEAR(std::sqrt(off / all), factors.error, 0.1 * factors.error + 0.02);
  EXPECT_LT(factors.error, 0.7);
}

TEST(MeasuredBrdf, FilesOfAnotherSizeAreRefused) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "a.binary";
  data_gen::write_merl(file, {}, {4, 3, 2});
  EXPECT_NO_THROW(read_merl(file));
  std::ifstream in(file, std::ios::binary);
  const std::string right{std::istreambuf_iterator<char>(in), {}};
  const auto refusal = [&](const std::string& bytes) -> std::string {
    std::ofstream(folder.path() / "b.binary", std::ios::binary) << bytes;
    try {
      read_merl(folder.path() / "b.binary");
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::format);
      return error.what();
    }
    return "";
  };
  for (std::size_t size = 0; size < right.size(); size += 3) {
    EXPECT_NE(refusal(right.substr(0, size)), "") << size;
  }
  EXPECT_NE(refusal(right + "x").find("do not fit 4 x 3 x 2 cells"), std::string::npos);
  std::string huge = right;
  huge[3] = 127;
  EXPECT_NE(refusal(huge), "");
  huge[3] = -1;
  EXPECT_NE(refusal(huge), "");
  EXPECT_THROW(read_merl(folder.path() / "none.binary"), Error);
  EXPECT_THROW(read_merl(folder.path()), Error);
}

}  // namespace
}  // namespace haarlight
