// The Haar transform: an orthonormal basis, numbered in bands.

#include "wavelet/haar.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "core/error.h"

namespace haarlight {
namespace {

std::vector<double> random_values(int count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> out(static_cast<std::size_t>(count));
  for (double& v : out) v = uniform(random);
  return out;
}

// Slow and plainly right: the coefficient as a sum over texels of the basis function written out.
double coefficient_by_definition(int n, const std::vector<double>& texels, int index) {
  const auto at = [&](int face, int y, int x) {
    return texels[static_cast<std::size_t>((face * n + y) * n + x)];
  };
  if (index < 6) {
    double sum = 0;
    for (int y = 0; y < n; ++y)
      for (int x = 0; x < n; ++x) sum += at(index, y, x);
    return sum / n;
  }
  int m = 1;
  while (index >= 24 * m * m) m *= 2;  // wavelets per face side at this level
  const int local = index - 6 * m * m;
  const int face = local / (3 * m * m), orientation = local / (m * m) % 3;
  const int wy = local / m % m, wx = local % m, side = n / m;
  double sum = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const int sx = x < side / 2 ? 1 : -1, sy = y < side / 2 ? 1 : -1;
      const int sign = orientation == 0 ? sx : orientation == 1 ? sy : sx * sy;
      sum += sign * at(face, wy * side + y, wx * side + x);
    }
  }
  return sum / side;  // 1 / sqrt(area) makes it orthonormal
}

TEST(HaarLayout, BandsPartitionTheCoefficients) {
  for (int n : {1, 2, 4, 8, 64, 1024}) {
    const HaarLayout layout(n);
    int next = 0;
    for (int b = 0; b < layout.band_count(); ++b) {
      const IndexRange range = layout.band(b);
      EXPECT_EQ(range.begin, next) << "n=" << n << " band " << b;
      next = range.end;
      for (int i : {range.begin, (range.begin + range.end) / 2, range.end - 1}) {
        EXPECT_EQ(layout.band_of(i), b) << "n=" << n << " index " << i;
      }
      EXPECT_EQ(layout.area(b) << (2 * b), n * n);
    }
    EXPECT_EQ(next, layout.size());
  }
  // Overbeck 2006, section 5.1: six bands of areas 4096 to 4 for 64 x 64 faces.
  const HaarLayout layout(64);
  EXPECT_EQ(layout.band_count(), 6);
  EXPECT_EQ(layout.band(0).end, 24);
  EXPECT_EQ(layout.area(0), 4096);
  EXPECT_EQ(layout.area(5), 4);
}

TEST(HaarLayout, RefusesAFaceSizeThatIsNoPowerOfTwo) {
  for (int n : {-4, 0, 3, 48, 2048}) {
    try {
      HaarLayout layout(n);
      FAIL() << "accepted " << n;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::invalid_argument);
      EXPECT_NE(std::string(error.what()).find(std::to_string(n)), std::string::npos);
    }
  }
}

TEST(Haar, EqualsTheBasisFunctionsWrittenOut) {
  for (int n : {1, 2, 8, 16}) {
    const HaarLayout layout(n);
    const auto texels = random_values(layout.size(), 7);
    std::vector<double> coefficients(texels.size());
    haar_forward(layout, std::span<const double>(texels), coefficients);
    for (int i = 0; i < layout.size(); ++i) {
      // n^2 terms below 1 in any order: n^2 * n^2 u / n is far above what is met.
      EXPECT_NEAR(coefficients[static_cast<std::size_t>(i)],
                  coefficient_by_definition(n, texels, i), 1e-13 * n)
          << "n=" << n << " index " << i;
    }
  }
}

TEST(Haar, InverseUndoesForward) {
  for (int n : {1, 2, 4, 64, 256}) {
    const HaarLayout layout(n);
    const auto texels = random_values(layout.size(), 11);
    std::vector<double> coefficients(texels.size()), back(texels.size());
    haar_forward(layout, std::span<const double>(texels), coefficients);
    haar_inverse(layout, std::span<const double>(coefficients), back);
    const double levels = std::log2(n);
    for (std::size_t i = 0; i < texels.size(); ++i) {
      // HARD_CASES-style bound: 24 log2 n u max|x| for the round trip.
      ASSERT_NEAR(back[i], texels[i], 24 * std::max(1.0, levels) * 0x1p-53);
    }
  }
}

TEST(Haar, FloatRoundTripOfASunBesideDarkness) {
  const HaarLayout layout(64);
  std::vector<float> texels(static_cast<std::size_t>(layout.size()), 0.001f);
  texels[100] = 1e6f;
  std::vector<float> coefficients(texels.size()), back(texels.size());
  haar_forward(layout, std::span<const float>(texels), coefficients);
  haar_inverse(layout, std::span<const float>(coefficients), back);
  const double bound = 24 * 6 * 0x1p-24 * 1e6;
  for (std::size_t i = 0; i < texels.size(); ++i) ASSERT_NEAR(back[i], texels[i], bound);
  // Light goes through double: the dark neighbour of the sun keeps what one rounding to float of
  // each of its 19 coefficients leaves, at most 19 u (1e6 / 2).
  std::vector<Rgb> light(texels.size()), light_coefficients(texels.size()),
      light_back(texels.size());
  for (std::size_t i = 0; i < texels.size(); ++i) light[i] = {texels[i], texels[i], texels[i]};
  haar_forward(layout, std::span<const Rgb>(light), light_coefficients);
  haar_inverse(layout, std::span<const Rgb>(light_coefficients), light_back);
  for (std::size_t i = 0; i < texels.size(); ++i) {
    ASSERT_NEAR(light_back[i].g, texels[i], 19 * 0x1p-24 * 0.5e6);
  }
}

TEST(Haar, ParsevalHolds) {
  for (int n : {1, 8, 64}) {
    const HaarLayout layout(n);
    const auto a = random_values(layout.size(), 3), b = random_values(layout.size(), 4);
    std::vector<double> ca(a.size()), cb(b.size());
    haar_forward(layout, std::span<const double>(a), ca);
    haar_forward(layout, std::span<const double>(b), cb);
    double plain = 0, transformed = 0, magnitude = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      plain += a[i] * b[i], transformed += ca[i] * cb[i], magnitude += a[i] * a[i] + b[i] * b[i];
    }
    EXPECT_NEAR(plain, transformed, 12 * std::max(1.0, std::log2(n)) * 0x1p-53 * magnitude)
        << "n=" << n;
  }
}

TEST(Haar, ConstantFacesHaveOneCoefficientEach) {
  const HaarLayout layout(64);
  std::vector<float> texels(static_cast<std::size_t>(layout.size()), 0.3f),
      coefficients(texels.size());
  haar_forward(layout, std::span<const float>(texels), coefficients);
  for (int i = 0; i < layout.size(); ++i) {
    if (i < 6) {
      EXPECT_FLOAT_EQ(coefficients[static_cast<std::size_t>(i)], 64 * 0.3f);
    } else {
      ASSERT_EQ(coefficients[static_cast<std::size_t>(i)], 0.0f) << i;  // a - a is exact
    }
  }
}

TEST(Haar, OneTexelTouchesThreeWaveletsALevel) {
  const HaarLayout layout(64);
  std::vector<float> texels(static_cast<std::size_t>(layout.size()), 0.0f),
      coefficients(texels.size());
  texels[2 * 4096 + 37 * 64 + 21] = 1;
  haar_forward(layout, std::span<const float>(texels), coefficients);
  int nonzero = 0;
  for (float c : coefficients) nonzero += c != 0.0f;
  EXPECT_EQ(nonzero, 3 * 6 + 1);
}

TEST(Haar, RefusesWrongLengths) {
  const HaarLayout layout(4);
  std::vector<float> right(96), wrong(95);
  EXPECT_THROW(haar_forward(layout, std::span<const float>(wrong), right), Error);
  EXPECT_THROW(haar_inverse(layout, std::span<const float>(right), wrong), Error);
}

}  // namespace
}  // namespace haarlight
