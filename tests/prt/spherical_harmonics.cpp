// Spherical harmonics by their identities, and relighting with them against plain products.

#include "prt/spherical_harmonics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "core/image_metrics.h"
#include "prt/image_relighter.h"
#include "prt/sh_relighter.h"
#include "tests/prt/fixtures.h"
#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

constexpr int kFace = 16;

Vec3 random_direction(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return normalize(Vec3{normal(random), normal(random), normal(random)});
}

// Addition theorem: sum over m of Y_lm(a) Y_lm(b) = (2 l + 1) / (4 pi) P_l(a . b). It holds for no
// basis but one that is orthonormal in each degree and turns into itself.
TEST(SphericalHarmonics, AdditionTheorem) {
  std::mt19937_64 random(1);
  std::vector<double> at_a(sh_count(kMaxShOrder)), at_b(at_a.size());
  for (int i = 0; i < 200; ++i) {
    const Vec3 a = i == 0 ? Vec3{0, 1, 0} : random_direction(random), b = random_direction(random);
    spherical_harmonics(kMaxShOrder, a, at_a);
    spherical_harmonics(kMaxShOrder, b, at_b);
    for (int l = 0; l < kMaxShOrder; ++l) {
      double sum = 0;
      for (int k = l * l; k < (l + 1) * (l + 1); ++k) {
        EXPECT_EQ(sh_degree(k), l);
        sum += at_a[static_cast<std::size_t>(k)] * at_b[static_cast<std::size_t>(k)];
      }
      EXPECT_NEAR(sum, (2 * l + 1) / (4 * kPi) * std::legendre(static_cast<unsigned>(l), dot(a, b)),
                  1e-12);
    }
  }
}

TEST(SphericalHarmonics, DegreeOneIsTheDirection) {
  std::mt19937_64 random(2);
  std::vector<double> y(4);
  const double c = std::sqrt(3 / (4 * kPi));
  for (int i = 0; i < 20; ++i) {
    const Vec3 d = random_direction(random);
    spherical_harmonics(2, d, y);
    EXPECT_NEAR(y[0], std::sqrt(1 / (4 * kPi)), 1e-15);
    EXPECT_NEAR(y[1], c * d.x, 1e-14);
    EXPECT_NEAR(y[2], c * d.y, 1e-14);
    EXPECT_NEAR(y[3], c * d.z, 1e-14);
  }
}

struct Small {
  fixtures::SmallTransport small = fixtures::small_transport(kFace, 24, 16, 5);
  Transport transport = build_transport(small.info, small.tiles, small.thresholds);
};

/// Light of spherical harmonics alone.
std::vector<Rgb> smooth_light(const HaarLayout& layout, int order, std::span<const RgbD> factors) {
  const ShProjection projection(layout, order);
  std::vector<Rgb> light(static_cast<std::size_t>(layout.size()));
  for (int k = 0; k < sh_count(order); ++k) {
    const std::span<const float> y = projection.haar(k);
    for (std::size_t j = 0; j < light.size(); ++j) {
      light[j] += Rgb(static_cast<double>(y[j]) * factors[static_cast<std::size_t>(k)]);
    }
  }
  return light;
}

// A light that is of the basis comes back as it is, but for sampling at the middles of texels
// (whose error falls with the square of their size: (pi / 2 / 16)^2 / 24 x l(l + 1) = 0.8 % for
// degree 4), and so does its picture.
TEST(ShRelighter, ALightOfTheBasisIsExact) {
  for (const bool colored : {false, true}) {
    const fixtures::SmallTransport small =
        fixtures::small_transport(kFace, 24, 16, 5, 0.4, colored);
    const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::vector<RgbD> factors(sh_count(5));
    for (RgbD& f : factors) f = {uniform(random), uniform(random), uniform(random)};
    const std::vector<Rgb> light = smooth_light(transport.layout(), 5, factors);
    ShRelighter relighter(transport, {.order = 5});
    relighter.relight(light, true);
    for (std::size_t k = 0; k < factors.size(); ++k) {
      EXPECT_LT(l1_norm(relighter.shown()[k] - factors[k]), 0.1) << k;
    }
    const Image exact = relight_once(transport, light);
    EXPECT_LT(compare_images(relighter.picture(), exact).relative_rmse, 0.02);
  }
}

// picture == T_sh * shown after any sequence, at rest the projection itself.
TEST(ShRelighter, FollowsTheLightAndArrives) {
  const Small s;
  std::mt19937_64 random(4);
  std::vector<Rgb> light = fixtures::random_lighting(s.transport.layout(), random);
  ShRelighter step(s.transport, {.order = 4, .incremental = true, .terms = 3});
  ShRelighter exact(s.transport, {.order = 4});
  const HaarLayout& layout = s.transport.layout();
  step.relight(light, true);
  int resets = 0;
  for (int frame = 0; frame < 30; ++frame) {
    if (frame < 20) light = fixtures::random_lighting(layout, random);
    const ShRelighter::Frame f = step.relight(light, false);
    EXPECT_LE(f.updates, 3);
    for (const char digit : f.resets) resets += digit == '1';
    std::vector<RgbD> shown(step.shown().begin(), step.shown().end());
    const Image wanted = relight_once(s.transport, smooth_light(layout, 4, shown));
    // Columns are rounded to float once more, lights too.
    EXPECT_LT(compare_images(step.picture(), wanted).relative_rmse, 1e-5) << frame;
  }
  EXPECT_GT(resets, 0);
  exact.relight(light, false);
  EXPECT_LT(compare_images(step.picture(), exact.picture()).relative_rmse, 1e-6);
  EXPECT_EQ(step.relight(light, false).updates, 0);
}

TEST(ShRelighter, RefusesWhatIsOutOfRange) {
  const Small s;
  EXPECT_THROW(ShRelighter(s.transport, {.order = 0}), Error);
  EXPECT_THROW(ShRelighter(s.transport, {.order = kMaxShOrder + 1}), Error);
  EXPECT_THROW(ShRelighter(s.transport, {.order = 5, .incremental = true, .terms = 0}), Error);
}

}  // namespace
}  // namespace haarlight
