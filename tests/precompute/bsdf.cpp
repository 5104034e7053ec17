// BSDFs: energy, reciprocity, sampling against density, Fresnel and Snell, grazing directions.

#include "precompute/bsdf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "precompute/fresnel.h"
#include "precompute/ggx.h"
#include "precompute/surface.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

const Vec3 kUp{0, 0, 1};

Vec3 at_cosine(double cosine, double azimuth = 0) {
  const double sine = std::sqrt(1 - cosine * cosine);
  return {sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
}

Bsdf bsdf(const Material& material, const Vec3& to_viewer, bool outside = true) {
  Scene scene;
  scene.material = {material};
  SurfaceHit hit;
  hit.geometric_normal = hit.normal = kUp;
  hit.to_viewer = to_viewer;
  hit.albedo = material.albedo;
  hit.metallic = material.metallic, hit.roughness = material.roughness;
  hit.outside = outside;
  return bsdf_at(scene, hit);
}

Material gltf(float base, float metallic, float roughness) {
  Material m;
  m.model = SurfaceModel::metallic_roughness;
  m.albedo = {base, base, base};
  m.metallic = metallic, m.roughness = roughness;
  return m;
}

// Integral of `f` over the hemisphere about +Z, midpoint rule: fine about `axis`, where a lobe is.
// Directions are z = cos theta about the axis, warped so that half of the steps lie within `width`
// radians; those below the horizon count as 0.
double integral(const Vec3& axis, double width, const std::function<double(const Vec3&)>& f,
                int steps = 400, int turns = 400) {
  const Frame frame(axis);
  double sum = 0;
  // theta = width t / (1 - t) reaches pi at t_end.
  const double end = kPi / (kPi + width);
  for (int i = 0; i < steps; ++i) {
    const double t = end * (i + 0.5) / steps;
    const double theta = width * t / (1 - t);
    const double measure = width / ((1 - t) * (1 - t)) * end / steps * std::sin(theta);
    for (int j = 0; j < turns; ++j) {
      const double phi = 2 * kPi * (j + 0.5) / turns;
      const Vec3 w = frame.to_world(
          {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)});
      if (w.z > 0) sum += measure * f(w);
    }
  }
  return sum * 2 * kPi / turns;
}

Vec3 mirrored(const Vec3& o) { return {-o.x, -o.y, o.z}; }

double lobe_red(const Bsdf& b, const Vec3& w) {
  const Bsdf::LobeValues v = b.lobe_values(w);
  return b.gloss_first.r * v.first + b.gloss_second.r * v.second;
}

// Red share of an even white surrounding that leaves towards the viewer.
double furnace(const Bsdf& b) {
  double sum = 0;
  for (int i = 0; i < b.delta_count; ++i) sum += b.delta[static_cast<std::size_t>(i)].weight.r;
  if (b.has_diffuse()) {
    sum += b.diffuse_out(b.to_viewer).r *
           integral(
               kUp, 1, [&](const Vec3& w) { return b.diffuse_in(w); }, 400, 2);
  }
  if (b.has_lobe()) {
    const double width = b.lobe == Bsdf::Lobe::ggx ? b.width : 1 / std::sqrt(b.width + 1);
    sum += integral(mirrored(b.to_viewer), width, [&](const Vec3& w) { return lobe_red(b, w); });
  }
  return sum;
}

const double kCosines[] = {1, 0.9, 0.6, 0.3, 0.1, 0.02};

// 1 %: the promise of the white furnace. What is left is the interpolation of the albedo table.
TEST(Bsdf, WhiteFurnaceKeepsAllLight) {
  for (const float metallic : {0.0f, 0.4f, 1.0f}) {
    for (const float roughness : {0.0f, 0.05f, 0.1f, 0.2f, 0.35f, 0.5f, 0.8f, 1.0f}) {
      for (const float ior : {1.0f, 1.5f, 2.4f}) {
        if (metallic > 0 && ior != 1.5f) continue;
        for (const double cosine : kCosines) {
          Material m = gltf(1, metallic, roughness);
          m.ior = ior;
          EXPECT_NEAR(furnace(bsdf(m, at_cosine(cosine, 0.7))), 1, 0.01)
              << metallic << " " << roughness << " " << ior << " " << cosine;
        }
      }
    }
  }
}

TEST(Bsdf, PhongReflectsNoMoreThanAll) {
  Material phong;
  phong.albedo = {0.4f, 0.4f, 0.4f};
  phong.specular = {0.6f, 0.6f, 0.6f};
  for (const float exponent : {0.0f, 1.0f, 20.0f, 1e4f}) {
    phong.exponent = exponent;
    for (const double cosine : kCosines) {
      const double all = furnace(bsdf(phong, at_cosine(cosine)));
      EXPECT_LT(all, 1.005) << exponent << " " << cosine;
      if (cosine == 1) {
        EXPECT_NEAR(all, 1, 0.005) << exponent;
      }
    }
  }
}

TEST(Bsdf, TransmissionTakesItsShareFromTheDiffusePart) {
  for (const double cosine : kCosines) {
    Material m = gltf(1, 0, 0.4f);
    m.transmission = 0.7f;
    const Bsdf b = bsdf(m, at_cosine(cosine));
    ASSERT_EQ(b.delta_count, 1);
    EXPECT_EQ(b.delta[0].direction, -b.to_viewer);
    EXPECT_TRUE(b.delta[0].transmitted);
    EXPECT_FALSE(b.delta[0].enters);
    EXPECT_NEAR(b.delta[0].weight.r / b.diffuse_albedo().r, 0.7 / 0.3, 1e-6);
    EXPECT_NEAR(furnace(b), 1, 0.01) << cosine;
  }
}

// The table against the lobe itself, at places between its nodes.
TEST(Bsdf, TabulatedAlbedosAreThoseOfTheLobe) {
  double worst = 0;
  for (const double roughness : {0.031, 0.07, 0.13, 0.22, 0.4, 0.63, 0.9, 1.0}) {
    for (const double cosine : {1.0, 0.93, 0.71, 0.5, 0.33, 0.17, 0.06, 0.02}) {
      const double alpha = roughness * roughness;
      const Vec3 o = at_cosine(cosine);
      const Bsdf::LobeValues e = ggx_albedo(cosine, alpha);
      const auto part = [&](bool second) {
        return integral(mirrored(o), alpha, [&](const Vec3& w) {
          double half = 0;
          const double value = ggx_times_cosine(kUp, w, o, alpha, half);
          return value * (second ? schlick(half) : 1 - schlick(half));
        });
      };
      worst = std::max({worst, std::abs(e.first - part(false)), std::abs(e.second - part(true))});
    }
  }
  EXPECT_LT(worst, 3e-3);
  for (const double cosine : {0.0, 0.2, 1.0}) {
    EXPECT_NEAR(ggx_albedo(cosine, 0).first, 1 - std::pow(1 - cosine, 5), 1e-12);
    EXPECT_NEAR(ggx_albedo(cosine, 0).second, std::pow(1 - cosine, 5), 1e-12);
  }
  // A mirror's mean: 2 cosine (1 - cosine)^5 integrates to 1 / 21.
  EXPECT_NEAR(ggx_mean_albedo(0).second, 1.0 / 21, 1e-4);
  EXPECT_NEAR(coat_mean_albedo(0, 0.04), 0.04 + 0.96 / 21, 1e-4);
}

// f_r = value / cosine is symmetric in w and o but for the factor of compensation; so is the
// diffuse part below its coat.
TEST(Bsdf, IsReciprocalButForTheCompensation) {
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    const float roughness = 0.05f + 0.95f * static_cast<float>(i) / 1000;
    Vec3 w = shapes::random_direction(random), o = shapes::random_direction(random);
    w.z = std::abs(w.z), o.z = std::abs(o.z);
    const Bsdf a = bsdf(gltf(0.8f, 0, roughness), o), b = bsdf(gltf(0.8f, 0, roughness), w);
    const auto ab = a.lobe_values(w), ba = b.lobe_values(o);
    EXPECT_NEAR(ab.first / w.z, ba.first / o.z, 1e-9 * ab.first / w.z);
    EXPECT_NEAR(ab.second / w.z, ba.second / o.z, 1e-9 * ab.second / w.z);
    const double there = a.diffuse_out(o).r * a.diffuse_in(w) / w.z;
    const double back = b.diffuse_out(w).r * b.diffuse_in(o) / o.z;
    EXPECT_NEAR(there, back, 1e-12);
  }
}

// Samples in cells of the sphere against the integral of the density: chi-square with cells - 1
// degrees of freedom, normal approximation; a level of 1e-6 a case is 4.8 sigma.
TEST(Bsdf, SamplesHaveTheStatedDensity) {
  struct Case {
    Material material;
    double cosine;
  };
  std::vector<Case> cases;
  for (const float roughness : {0.1f, 0.4f, 0.9f}) {
    for (const double cosine : {1.0, 0.5, 0.05}) cases.push_back({gltf(1, 1, roughness), cosine});
  }
  for (const float exponent : {0.0f, 5.0f, 300.0f}) {
    for (const double cosine : {1.0, 0.4}) {
      Material m;
      m.specular = {1, 1, 1};
      m.exponent = exponent;
      cases.push_back({m, cosine});
    }
  }
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  for (const Case& c : cases) {
    const Bsdf b = bsdf(c.material, at_cosine(c.cosine, 1.1));
    const double width = b.lobe == Bsdf::Lobe::ggx ? b.width : 1 / std::sqrt(b.width + 1);
    // Cells: by the quantile of the angle to the mirror direction and by the azimuth about it.
    constexpr int kRings = 12, kSectors = 12, kFine = 60;
    const Frame frame(mirrored(b.to_viewer));
    const double end = kPi / (kPi + width);
    const auto cell = [&](const Vec3& w) {
      const Vec3 local = frame.to_local(w);
      const double theta = std::atan2(std::hypot(local.x, local.y), local.z);
      const int ring = static_cast<int>(theta / (theta + width) / end * kRings);
      const int sector =
          static_cast<int>((std::atan2(local.y, local.x) / (2 * kPi) + 0.5) * kSectors);
      return static_cast<std::size_t>(std::min(ring, kRings - 1) * kSectors +
                                      std::min(sector, kSectors - 1));
    };
    std::vector<double> expected(kRings * kSectors + 1, 0.0);  // last: below the horizon
    for (int i = 0; i < kRings * kFine; ++i) {
      const double t = end * (i + 0.5) / (kRings * kFine);
      const double theta = width * t / (1 - t);
      const double measure = width / ((1 - t) * (1 - t)) * end / (kRings * kFine) *
                             std::sin(theta) * 2 * kPi / (kSectors * kFine);
      for (int j = 0; j < kSectors * kFine; ++j) {
        const double phi = 2 * kPi * ((j + 0.5) / (kSectors * kFine) - 0.5);
        const Vec3 w = frame.to_world(
            {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)});
        expected[cell(w)] += measure * b.lobe_pdf(w);
      }
    }
    double within = 0;
    for (const double e : expected) within += e;
    EXPECT_LT(within, 1.001);
    expected.back() = std::max(0.0, 1 - within);
    constexpr int kSamples = 100000;
    std::vector<double> seen(expected.size(), 0.0);
    for (int i = 0; i < kSamples; ++i) {
      const auto sample = b.sample_lobe(unit(random), unit(random));
      if (!sample) {
        ++seen.back();
        continue;
      }
      ASSERT_NEAR(length(sample->direction), 1, 1e-12);
      ASSERT_NEAR(sample->pdf, b.lobe_pdf(sample->direction), 1e-12 * sample->pdf);
      ++seen[cell(sample->direction)];
    }
    // Cells that expect fewer than 20 go together.
    double chi = 0, rest_seen = 0, rest_expected = 0;
    int cells = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const double e = expected[i] * kSamples;
      if (e < 20) {
        rest_seen += seen[i], rest_expected += e;
        continue;
      }
      chi += (seen[i] - e) * (seen[i] - e) / e;
      ++cells;
    }
    if (rest_expected > 20) {
      chi += (rest_seen - rest_expected) * (rest_seen - rest_expected) / rest_expected;
      ++cells;
    }
    const double freedom = cells - 1;
    EXPECT_LT(chi, freedom + 4.8 * std::sqrt(2 * freedom) + 12)
        << static_cast<int>(c.material.model) << " width " << b.width << " cosine " << c.cosine;
    EXPECT_GT(cells, 10);
  }
}

TEST(Bsdf, CosineDirectionsHaveTheirDensity) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(0, 1);
  const Vec3 n = shapes::random_direction(random);
  // The square of the cosine is even on [0, 1], the azimuth's cosine averages 0: 5 sigma.
  double squares = 0;
  Vec3 mean;
  constexpr int kSamples = 100000;
  for (int i = 0; i < kSamples; ++i) {
    const Vec3 w = cosine_direction(n, unit(random), unit(random));
    ASSERT_NEAR(length(w), 1, 1e-12);
    ASSERT_GE(dot(w, n), 0);
    squares += dot(w, n) * dot(w, n) / kSamples;
    mean = mean + w * (1.0 / kSamples);
  }
  EXPECT_NEAR(squares, 0.5, 5 * std::sqrt(1.0 / 12 / kSamples));
  EXPECT_NEAR(length(mean - (2.0 / 3) * n), 0, 5 * std::sqrt(1.0 / kSamples));
}

TEST(Bsdf, FresnelHasItsClosedForms) {
  for (const double n : {1.0, 1.33, 1.5, 2.4}) {
    const double r0 = (n - 1) * (n - 1) / ((n + 1) * (n + 1));
    EXPECT_NEAR(refraction(1, 1 / n).reflectance, r0, 1e-15);
    EXPECT_NEAR(refraction(1, n).reflectance, r0, 1e-15);
    if (n == 1) continue;
    EXPECT_NEAR(refraction(0, 1 / n).reflectance, 1, 1e-15);
    // Brewster's angle tan = n: the part along the plane is 0, the other ((n^2 - 1) / (n^2 + 1))^2.
    const double across = std::pow((n * n - 1) / (n * n + 1), 2);
    EXPECT_NEAR(refraction(1 / std::sqrt(1 + n * n), 1 / n).reflectance, across / 2, 1e-14);
    // From inside: total beyond the critical angle sin = 1 / n, and not within.
    const double critical = std::sqrt(1 - 1 / (n * n));
    EXPECT_EQ(refraction(critical - 1e-9, n).reflectance, 1);
    EXPECT_LT(refraction(critical + 1e-3, n).reflectance, 1);
    // The same share both ways.
    const Refraction in = refraction(0.37, 1 / n);
    EXPECT_NEAR(refraction(in.cosine_beyond, n).reflectance, in.reflectance, 1e-14);
  }
}

TEST(Bsdf, GlassObeysSnellAndSharesItsLight) {
  Material glass;
  glass.model = SurfaceModel::glass;
  glass.albedo = {1, 0.5f, 0.25f};
  glass.ior = 1.5f;
  for (const bool outside : {true, false}) {
    for (const double cosine : kCosines) {
      const Bsdf b = bsdf(glass, at_cosine(cosine, 0.4), outside);
      const double sine = std::sqrt(1 - cosine * cosine);
      const bool total = !outside && sine * 1.5 > 1;
      ASSERT_EQ(b.delta_count, total ? 1 : 2) << cosine;
      EXPECT_NEAR(length(b.delta[0].direction - mirrored(b.to_viewer)), 0, 1e-12);
      EXPECT_FALSE(b.delta[0].transmitted || b.delta[0].enters);
      EXPECT_TRUE(b.is_specular());
      if (total) {
        EXPECT_EQ(b.delta[0].weight, (RgbD{1, 1, 1}));
        continue;
      }
      const Bsdf::Delta& through = b.delta[1];
      EXPECT_TRUE(through.transmitted);
      EXPECT_EQ(through.enters, outside);
      EXPECT_NEAR(length(through.direction), 1, 1e-12);
      const double eta = outside ? 1 / 1.5 : 1.5;
      const Vec3 tangent{through.direction.x, through.direction.y, 0};
      const Vec3 back{-b.to_viewer.x, -b.to_viewer.y, 0};
      EXPECT_NEAR(length(tangent - eta * back), 0, 1e-7);  // 1.5f is exact
      EXPECT_LT(through.direction.z, 0);
      // Radiance / n^2 is what is shared.
      EXPECT_NEAR(b.delta[0].weight.r + through.weight.r / (eta * eta), 1, 1e-12);
      EXPECT_NEAR(through.weight.b, 0.25 * through.weight.r, 1e-12);
    }
  }
}

// Through a slab of parallel faces: the factors of both cancel, the direction comes back.
TEST(Bsdf, InAndOutOfGlassCancel) {
  Material glass;
  glass.model = SurfaceModel::glass;
  glass.albedo = {1, 1, 1};
  glass.ior = 1.7f;
  for (const double cosine : {1.0, 0.6, 0.2}) {
    const Bsdf in = bsdf(glass, at_cosine(cosine));
    const Bsdf out = bsdf(glass, -in.delta[1].direction, false);
    // The second face is seen from above too: its refracted ray goes on down.
    EXPECT_NEAR(length(out.delta[1].direction + in.to_viewer), 0, 1e-12);
    const double r = in.delta[0].weight.r;
    EXPECT_NEAR(in.delta[1].weight.r * out.delta[1].weight.r, (1 - r) * (1 - r), 1e-12);
    // All bounces inside a pane: (1 - r)^2 (1 + r^2 + r^4 ...) passes.
    glass.thin = true;
    const Bsdf pane = bsdf(glass, at_cosine(cosine));
    glass.thin = false;
    EXPECT_NEAR(pane.delta[1].weight.r, (1 - r) * (1 - r) / (1 - r * r), 1e-12);
    EXPECT_NEAR(pane.delta[0].weight.r + pane.delta[1].weight.r, 1, 1e-12);
    EXPECT_EQ(pane.delta[1].direction, -pane.to_viewer);
    EXPECT_FALSE(pane.delta[1].enters);
  }
}

TEST(Bsdf, MirrorsAndPolishedMetal) {
  Material mirror;
  mirror.model = SurfaceModel::mirror;
  mirror.albedo = {0.9f, 0.8f, 0.7f};
  const Vec3 o = at_cosine(0.3, 2);
  const Bsdf b = bsdf(mirror, o);
  ASSERT_EQ(b.delta_count, 1);
  EXPECT_TRUE(b.is_specular());
  EXPECT_EQ(b.delta[0].weight, RgbD(mirror.albedo));
  EXPECT_NEAR(length(b.delta[0].direction - mirrored(o)), 0, 1e-12);
  Material metal = gltf(0.6f, 1, 0.01f);
  const Bsdf polished = bsdf(metal, o);
  ASSERT_EQ(polished.delta_count, 1);
  EXPECT_TRUE(polished.is_specular());
  const double s = std::pow(0.7, 5);
  EXPECT_NEAR(polished.delta[0].weight.r, static_cast<double>(0.6f) * (1 - s) + s, 1e-12);
  EXPECT_TRUE(has_single_directions(mirror));
  EXPECT_TRUE(has_single_directions(metal));
  metal.roughness = 0.03f;
  EXPECT_FALSE(has_single_directions(metal));
  EXPECT_EQ(bsdf(metal, o).delta_count, 0);
  metal.transmission = 0.1f;
  EXPECT_TRUE(has_single_directions(metal));
}

// A smooth normal that would reflect into the surface, or refract out of it, gives way.
TEST(Bsdf, SingleDirectionsStayOnTheirSides) {
  std::mt19937 random(8);
  Scene scene;
  scene.material.resize(2);
  scene.material[0].model = SurfaceModel::mirror;
  scene.material[1].model = SurfaceModel::glass;
  for (int i = 0; i < 20000; ++i) {
    SurfaceHit hit;
    hit.geometric_normal = kUp;
    hit.normal = shapes::random_direction(random);
    hit.to_viewer = shapes::random_direction(random);
    hit.to_viewer.z = std::abs(hit.to_viewer.z);
    if (hit.normal.z < 0) hit.normal = -hit.normal;
    if (dot(hit.normal, hit.to_viewer) <= 0) continue;
    hit.albedo = {1, 1, 1};
    hit.material = i % 2 == 0 ? 0u : 1u;
    hit.outside = i % 4 == 1;
    const Bsdf b = bsdf_at(scene, hit);
    for (int d = 0; d < b.delta_count; ++d) {
      const Bsdf::Delta& delta = b.delta[static_cast<std::size_t>(d)];
      ASSERT_NEAR(length(delta.direction), 1, 1e-12);
      if (delta.transmitted) {
        ASSERT_LT(delta.direction.z, 0);
      } else {
        ASSERT_GT(delta.direction.z, 0);
      }
    }
  }
}

TEST(Bsdf, StaysFiniteAtGrazing) {
  Material phong;
  phong.specular = {1, 1, 1};
  phong.exponent = 1e4f;
  Material glass;
  glass.model = SurfaceModel::glass;
  for (Material m :
       {gltf(1, 1, 0.03f), gltf(1, 0, 0.3f), gltf(0.5f, 0.5f, 1), gltf(1, 0, 0), phong, glass}) {
    for (const double o_cosine : {0.0, -0.0, std::numeric_limits<double>::denorm_min(), 0x1p-53}) {
      const Bsdf b = bsdf(m, {std::sqrt(1 - o_cosine * o_cosine), 0, o_cosine});
      EXPECT_TRUE(is_finite(b.diffuse_out(b.to_viewer)) && is_finite(b.lobe_albedo()));
      for (int d = 0; d < b.delta_count; ++d) {
        EXPECT_TRUE(is_finite(b.delta[static_cast<std::size_t>(d)].weight));
        EXPECT_NEAR(length(b.delta[static_cast<std::size_t>(d)].direction), 1, 1e-12);
      }
      for (const double w_cosine :
           {0.0, -0.0, std::numeric_limits<double>::denorm_min(), 0x1p-53, 0.5}) {
        for (const double side : {-1.0, 1.0}) {
          const Vec3 w{side * std::sqrt(1 - w_cosine * w_cosine), 0, w_cosine};
          const auto v = b.lobe_values(w);
          EXPECT_TRUE(std::isfinite(v.first) && std::isfinite(v.second));
          EXPECT_TRUE(v.first >= 0 && v.second >= 0);
          EXPECT_TRUE(std::isfinite(b.lobe_pdf(w)) && std::isfinite(b.diffuse_in(w)));
          if (w_cosine <= 0) {
            EXPECT_EQ(v.first + v.second + b.diffuse_in(w), 0);
          }
        }
      }
      for (const double u : {0.0, 0.3, 1 - 0x1p-53}) {
        for (const double v : {0.0, 0.3, 1 - 0x1p-53}) {
          const auto sample = b.sample_lobe(u, v);
          if (!sample) continue;
          EXPECT_NEAR(length(sample->direction), 1, 1e-12);
          EXPECT_TRUE(sample->pdf > 0 && std::isfinite(sample->pdf));
        }
      }
    }
  }
}

// Against cos^e in long double: a direction in double is off by 1e-16 of a radian at most, which
// e = 1e4 turns into 1e-12 where the lobe is not yet nothing.
TEST(Bsdf, SharpPhongKeepsItsDigits) {
  Material m;
  m.specular = {1, 1, 1};
  m.exponent = 1e4f;
  const Bsdf b = bsdf(m, kUp);
  for (const double angle : {0.0, 1e-4, 1e-3, 0.01, 0.03}) {
    const double value = b.lobe_values({std::sin(angle), 0, std::cos(angle)}).first;
    const double expected =
        10002 / (2 * kPi) *
        static_cast<double>(std::pow(std::cos(static_cast<long double>(angle)), 10001.0L));
    EXPECT_NEAR(value, expected, 1e-10 * expected);
  }
}

TEST(Bsdf, HalfOfALobeLiesWithinItsHalfWidth) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(0, 1);
  Material phong;
  phong.specular = {1, 1, 1};
  phong.exponent = 50;
  for (const Material& m : {gltf(1, 1, 0.2f), gltf(1, 1, 0.5f), phong}) {
    const Bsdf b = bsdf(m, kUp);
    int within = 0;
    constexpr int kSamples = 20000;
    for (int i = 0; i < kSamples; ++i) {
      const auto sample = b.sample_lobe(unit(random), unit(random));
      within += sample && std::acos(std::min(sample->direction.z, 1.0)) < b.lobe_half_width();
    }
    // 5 sigma of a fair coin.
    EXPECT_NEAR(within, kSamples / 2, 5 * std::sqrt(kSamples / 4.0));
  }
}

}  // namespace
}  // namespace haarlight
