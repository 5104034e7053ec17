// The matrix product of paths and rows, and the colour of a row.

#include "precompute/row_products.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <span>

#include "precompute/row_color.h"

namespace haarlight {
namespace {

std::vector<float> random_values(std::size_t count, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<float> any(-1, 1);
  std::vector<float> values(count);
  for (float& v : values) v = any(engine);
  return values;
}

// Some packets of columns are off: what they hold must not count, whatever it is.
TEST(RowProducts, EqualsThePlainSumOverPacketsThatAreOn) {
  constexpr std::size_t kRows = 12, kLength = 40, kStride = 56;
  std::mt19937 engine(11);
  for (const std::size_t count : {0u, 1u, 7u, 130u}) {
    const auto weight = random_values(count * kRows, 1);
    auto values = random_values(count * kLength, 2);
    std::vector<SparseColumn> columns;
    for (std::size_t k = 0; k < count; ++k) {
      columns.push_back({values.data() + k * kLength, engine() & 0x1fu});
    }
    const auto on = [&](std::size_t k, std::size_t j) {
      return columns[k].packets >> (j / 8) & 1u;
    };
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!on(i / kLength, i % kLength)) values[i] = std::numeric_limits<float>::quiet_NaN();
    }
    auto sum = random_values(kRows * kStride, 3);
    const auto before = sum;
    add_row_products(weight.data(), columns, kRows, kLength, sum.data(), kStride);
    for (std::size_t m = 0; m < kRows; ++m) {
      for (std::size_t j = 0; j < kStride; ++j) {
        double expected = static_cast<double>(before[m * kStride + j]);
        for (std::size_t k = 0; j < kLength && k < count; ++k) {
          if (!on(k, j)) continue;
          expected += static_cast<double>(weight[k * kRows + m]) *
                      static_cast<double>(values[k * kLength + j]);
        }
        // count + 1 terms of at most 1, each sum and product rounded: (count + 1)^2 2^-24 at worst.
        const double n = static_cast<double>(count) + 1;
        ASSERT_NEAR(static_cast<double>(sum[m * kStride + j]), expected, n * n * 0x1p-24);
      }
    }
  }
}

TEST(RowProducts, PartsOfARow) {
  const auto a = random_values(40, 5), b = random_values(40, 6), c = random_values(40, 7);
  const RowPart part[3] = {{a.data(), 0.5f}, {b.data(), -2}, {c.data(), 3}};
  for (std::size_t parts = 1; parts <= 3; ++parts) {
    for (const bool keep : {false, true}) {
      auto sum = random_values(40, 8);
      const auto before = sum;
      add_row_parts(std::span(part).first(parts), 40, keep, sum.data());
      for (std::size_t j = 0; j < 40; ++j) {
        float expected = keep ? before[j] : 0;
        const float term[3] = {0.5f * a[j], -2 * b[j], 3 * c[j]};
        for (std::size_t i = 0; i < parts; ++i) expected += term[i];
        ASSERT_NEAR(sum[j], expected, 4 * 6.5 * 0x1p-24);  // terms and sums of at most 6.5
      }
    }
  }
}

// Both forms, and adding to what is there; eight sums of at most 48 terms of at most 1 each, then
// eight more, and one.
TEST(RowProducts, DotProductsEqualThePlainSum) {
  constexpr std::size_t kLights = 8, kPackets = 48;
  const auto value = random_values(8 * kPackets, 5),
             light = random_values(8 * kPackets * kLights, 6);
  const std::uint64_t some = 0x0000a5f0c3961234u;
  const std::uint64_t every = (std::uint64_t{1} << kPackets) - 1;
  for (const std::uint64_t packets : {some, every}) {
    std::vector<float> out(kLights, 0.25f);
    if (packets == every) {
      add_dot_products(value.data(), kPackets, light.data(), kLights, out.data());
    } else {
      add_dot_products({value.data(), packets}, light.data(), kLights, out.data());
    }
    for (std::size_t l = 0; l < kLights; ++l) {
      double expected = 0.25;
      for (std::size_t j = 0; j < 8 * kPackets; ++j) {
        if (!(packets >> (j / 8) & 1u)) continue;
        expected += static_cast<double>(value[j]) *
                    static_cast<double>(light[(j / 8 * kLights + l) * 8 + j % 8]);
      }
      EXPECT_NEAR(static_cast<double>(out[l]), expected, 384 * 58 * 0x1p-24);
    }
  }
}

TEST(RowProducts, LightOfPathsInRows) {
  constexpr std::size_t kRows = 16, kLights = 8, kPaths = 30, kStride = 20;
  const auto weight = random_values(kPaths * kRows, 1), light = random_values(kPaths * kLights, 2);
  std::vector<PathLight> paths;
  for (std::size_t k = 0; k < kPaths; ++k) {
    paths.push_back({weight.data() + k * kRows, light.data() + k * kLights});
  }
  std::vector<float> sum(kLights * kStride, 1.0f);
  add_light_products(paths, kRows, kLights, sum.data(), kStride);
  for (std::size_t l = 0; l < kLights; ++l) {
    for (std::size_t m = 0; m < kStride; ++m) {
      double expected = 1;
      for (std::size_t k = 0; m < kRows && k < kPaths; ++k) {
        expected += static_cast<double>(weight[k * kRows + m]) *
                    static_cast<double>(light[k * kLights + l]);
      }
      EXPECT_NEAR(static_cast<double>(sum[l * kStride + m]), expected, 31 * 31 * 0x1p-24);
    }
  }
}

TEST(RowColor, FindsTheColorOfARowThatHasOne) {
  const auto grey = random_values(300, 4);
  const RgbD color{0.2, 1, 0.05};
  std::vector<float> r, g, b;
  for (const float v : grey) {
    r.push_back(static_cast<float>(color.r) * v);
    g.push_back(static_cast<float>(color.g) * v);
    b.push_back(static_cast<float>(color.b) * v);
  }
  const ColorFit fit = fit_color(r.data(), g.data(), b.data(), r.size());
  EXPECT_LT(fit.residual, 1e-3);  // root of a difference of two equal numbers: sqrt(2^-24)
  EXPECT_NEAR(fit.color.r, 0.2, 1e-6);
  EXPECT_EQ(fit.color.g, 1);
  EXPECT_NEAR(fit.color.b, 0.05, 1e-6);
  to_grey(fit.color, r.data(), g.data(), b.data(), r.size());
  for (std::size_t k = 0; k < grey.size(); ++k) EXPECT_NEAR(r[k], grey[k], 1e-5f);
}

// Two orthogonal grey rows in two channels, norms 2 and 1: the better fit keeps the first and
// leaves out 1 of 5 in energy.
TEST(RowColor, LeavesOutTheLesserOfTwoColors) {
  std::vector<float> r{2, 0, 0, 0}, g{0, 1, 0, 0}, b(4, 0.0f);
  const ColorFit fit = fit_color(r.data(), g.data(), b.data(), 4);
  EXPECT_NEAR(fit.residual, std::sqrt(0.2), 1e-6);
  EXPECT_NEAR(fit.color.r, 1, 1e-6);
  EXPECT_NEAR(fit.color.g, 0, 1e-6);
}

TEST(RowColor, AnEmptyRowHasNone) {
  std::vector<float> zero(8, 0.0f);
  const ColorFit fit = fit_color(zero.data(), zero.data(), zero.data(), 8);
  EXPECT_EQ(l1_norm(fit.color), 0);
  EXPECT_EQ(fit.residual, 0);
}

}  // namespace
}  // namespace haarlight
