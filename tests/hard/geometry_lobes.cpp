// Rows 22 to 24: sharp lobes, lobes between texels, grazing directions.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "precompute/bsdf.h"
#include "precompute/ggx.h"
#include "precompute/glossy_lobe.h"
#include "precompute/phong_lobe.h"
#include "precompute/random.h"
#include "precompute/surface.h"
#include "tests/hard/hard_case.h"
#include "tests/precompute/shapes.h"
#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

using namespace hard;

const Vec3 kUp{0, 0, 1};

Vec3 at_cosine(double cosine) { return {std::sqrt(1 - cosine * cosine), 0, cosine}; }

Bsdf bsdf_of(const Material& material, const Vec3& normal, const Vec3& to_viewer) {
  Scene scene;
  scene.material = {material};
  SurfaceHit hit;
  hit.geometric_normal = hit.normal = normal;
  hit.to_viewer = to_viewer;
  hit.albedo = material.albedo;
  hit.metallic = material.metallic, hit.roughness = material.roughness;
  return bsdf_at(scene, hit);
}

Material phong(float exponent) {
  Material m;
  m.albedo = {0, 0, 0};
  m.specular = {1, 1, 1};
  m.exponent = exponent;
  return m;
}

Material ggx(float roughness, float metallic = 1) {
  Material m;
  m.model = SurfaceModel::metallic_roughness;
  m.albedo = {1, 1, 1};
  m.metallic = metallic;
  m.roughness = roughness;
  return m;
}

TEST(HardCases, Row22_PhongOfExponentTenThousand) {
  property("Phong to the 10,000: lobe within 1e-5 of long double, its integral over texels too");
  // e log1p(-chord^2 / 2) in double: e times some v, 1e-12 and what acos would have lost is not.
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  const double e = 10000;
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 o = at_cosine(0.05 + 0.95 * uniform(random));
    const Bsdf b = bsdf_of(phong(static_cast<float>(e)), kUp, o);
    const Vec3 mirror{-o.x, -o.y, o.z};
    const double angle = 0.05 * uniform(random);  // the lobe is 0.01 wide
    const Frame frame(mirror);
    const double phi = 2 * kPi * uniform(random);
    const Vec3 w = normalize(frame.to_world(
        {std::sin(angle) * std::cos(phi), std::sin(angle) * std::sin(phi), std::cos(angle)}));
    if (w.z <= 0) continue;
    // The angle as the two unit vectors have it, by the half chord, in long double.
    const long double dx = static_cast<long double>(w.x) - mirror.x;
    const long double dy = static_cast<long double>(w.y) - mirror.y;
    const long double dz = static_cast<long double>(w.z) - mirror.z;
    const long double cosine = 1 - (dx * dx + dy * dy + dz * dz) / 2;
    const long double right =
        (e + 2) /
        (2 * std::numbers::pi_v<long double>)*std::pow(cosine, static_cast<long double>(e)) * w.z;
    worst = std::max(worst, static_cast<double>(std::abs(b.lobe_values(w).first / right - 1)));
  }
  at_most("relative error of the lobe", worst, 1e-5);

  // At normal incidence (e + 2) / (2 pi) cos^(e+1) integrates to 1.
  double sum_error = 0;
  for (const int n : {32, 64}) {
    const DirectionTable table(n, 4);
    for (int trial = 0; trial < 20; ++trial) {
      const Vec3 axis =
          normalize(Vec3{uniform(random) - 0.5, uniform(random) - 0.5, uniform(random) - 0.5});
      const PhongLobe lobe(table, axis, axis, e);
      std::vector<float> weights(4);
      double sum = 0;
      for (std::size_t k = 0; k < table.texels(); ++k) {
        if (!lobe.reaches(k)) continue;
        lobe.weights(k, weights);
        for (const float w : weights) sum += static_cast<double>(w);
      }
      sum_error = std::max(sum_error, std::abs(sum - 1));
    }
  }
  // Texels' parts keep their solid angle to 1e-3 / 24 of its change over a part; see
  // phong_lobe.cpp.
  at_most("error of the integral", sum_error, 1e-4);
}

// What the lobe reflects of an even sky, summed over texels.
double reflected(const DirectionTable& table, const GlossyLobe& lobe, const Bsdf& b) {
  std::vector<float> first_weights(static_cast<std::size_t>(table.samples)),
      second_weights(first_weights);
  double sum = 0;
  for (std::size_t begin = 0; begin < table.texels(); begin += 32) {
    float first[32] = {}, second[32] = {};
    lobe.whole(begin, 32, 0xffffffffu, first, second, first_weights, second_weights);
    for (std::size_t i = 0; i < 32; ++i) {
      sum += b.gloss_first.r * static_cast<double>(first[i]) +
             b.gloss_second.r * static_cast<double>(second[i]);
    }
  }
  return sum;
}

TEST(HardCases, Row23_LobeBelowATexel) {
  property("white furnace: a lobe narrower than a texel reflects 1 +- 0.01 however it lies");
  std::mt19937_64 random(2);
  std::normal_distribution<double> gauss;
  double phong_error = 0, ggx_error = 0;
  for (const int n : {16, 64, 128}) {
    const DirectionTable table(n, 4);
    for (int trial = 0; trial < 60; ++trial) {
      Vec3 axis = normalize(Vec3{gauss(random), gauss(random), gauss(random)});
      if (trial < 27 && trial != 13) {  // along faces, edges and corners too
        axis = normalize(Vec3{trial % 3 - 1.0, trial / 3 % 3 - 1.0, trial / 9 - 1.0});
      }
      for (const float exponent : {300.0f, 3000.0f, 1e4f, 1e5f}) {
        const Bsdf b = bsdf_of(phong(exponent), axis, axis);
        const GlossyLobe lobe(table, b);
        double sum = 0;
        sum = reflected(table, lobe, b);
        phong_error = std::max(phong_error, std::abs(sum - 1));
      }
      // GGX lobes narrower than the samples are drawn from: the mean of f / pdf over the draws.
      for (const float roughness : {0.05f, 0.1f}) {
        const Bsdf b = bsdf_of(ggx(roughness), axis, axis);
        const GlossyLobe lobe(table, b);
        double sum = 0;
        if (lobe.is_narrow()) {
          constexpr double kShift[4] = {0, 0, 0.5, 0.5};
          for (std::uint64_t i = 0; i < 256; ++i) {
            const EvenPoint p = even_point(i, kShift);
            const auto draw = b.sample_lobe(p.value[2], p.value[3]);
            if (!draw) continue;
            const Bsdf::LobeValues f = b.lobe_values(draw->direction);
            sum += (b.gloss_first.r * f.first + b.gloss_second.r * f.second) / draw->pdf / 256;
          }
        } else {
          sum = reflected(table, lobe, b);
        }
        ggx_error = std::max(ggx_error, std::abs(sum - 1));
      }
    }
  }
  at_most("Phong: |sum - 1|", phong_error, 0.01);
  at_most("GGX: |sum - 1|", ggx_error, 0.01);
}

TEST(HardCases, Row24_Grazing) {
  property("finite at cosines 0, -0, u and 1 + 2u; no lobe reflects more than 1.01");
  const double u = 0x1p-24, v = 0x1p-53;
  double bad = 0, most = 0;
  std::vector<Material> materials = {phong(0), phong(32), phong(1e4f), phong(1e6f)};
  for (const float roughness : {0.0f, 0.03f, 0.05f, 0.2f, 0.6f, 1.0f}) {
    materials.push_back(ggx(roughness));
    materials.push_back(ggx(roughness, 0));
    materials.push_back(ggx(roughness, 0.5f));
  }
  for (const Material& material : materials) {
    for (const double co : {0.0, -0.0, v, u, 1e-6, 1e-3, 0.01, 0.1, 0.5, 1.0}) {
      Vec3 o = at_cosine(std::min(co, 1.0));
      o.z = co;
      const Bsdf b = bsdf_of(material, kUp, o);
      for (const double cw : {0.0, -0.0, v, u, 1e-6, 0.01, 0.5, 1.0, 1 + 2 * v}) {
        for (const double side : {1.0, -1.0}) {  // on the viewer's side and on the mirror's
          Vec3 w = at_cosine(std::min(cw, 1.0));
          w.x *= side, w.z = cw;
          const Bsdf::LobeValues f = b.lobe_values(w);
          bad +=
              !(f.first >= 0 && f.second >= 0 && std::isfinite(f.first) && std::isfinite(f.second));
          bad += !std::isfinite(b.diffuse_in(w)) || !is_finite(b.diffuse_out(o)) ||
                 !std::isfinite(b.lobe_pdf(w));
        }
      }
      for (int i = 0; i < b.delta_count; ++i)
        bad += !is_finite(b.delta[static_cast<std::size_t>(i)].weight);
      if (!b.has_lobe()) continue;
      // Albedo by the mean of f / pdf: 4096 even draws, whose mean is within 0.3 % here.
      constexpr double kShift[4] = {0, 0, 0.5, 0.5};
      double albedo = 0;
      for (std::uint64_t i = 0; i < 4096; ++i) {
        const EvenPoint p = even_point(i, kShift);
        const auto draw = b.sample_lobe(p.value[2], p.value[3]);
        if (!draw) continue;
        const Bsdf::LobeValues f = b.lobe_values(draw->direction);
        const double part =
            (b.gloss_first.r * f.first + b.gloss_second.r * f.second) / draw->pdf / 4096;
        bad += !std::isfinite(part);
        albedo += part;
      }
      most = std::max(most, albedo);
    }
  }
  at_most("values that are negative or not finite", bad, 0);
  at_most("largest albedo", most, 1.01);
}

}  // namespace
}  // namespace haarlight
