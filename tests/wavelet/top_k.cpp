// Top-k: the k largest in a total order.

#include "wavelet/top_k.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

namespace haarlight {
namespace {

std::vector<int> by_sorting(const std::vector<float>& keys, int k) {
  std::vector<int> order(keys.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return keys[static_cast<std::size_t>(a)] > keys[static_cast<std::size_t>(b)];
  });
  std::erase_if(order, [&](int i) { return !(keys[static_cast<std::size_t>(i)] > 0); });
  order.resize(std::min(order.size(), static_cast<std::size_t>(k)));
  std::sort(order.begin(), order.end());
  return order;
}

TEST(TopK, EqualsSortingWithManyTies) {
  std::mt19937 random(5);
  TopK top;
  std::vector<int> chosen;
  for (int round = 0; round < 200; ++round) {
    std::vector<float> keys(static_cast<std::size_t>(random() % 500));
    for (float& key : keys) key = static_cast<float>(random() % 8);  // 0 included
    for (int k : {0, 1, 7, 30, 1000}) {
      top.select(keys, k, chosen);
      EXPECT_EQ(chosen, by_sorting(keys, k)) << "round " << round << " k=" << k;
    }
  }
}

TEST(TopK, NeverChoosesNothingOrNaN) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> keys{nan,    0.0f, -1.0f,
                                1e-45f, nan,  std::numeric_limits<float>::infinity()};
  TopK top;
  std::vector<int> chosen;
  top.select(keys, 6, chosen);
  EXPECT_EQ(chosen, (std::vector<int>{3, 5}));
}

}  // namespace
}  // namespace haarlight
