// The lobe keeps its energy however narrow it is and however it lies to the texels.

#include "precompute/phong_lobe.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/precompute/shapes.h"
#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

double energy(const DirectionTable& table, const Vec3& mirror, const Vec3& normal,
              double exponent) {
  const PhongLobe lobe(table, mirror, normal, exponent);
  std::vector<float> weights(static_cast<std::size_t>(table.samples));
  double sum = 0;
  for (std::size_t k = 0; k < table.texels(); ++k) {
    lobe.weights(k, weights);
    double texel = 0;
    for (const float w : weights) texel += static_cast<double>(w);
    // What reaches() leaves out is below 1e-9 of the peak over at most all texels.
    if (!lobe.reaches(k)) {
      EXPECT_LE(texel, 1e-9 * (exponent + 2) * cube_texel_solid_angle(0, 0, table.n) * 8);
    }
    sum += texel;
  }
  return sum;
}

// Furnace: seen straight on, the integral of the lobe is (e+2)/(2 pi) int cos^(e+1) dw = 1.
TEST(PhongLobe, KeepsItsEnergyInAllDirections) {
  std::mt19937 random(5);
  for (const int n : {16, 64}) {
    for (const int samples : {1, 4}) {
      const DirectionTable table(n, samples);
      for (const double exponent : {1.0, 32.0, 400.0, 2000.0, 10000.0}) {
        for (int i = 0; i < 5; ++i) {
          const Vec3 n_dir = shapes::random_direction(random);
          // A wide lobe ends at the horizon with a kink (e = 1: cos^2 has none): 1 % is the bound
          // that users are promised; the smooth sums are far better.
          EXPECT_NEAR(energy(table, n_dir, n_dir, exponent), 1, 0.01)
              << "n " << n << " samples " << samples << " e " << exponent;
        }
      }
    }
  }
}

// Each sample's part against a plain fine quadrature of its texel.
TEST(PhongLobe, TexelsMatchFineQuadrature) {
  const int n = 32;
  const DirectionTable table(n, 4);
  const Vec3 mirror = normalize(Vec3{0.3, 0.8, 0.2}), normal = normalize(Vec3{0.1, 1, -0.2});
  for (const double exponent : {20.0, 500.0, 8000.0}) {
    const PhongLobe lobe(table, mirror, normal, exponent);
    const CubePoint at = cube_point(mirror);
    const int cx = cube_texel(at.u, n), cy = cube_texel(at.v, n);
    const double peak_texel = (exponent + 2) / (2 * kPi) * 4.0 / (n * n);
    for (int y = cy - 2; y <= cy + 2; ++y) {
      for (int x = cx - 2; x <= cx + 2; ++x) {
        constexpr int kFine = 64;
        double expected = 0;
        for (int j = 0; j < kFine; ++j) {
          for (int i = 0; i < kFine; ++i) {
            const double u = 2 * (x + (i + 0.5) / kFine) / n - 1;
            const double v = 2 * (y + (j + 0.5) / kFine) / n - 1;
            const Vec3 d = cube_direction({at.face, u, v});
            const double area = std::pow(2.0 / n / kFine, 2) * std::pow(1 + u * u + v * v, -1.5);
            expected += (exponent + 2) / (2 * kPi) *
                        std::pow(std::max(0.0, dot(d, mirror)), exponent) *
                        std::max(0.0, dot(d, normal)) * area;
          }
        }
        std::vector<float> weights(4);
        lobe.weights(cube_index(at.face, x, y, n), weights);
        double sum = 0;
        for (const float w : weights) {
          EXPECT_GE(w, 0.0f);
          sum += static_cast<double>(w);
        }
        // Spacing at most half a lobe width: the midpoint rule's error for one cell is
        // (1/4)/24 of the second derivative, about 1 % of the peak each way.
        EXPECT_NEAR(sum, expected, 0.02 * std::min(1.0, peak_texel));
      }
    }
  }
}

TEST(PhongLobe, NothingBelowTheHorizon) {
  const DirectionTable table(16, 4);
  const Vec3 normal{0, 1, 0};
  const PhongLobe lobe(table, normalize(Vec3{1, 0.05, 0}), normal, 50);
  std::vector<float> weights(4);
  for (std::size_t k = 0; k < table.texels(); ++k) {
    lobe.weights(k, weights);
    for (std::size_t s = 0; s < 4; ++s) {
      if (table.sample[4 * k + s].y <= 0) {
        EXPECT_EQ(weights[s], 0.0f);
      }
    }
  }
}

}  // namespace
}  // namespace haarlight
