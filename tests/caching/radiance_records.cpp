// Hemispherical harmonics and records of incoming radiance: orthonormality and closed forms.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "caching/radiance_record.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Gauss-Legendre points and weights on [0, 1], by Newton's method: exact to degree 2 n - 1.
struct Quadrature {
  std::vector<double> x, weight;
  explicit Quadrature(int n) {
    for (int i = 0; i < n; ++i) {
      double t = std::cos(kPi * (i + 0.75) / (n + 0.5)), slope = 1;
      for (int step = 0; step < 50; ++step) {
        double p = 1, before = 0;
        for (int l = 0; l < n; ++l) {
          const double next = ((2 * l + 1) * t * p - l * before) / (l + 1);
          before = p, p = next;
        }
        slope = n * (t * p - before) / (t * t - 1);
        t -= p / slope;
      }
      x.push_back((1 + t) / 2), weight.push_back(1 / ((1 - t * t) * slope * slope));
    }
  }
};

TEST(HemisphericalHarmonics, AreOrthonormal) {
  // Products of two are polynomials of degree 18 in cos theta for even sums of m (odd ones vanish
  // by phi), and trigonometric ones of 18 in phi: 24 points each are exact but for float.
  constexpr int kPoints = 24;
  const Quadrature q(kPoints);
  std::vector<std::vector<double>> product(kHarmonics, std::vector<double>(kHarmonics));
  for (std::size_t j = 0; j < kPoints; ++j) {
    for (int k = 0; k < kPoints; ++k) {
      const double phi = 2 * kPi * k / kPoints, flat = std::sqrt(1 - q.x[j] * q.x[j]);
      const Harmonics h =
          hemispherical_harmonics({flat * std::cos(phi), flat * std::sin(phi), q.x[j]});
      const double w = q.weight[j] * 2 * kPi / kPoints;
      for (std::size_t a = 0; a < kHarmonics; ++a) {
        for (std::size_t b = 0; b <= a; ++b) {
          product[a][b] += w * static_cast<double>(h[a]) * static_cast<double>(h[b]);
        }
      }
    }
  }
  for (std::size_t a = 0; a < kHarmonics; ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      ASSERT_NEAR(product[a][b], a == b ? 1 : 0, 1e-5) << a << ", " << b;
    }
  }
}

TEST(HemisphericalHarmonics, FirstOnesAreTheirFormulas) {
  const Vec3 d = normalize(Vec3{0.3, -0.5, 0.7});
  const Harmonics h = hemispherical_harmonics(d);
  const double x = 2 * d.z - 1, k = std::sqrt(3 / (2 * kPi));
  EXPECT_NEAR(h[0], std::sqrt(1 / (2 * kPi)), 1e-6);
  EXPECT_NEAR(h[2], k * x, 1e-6);
  // P_1^1 = sqrt(1 - x^2), times sqrt(2) sqrt(3 / (4 pi)).
  const double flat = std::hypot(d.x, d.y), p = std::sqrt(3 / (2 * kPi)) * std::sqrt(1 - x * x);
  EXPECT_NEAR(h[3], p * d.x / flat, 1e-6);
  EXPECT_NEAR(h[1], p * d.y / flat, 1e-6);
}

TEST(HemisphericalHarmonics, TurnAboutTheNormal) {
  // Of a function even in y: its values in a direction turned back.
  Harmonics even{};
  for (std::size_t l = 0; l < 10; ++l) {
    for (std::size_t m = 0; m <= l; ++m) {
      even[l * (l + 1) + m] = 1 / (1.0f + static_cast<float>(l + 2 * m));
    }
  }
  const double angle = 0.8;
  const Harmonics turned = turned_about_z(even, std::cos(angle), std::sin(angle));
  const auto value = [](const Harmonics& f, const Vec3& d) {
    const Harmonics h = hemispherical_harmonics(d);
    double sum = 0;
    for (std::size_t i = 0; i < kHarmonics; ++i) sum += static_cast<double>(f[i] * h[i]);
    return sum;
  };
  for (const double phi : {0.0, 1.0, 4.0}) {
    const Vec3 here{0.6 * std::cos(phi), 0.6 * std::sin(phi), 0.8};
    const Vec3 back{0.6 * std::cos(phi - angle), 0.6 * std::sin(phi - angle), 0.8};
    EXPECT_NEAR(value(turned, here), value(even, back), 1e-5);
  }
}

template <typename Light, typename Distance>
RadianceValue lit(int samples, const Light& light, const Distance& distance) {
  Hemisphere h = stratified_hemisphere(samples, 5, true);
  for (std::size_t i = 0; i < h.direction.size(); ++i) {
    const double x = light(h.direction[i]);
    h.radiance[i] = {x, 2 * x, 3 * x};
    h.distance[i] = distance(h.direction[i]);
    EXPECT_EQ(h.stratum_of(h.direction[i]), i);
  }
  return radiance_value(h);
}

TEST(RadianceRecord, EdgeOverheadHasItsTranslationGradient) {
  // A ceiling at height h, bright where x > -e: the lune of angle pi / 2 + atan(e / h) is bright,
  // of solid angle twice that, so that the mean coefficient rises by 2 h / (h^2 + e^2) / sqrt(2 pi)
  // a metre. With e = 0 the edge lies between sectors, else it crosses rings as well.
  const double h = 0.8;
  RadianceValue v;
  for (const double e : {0.0, 0.6}) {
    v = lit(
        8000, [&](const Vec3& w) { return w.x / w.z * h > -e ? 1.0 : 0.0; },
        [&](const Vec3& w) { return h / w.z; });
    EXPECT_NEAR(v.coefficient[0], (kPi + 2 * std::atan(e / h)) / std::sqrt(2 * kPi), 0.01);
    // Sums over 50 rings of the edge's speed, infinite nowhere: 2 % of room; of an edge that
    // crosses strata askew, 5 %.
    const double slope = 2 * h / (h * h + e * e) / std::sqrt(2 * kPi);
    EXPECT_NEAR(v.along_x[0], slope, (e > 0 ? 0.05 : 0.02) * slope) << e;
    EXPECT_NEAR(v.along_y[0], 0, 0.05 * slope) << e;
  }
  EXPECT_NEAR(v.along_x[2], 3 * v.along_x[0], 1e-4);
}

TEST(RadianceRecord, LobesAreThoseOfTheBsdf) {
  // Smooth light over the hemisphere, by a record and by a sum over directions.
  const auto light = [](const Vec3& w) { return 1 + 0.5 * w.x - 0.3 * w.y + 0.4 * w.z * w.z; };
  const RadianceValue value = lit(8000, light, [](const Vec3&) { return kInfinite; });
  PlaceFrame at;
  at.normal = at.geometric_normal = {0, 0, 1};
  at.tangent = {1, 0, 0}, at.bitangent = {0, 1, 0};
  LobeHarmonics lobes;
  for (const double width : {0.2, 0.35, 20.0}) {
    for (const double tilt : {0.0, 0.7, 1.2}) {
      Bsdf bsdf;
      bsdf.normal = bsdf.geometric_normal = at.normal;
      bsdf.to_viewer = {std::sin(tilt) * 0.6, std::sin(tilt) * 0.8, std::cos(tilt)};
      bsdf.lobe = width > 1 ? Bsdf::Lobe::phong : Bsdf::Lobe::ggx;
      bsdf.width = width;
      bsdf.gloss_first = {0.5, 0.5, 0.5}, bsdf.gloss_second = {0.2, 0.2, 0.2};
      lobes.make({lobe_table_key(bsdf)});
      double wanted = 0;
      constexpr int kHeights = 200, kTurns = 400;
      for (int j = 0; j < kHeights; ++j) {
        for (int k = 0; k < kTurns; ++k) {
          const double z = (j + 0.5) / kHeights, phi = 2 * kPi * k / kTurns;
          const double flat = std::sqrt(1 - z * z);
          const Vec3 w{flat * std::cos(phi), flat * std::sin(phi), z};
          const Bsdf::LobeValues f = bsdf.lobe_values(w);
          wanted += (0.5 * f.first + 0.2 * f.second) * light(w) * 2 * kPi / kHeights / kTurns;
        }
      }
      const double found = lobe_radiance(at, value, {0, 0, 0}, bsdf, lobe_table_key(bsdf), lobes).r;
      // Light of low order loses nothing by the cut; tables are within 1/128 in alpha and 1/64 in
      // the cosine of the view: 2 %, at grazing views, where the lobe leans most on them, 4 %.
      EXPECT_NEAR(found, wanted, (tilt > 1 ? 0.04 : 0.02) * wanted) << width << ", " << tilt;
    }
  }
}

TEST(RadianceRecord, ChangesCountWhereTheLobeLooks) {
  const auto far = [](const Vec3&) { return kInfinite; };
  const auto sky = [&](double here, double there) {
    return lit(
        2000, [&](const Vec3& w) { return w.z > 0.8 ? 1
                                          : w.x > 0 ? here
                                                    : there; }, far);
  };
  Bsdf bsdf;
  bsdf.lobe = Bsdf::Lobe::ggx, bsdf.width = 0.2;
  LobeHarmonics lobes;
  const LobeView view{lobe_table_key(bsdf), normalize(Vec3{-1, 0, 0.8})};  // mirrors x > 0
  lobes.make({view.table});
  const RadianceValue now = sky(1, 1);
  EXPECT_EQ(temporal_ratio(now, now, view, lobes), 1);
  // Half of the light all over is a ratio of 2, either way.
  EXPECT_NEAR(temporal_ratio(now, now * 0.5, view, lobes), 2, 1e-5);
  EXPECT_NEAR(temporal_ratio(now * 0.5, now, view, lobes), 2, 1e-5);
  const double here = temporal_ratio(now, sky(1.2, 1), view, lobes) - 1;
  const double there = temporal_ratio(now, sky(1, 1.2), view, lobes) - 1;
  // Nearly all of a lobe is on its own side; what the basis rings on the other is a few per cent.
  EXPECT_GT(here, 0.1);
  EXPECT_LT(here, 0.2 + 1e-3);
  EXPECT_LT(there, 0.2 * here);
  EXPECT_GE(temporal_ratio(now * 0, now, view, lobes), 100);
  EXPECT_EQ(temporal_ratio(now * 0, now * 0, view, lobes), 1);
}

TEST(RadianceRecord, CoefficientsOfOtherLightAreThoseOfItsHemisphere) {
  Hemisphere now = stratified_hemisphere(400, 5, true), then = now;
  for (std::size_t i = 0; i < now.direction.size(); ++i) {
    now.radiance[i] = then.radiance[i] = {1 + now.direction[i].x, 1, 2};
    if (i % 7 == 0) then.radiance[i] = {0.2, 3, 0};
  }
  const RadianceValue found = coefficients_of(then, now, radiance_value(now));
  const RadianceValue wanted = radiance_value(then);
  for (std::size_t i = 0; i < 3 * kHarmonics; ++i) {
    // Sums of 400 floats of at most 0.1 each.
    EXPECT_NEAR(found.coefficient[i], wanted.coefficient[i], 1e-4) << i;
  }
}

TEST(RadianceRecord, IsFollowedToPlacesNearby) {
  RadianceValue v = lit(
      2000, [](const Vec3& w) { return w.x > 0 ? 2.0 : 1.0; },
      [](const Vec3& w) { return 1 / w.z; });
  PlaceFrame at;
  at.normal = at.geometric_normal = {0, 0, 1};
  at.tangent = {1, 0, 0}, at.bitangent = {0, 1, 0};
  Bsdf bsdf;
  bsdf.normal = bsdf.geometric_normal = bsdf.to_viewer = at.normal;
  bsdf.lobe = Bsdf::Lobe::ggx, bsdf.width = 0.3, bsdf.gloss_first = {1, 1, 1};
  LobeHarmonics lobes;
  const auto key = lobe_table_key(bsdf);
  lobes.make({key});
  const double here = lobe_radiance(at, v, {0, 0, 0}, bsdf, key, lobes).r;
  const double there = lobe_radiance(at, v, {0.1, 0, 0}, bsdf, key, lobes).r;
  // 0.1 to the right the edge overhead is 0.1 to the left of it: the same record made there.
  const RadianceValue moved = lit(
      2000, [](const Vec3& w) { return w.x / w.z > -0.1 ? 2.0 : 1.0; },
      [](const Vec3& w) { return 1 / w.z; });
  const double wanted = lobe_radiance(at, moved, {0, 0, 0}, bsdf, key, lobes).r;
  EXPECT_GT(wanted - here, 0.05 * here);
  EXPECT_NEAR(there - here, wanted - here, 0.3 * (wanted - here));
}

}  // namespace
}  // namespace haarlight
