// Light gathered at one point: closed forms, adaptivity, horizons, lobes.

#include "precompute/point_tracer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "tests/precompute/shapes.h"
#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

struct Gathered {
  std::vector<float> lambert, lobe;
  RayCounts counts;
  double lambert_sum() const {
    return std::accumulate(lambert.begin(), lambert.end(), 0.0,
                           [](double a, float b) { return a + static_cast<double>(b); });
  }
  double lobe_sum() const {
    return std::accumulate(lobe.begin(), lobe.end(), 0.0,
                           [](double a, float b) { return a + static_cast<double>(b); });
  }
};

Gathered gather(const Visibility& visibility, const DirectionTable& table, ShadingPoint point,
                bool adaptive) {
  Gathered g;
  g.lambert.resize(table.texels());
  g.lobe.resize(table.texels());
  PointScratch scratch;
  PointTracer(visibility, table, adaptive).trace(point, g.lambert, g.lobe, scratch, g.counts);
  return g;
}

ShadingPoint point_at(const Visibility& visibility, const Vec3& world, const Vec3& geometric,
                      const Vec3& normal) {
  ShadingPoint p;
  const Vec3 o = visibility.to_local(world) + Visibility::kSurfaceOffset * geometric;
  p.origin = {static_cast<float>(o.x), static_cast<float>(o.y), static_cast<float>(o.z)};
  p.geometric_normal = geometric;
  p.normal = normal;
  return p;
}

// A Phong lobe about `mirror`.
Bsdf phong_bsdf(const Vec3& normal, const Vec3& mirror, double exponent) {
  Bsdf b;
  b.geometric_normal = b.normal = normal;
  b.to_viewer = 2 * dot(normal, mirror) * normal - mirror;
  b.lobe = Bsdf::Lobe::phong;
  b.width = exponent;
  b.gloss_first = {1, 1, 1};
  return b;
}

// A triangle far below a point at the origin, so that nothing above is in the way.
Scene free_scene() {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
  return scene;
}

// int max(0, n.w) / pi dw = 1, and with light n.w: int max(0, n.w)^2 / pi dw = 2/3. On the cube's
// faces the first integrand is f = n.(u,v,1) / (1 + u^2 + v^2)^2, whose Laplacian is at most 8, and
// the hemisphere has an area of 12 there: with samples s = (2/n) / sqrt(spp) apart the midpoint
// rule is wrong by at most 12 * 8 s^2 / 24, and at the horizon's kink by s^2 / 8 for each unit of
// its length, at most 2 pi. Divided by pi: 1.3 s^2 + 0.25 s^2.
TEST(PointTracer, OpenSkyGivesWhole) {
  const Scene scene = free_scene();
  const Visibility visibility(scene);
  const Vec3 up{0, 1, 0};
  std::mt19937 random(6);
  for (const int n : {16, 64}) {
    for (const int spp : {1, 4, 16}) {
      const DirectionTable table(n, spp);
      const double s = 2.0 / n / std::sqrt(spp), tolerance = 1.6 * s * s;
      for (const bool adaptive : {true, false}) {
        const Gathered g =
            gather(visibility, table, point_at(visibility, {0, 0, 0}, up, up), adaptive);
        EXPECT_NEAR(g.lambert_sum(), 1, tolerance) << n << " " << spp;
        double squared = 0;
        for (std::size_t k = 0; k < table.texels(); ++k) {
          const auto size = static_cast<std::size_t>(n);
          const Vec3 c =
              cube_texel_center(static_cast<int>(k / (size * size)), static_cast<int>(k % size),
                                static_cast<int>(k / size % size), n);
          squared += static_cast<double>(g.lambert[k]) * c.y;
        }
        // The light, too, is sampled: once a texel, 2 / n apart.
        EXPECT_NEAR(squared, 2.0 / 3, tolerance + 0.5 * 4.0 / (n * n));
      }
      // Any normal that turns its back to the quad, from well below it.
      for (int i = 0; i < 4; ++i) {
        Vec3 normal = shapes::random_direction(random);
        normal.y = -std::abs(normal.y) - 0.2;
        normal = normalize(normal);
        // The quad fills less than atan(sqrt(2) / 100) of the sky around straight up.
        const Gathered g =
            gather(visibility, table, point_at(visibility, {0, -100, 0}, normal, normal), true);
        EXPECT_NEAR(g.lambert_sum(), 1, tolerance);
      }
    }
  }
}

// The share of the sky that the horizon of the true surface leaves to a tilted smooth normal: the
// cosine-weighted hemisphere about n cut by the plane of g at angle a to n is (1 + cos a) / 2.
TEST(PointTracer, GeometricHorizonCutsTheSmoothOne) {
  const Scene scene = free_scene();
  const Visibility visibility(scene);
  const DirectionTable table(64, 4);
  for (const double angle : {0.1, 0.5, 1.0}) {
    const Vec3 normal{std::sin(angle), std::cos(angle), 0};
    // Hanging free below the quad, upside down: nothing but the horizon itself can cut.
    const Gathered g =
        gather(visibility, table, point_at(visibility, {0, -100, 0}, {0, -1, 0}, -normal), true);
    // Along the geometric horizon, length pi, the integrand jumps by up to sin a / pi: a sample
    // on the wrong side costs its solid angle. With errors of at most one sample's width s in
    // 64 * 2 columns of independent sign: 4 sigma of sqrt(128) * (2/n) * s / sqrt(12) * sin a / pi.
    const double s = 1.0 / 64;
    const double tolerance =
        4 * std::sqrt(128.0) * (2.0 / 64) * s / std::sqrt(12.0) * std::sin(angle) / kPi + s * s / 2;
    EXPECT_NEAR(g.lambert_sum(), (1 + std::cos(angle)) / 2, tolerance);
  }
}

// Form factor from a point to the part of a rectangle a x b at height 1 whose corner is overhead
// (any radiative transfer handbook): 1/(2 pi) [A/sqrt(1+A^2) atan(B/sqrt(1+A^2)) + the same with A
// and B exchanged].
double corner_form_factor(double a, double b) {
  const double ra = std::sqrt(1 + a * a), rb = std::sqrt(1 + b * b);
  return (a / ra * std::atan(b / ra) + b / rb * std::atan(a / rb)) / (2 * kPi);
}

TEST(PointTracer, RectangleOverheadHasItsFormFactor) {
  for (const double half : {0.3, 1.0, 3.0}) {
    // Turned, so that its edges run across the rows of texels and not along them.
    const Rotation turn = rotation_y(0.4);
    Scene scene = shapes::empty_scene();
    shapes::add_quad(scene, turn * Vec3{-half, 1, -half}, turn * Vec3{2 * half, 0, 0},
                     turn * Vec3{0, 0, 2 * half});
    const Visibility visibility(scene);
    const Vec3 up{0, 1, 0};
    for (const bool adaptive : {true, false}) {
      const DirectionTable table(64, 16);
      const Gathered g =
          gather(visibility, table, point_at(visibility, {0, 0, 0}, up, up), adaptive);
      const double expected = 1 - 4 * corner_form_factor(half, half);
      // At most 4 * 64 texels on the outline; each is wrong by about a quarter of a column of its
      // 16 samples (standard deviation 1/4 / sqrt(12)) of at most (2/64)^2 / pi. Four sigma, plus
      // the open sky's error.
      const double texel = std::pow(2.0 / 64, 2) / kPi;
      const double tolerance = 4 * std::sqrt(256.0) * 0.25 / std::sqrt(12.0) * texel + 3e-5;
      EXPECT_NEAR(g.lambert_sum(), expected, tolerance) << "half " << half;
    }
  }
}

TEST(PointTracer, ClosedBoxIsDark) {
  Scene scene = shapes::empty_scene();
  shapes::add_box(scene, {-1, -1, -1}, {1.3, 1.1, 1.7});
  const Visibility visibility(scene);
  const DirectionTable table(32, 4);
  const Vec3 up{0, 1, 0};
  ShadingPoint point = point_at(visibility, {0.2, -1, 0.3}, up, up);
  point.glossy = true;
  point.bsdf = phong_bsdf(up, up, 20);
  for (const bool adaptive : {true, false}) {
    const Gathered g = gather(visibility, table, point, adaptive);
    for (const float t : g.lambert) EXPECT_EQ(t, 0.0f);
    for (const float t : g.lobe) EXPECT_EQ(t, 0.0f);
  }
}

// A tilted box casts an outline that a ray a texel plus a closer look at the outline sees as well
// as all rays everywhere: texels inside and outside agree exactly, those on it too.
TEST(PointTracer, AdaptiveAgreesWithAllRays) {
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {0.4, 1, 0.2}, 0.6, 5);
  const Visibility visibility(scene);
  const DirectionTable table(64, 4);
  const Vec3 up{0, 1, 0};
  ShadingPoint point = point_at(visibility, {0, 0, 0}, up, normalize(Vec3{0.1, 1, 0}));
  point.glossy = true;
  point.bsdf = phong_bsdf(point.normal, normalize(Vec3{0.3, 0.8, 0.1}), 60);
  const Gathered fast = gather(visibility, table, point, true);
  const Gathered full = gather(visibility, table, point, false);
  EXPECT_LT(fast.counts.shadow, full.counts.shadow / 2);
  int differing = 0;
  for (std::size_t k = 0; k < table.texels(); ++k) {
    // Equal up to the rounding of one sum of four terms, unless the outline grazes a texel between
    // the first samples of all its neighbours: at most where it touches a row or column, of which a
    // convex outline has 4 a face it crosses.
    const double tolerance = 1e-6 * static_cast<double>(full.lambert[k]) + 1e-12;
    if (std::abs(static_cast<double>(fast.lambert[k] - full.lambert[k])) > tolerance) ++differing;
  }
  EXPECT_LE(differing, 12);
  EXPECT_NEAR(fast.lobe_sum(), full.lobe_sum(), 0.01 * full.lobe_sum());
}

// Counts rays as the header promises them, from plain loops: one a texel, the other samples where
// a first sample's visibility differs from a neighbour's or a horizon crosses the texel.
TEST(PointTracer, TracesExactlyTheRaysItPromises) {
  Scene scene = shapes::empty_scene();
  shapes::add_sphere(scene, {0.4, 1, 0.2}, 0.6, 5);
  shapes::add_box(scene, {-2, 0.2, -2}, {-1, 1.5, 2});
  const Visibility visibility(scene);
  for (const int n : {4, 32, 64, 128}) {
    const DirectionTable table(n, 4);
    const Vec3 up{0, 1, 0};
    const ShadingPoint point = point_at(visibility, {0, 0, 0}, up, up);
    const Gathered fast = gather(visibility, table, point, true);

    const auto size = static_cast<std::size_t>(n);
    std::vector<int> state(table.texels(), -1);  // of the first sample: -1 unknown, 0 blocked, 1
    std::vector<bool> close(table.texels(), false);
    for (const DirectionTable::Packet& p : table.packet) {
      const unsigned blocked = visibility.occluded8(point.origin, p.x, p.y, p.z, 0xff);
      for (unsigned lane = 0; lane < 8; ++lane) {
        const auto k = static_cast<std::size_t>((lane < 4 ? p.top : p.bottom)) + lane % 4;
        if (p.y[lane] > 0) state[k] = (blocked >> lane & 1u) ? 0 : 1;
        // The horizon y = 0 runs along texel borders; texels within reach of it count as crossed.
        close[k] = std::abs(p.cy[lane]) <= p.radius;
      }
    }
    std::vector<bool> refined = close;
    const auto compare = [&](std::size_t a, std::size_t b) {
      if (state[a] >= 0 && state[b] >= 0 && state[a] != state[b]) refined[a] = refined[b] = true;
    };
    for (std::size_t k = 0; k < table.texels(); ++k) {
      if (k % size + 1 < size) compare(k, k + 1);
      if (k / size % size + 1 < size) compare(k, k + size);
    }
    for (const auto& [a, b] : table.seam) {
      compare(static_cast<std::size_t>(a), static_cast<std::size_t>(b));
    }
    std::int64_t expected = 0;
    for (std::size_t k = 0; k < table.texels(); ++k) {
      if (state[k] >= 0) ++expected;
      if (!refined[k]) continue;
      for (std::size_t s = 1; s < 4; ++s) expected += table.sample[4 * k + s].y > 0;
    }
    EXPECT_EQ(fast.counts.shadow, expected) << "n " << n;
  }
}

// A wall whose upper edge lies just beyond an edge of the cube: only the neighbours on the other
// face tell that the outermost texels need a closer look.
TEST(PointTracer, OutlinesAlongAnEdgeOfTheCubeAreSeen) {
  const int n = 32;
  Scene scene = shapes::empty_scene();
  // Seen from the origin it blocks (1, y, z) for y < 1 / (1 - 1/n): the outer half of the last
  // column of face +Y (u > 1 - 1/n), not that column's first sample.
  const double top = 1 / (1 - 1.0 / n);
  shapes::add_quad(scene, {1, -3, -4}, {0, top + 3, 0}, {0, 0, 8});
  const Visibility visibility(scene);
  const DirectionTable table(n, 4);
  const Vec3 normal = normalize(Vec3{1, 1, 0});
  const ShadingPoint point = point_at(visibility, {0, 0, 0}, normal, normal);
  const Gathered fast = gather(visibility, table, point, true);
  const Gathered full = gather(visibility, table, point, false);
  int partly = 0;
  for (int y = 0; y < n; ++y) {
    const std::size_t k = cube_index(2, n - 1, y, n);
    EXPECT_NEAR(fast.lambert[k], full.lambert[k], 1e-6f * full.lambert[k]);
    const float open = static_cast<float>(normal.x) * table.moment_x[k] +
                       static_cast<float>(normal.y) * table.moment_y[k];
    const float share = full.lambert[k] * static_cast<float>(kPi) / open;
    partly += share > 0.4f && share < 0.6f;
  }
  EXPECT_EQ(partly, n);
}

// Furnace: seen straight on under an open sky the lobe returns 1.
TEST(PointTracer, LobeUnderOpenSkyReturnsOne) {
  const Scene scene = free_scene();
  const Visibility visibility(scene);
  const DirectionTable table(64, 4);
  const Vec3 up{0, 1, 0};
  for (const double exponent : {5.0, 100.0, 10000.0}) {
    ShadingPoint point = point_at(visibility, {0, 0, 0}, up, up);
    point.glossy = true;
    point.bsdf = phong_bsdf(up, up, exponent);
    EXPECT_NEAR(gather(visibility, table, point, true).lobe_sum(), 1, 0.01);
  }
}

}  // namespace
}  // namespace haarlight
