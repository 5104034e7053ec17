// How many vectors clusters get: what the choice is made from.

#include "cpca/vector_tuning.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace haarlight {
namespace {

constexpr std::size_t kVertices = 30, kColumns = 24, kVectors = 3;

// Random vectors and weights, in one channel or the same thrice; what is to be shown is what all
// vectors show and `rest` more.
ClusterBasis basis(int channels, double rest, const std::vector<std::vector<float>>& lightings,
                   unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  ClusterBasis out;
  out.channels = channels;
  out.count = kVectors;
  const auto parts = static_cast<std::size_t>(channels);
  std::vector<float> grey(kVectors * kColumns);
  for (std::size_t i = 0; i < kVectors; ++i) {
    for (std::size_t j = 0; j < kColumns; ++j) {
      // Of a size that the series of thresholds covers.
      grey[i * kColumns + j] = 0.01f * normal(random) / static_cast<float>(1 + 3 * i);
    }
  }
  for (std::size_t i = 0; i < kVectors; ++i) {
    for (std::size_t p = 0; p < parts; ++p) {
      out.vector.insert(out.vector.end(), grey.begin() + static_cast<std::ptrdiff_t>(i * kColumns),
                        grey.begin() + static_cast<std::ptrdiff_t>((i + 1) * kColumns));
    }
  }
  out.weight.resize(kVectors * kVertices);
  for (double& w : out.weight) w = static_cast<double>(normal(random));
  for (const auto& light : lightings) {
    for (std::size_t v = 0; v < kVertices; ++v) {
      double sum = rest;
      for (std::size_t i = 0; i < kVectors; ++i) {
        for (std::size_t j = 0; j < kColumns; ++j) {
          sum += out.weight[i * kVertices + v] *
                 static_cast<double>(grey[i * kColumns + j] * light[j]);
        }
      }
      out.exact.insert(out.exact.end(), parts, static_cast<float>(sum));
    }
  }
  return out;
}

std::vector<std::vector<float>> two_lightings() {
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  std::vector<std::vector<float>> out(2, std::vector<float>(kColumns));
  for (auto& light : out) {
    for (float& x : light) x = normal(random);
  }
  return out;
}

// A grey cluster stands for three equal channels: beside another cluster it weighs the same.
TEST(VectorTuning, GreyClustersWeighAsThreeChannels) {
  const auto lightings = two_lightings();
  const std::vector<double> sigma{1, 0.3, 0.1};
  VectorTuning grey(lightings), rgb(lightings);
  grey.add(grey.measured(basis(1, 0.02, lightings, 1), kVertices, sigma));
  rgb.add(rgb.measured(basis(3, 0.02, lightings, 1), kVertices, sigma));
  for (VectorTuning* tuning : {&grey, &rgb}) {
    tuning->add(tuning->measured(basis(3, 0, lightings, 2), kVertices, sigma));
  }
  for (const double cut : {0.05, 0.2, 0.5}) {
    const double error = rgb.basis_error(cut, kVectors);
    EXPECT_GT(error, 0.01);
    EXPECT_NEAR(grey.basis_error(cut, kVectors), error, 1e-9 * error);
  }
  EXPECT_EQ(grey.threshold_for(0.05, 0, kVectors), rgb.threshold_for(0.05, 0, kVectors));
}

TEST(VectorTuning, KeptAreTheEntriesAboveTheThreshold) {
  const auto lightings = two_lightings();
  VectorTuning tuning(lightings);
  const ClusterBasis b = basis(1, 0, lightings, 3);
  tuning.add(tuning.measured(b, kVertices, {1, 0.3, 0.1}));
  const VectorTuning::Kept all = tuning.kept(0, kVectors, 0);
  EXPECT_EQ(all.vectors, kVectors);
  EXPECT_EQ(all.entries, kVectors * kColumns);  // none of them is exactly 0
  const VectorTuning::Kept two = tuning.kept(0.2, kVectors, 0);
  EXPECT_EQ(two.vectors, 2);
  EXPECT_EQ(two.entries, 2 * kColumns);
  // By the root mean square of a block, here of all three vectors, and a series of thresholds a
  // factor sqrt(2) apart: what is kept is above the threshold.
  const float threshold = tuning.threshold_for(0.3, 0, kVectors);
  ASSERT_GT(threshold, 0);
  double above = 0;
  for (std::size_t j = 0; j < kColumns; ++j) {
    float energy = 0;
    for (std::size_t i = 0; i < kVectors; ++i) {
      energy += b.vector[i * kColumns + j] * b.vector[i * kColumns + j];
    }
    if (std::sqrt(energy / kVectors) >= threshold) above += double{kVectors};
  }
  const VectorTuning::Kept some = tuning.kept(0, kVectors, threshold);
  EXPECT_EQ(some.entries, above);
  EXPECT_LT(some.entries, all.entries);
}

}  // namespace
}  // namespace haarlight
