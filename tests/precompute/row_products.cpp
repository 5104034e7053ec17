// The matrix product of paths and rows, and the colour of a row.

#include "precompute/row_products.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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

TEST(RowProducts, EqualsThePlainSum) {
  constexpr std::size_t kRows = 12, kLength = 40;
  for (const std::size_t count : {0u, 1u, 7u, 130u}) {
    const auto weight = random_values(count * kRows, 1);
    const auto values = random_values(count * kLength, 2);
    std::vector<const float*> columns;
    for (std::size_t k = 0; k < count; ++k) columns.push_back(values.data() + k * kLength);
    auto sum = random_values(kRows * kLength, 3);
    const auto before = sum;
    add_row_products(weight.data(), columns, kRows, kLength, sum.data());
    for (std::size_t m = 0; m < kRows; ++m) {
      for (std::size_t j = 0; j < kLength; ++j) {
        double expected = static_cast<double>(before[m * kLength + j]);
        for (std::size_t k = 0; k < count; ++k) {
          expected += static_cast<double>(weight[k * kRows + m]) *
                      static_cast<double>(values[k * kLength + j]);
        }
        // count + 1 terms of at most 1, each sum and product rounded: (count + 1)^2 2^-24 at worst.
        const double n = static_cast<double>(count) + 1;
        ASSERT_NEAR(static_cast<double>(sum[m * kLength + j]), expected, n * n * 0x1p-24);
      }
    }
  }
}

TEST(RowProducts, DotProductEqualsThePlainSum) {
  const auto a = random_values(384, 5), b = random_values(384, 6);
  double expected = 0;
  for (std::size_t j = 0; j < a.size(); ++j) {
    expected += static_cast<double>(a[j]) * static_cast<double>(b[j]);
  }
  // Eight sums of 48 terms of at most 1 each, then eight more.
  EXPECT_NEAR(static_cast<double>(dot_product(a.data(), b.data(), 384)), expected,
              384 * 57 * 0x1p-24);
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
