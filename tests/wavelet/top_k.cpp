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

// Thousands of keys, of which a sample says which are large: whether they are spread evenly, all
// the same, few, or so that the sample knows nothing of them.
TEST(TopK, EqualsSortingWhateverASampleSays) {
  std::mt19937 random(6);
  constexpr std::size_t kKeys = 6000;
  TopK top;
  RankedKeys ranked;
  std::vector<int> chosen;
  for (int kind = 0; kind < 5; ++kind) {
    std::vector<float> keys(kKeys);
    for (std::size_t i = 0; i < kKeys; ++i) {
      const auto u = static_cast<float>(random()) * 0x1p-32f;
      keys[i] = kind == 0   ? u
                : kind == 1 ? 1
                : kind == 2 ? (i % 700 == 3 ? u : 0)
                : kind == 3 ? (i % 16 == 0 ? 10 + u : u)                           // sampled: large
                            : (i % 16 == 0 ? u / 10 : std::pow(u, 20.0f) - 0.1f);  // small
    }
    for (const int k : {1, 30, 300, 500, 5999, 6000, 7000}) {
      top.select(keys, k, chosen);
      const std::vector<int> right = by_sorting(keys, k);
      EXPECT_EQ(chosen, right) << kind << " " << k;
      ranked.start(keys);
      std::vector<int> one_by_one;
      for (int i = 0; i < k; ++i) {
        if (const int index = ranked.next(); index >= 0) one_by_one.push_back(index);
      }
      std::sort(one_by_one.begin(), one_by_one.end());
      EXPECT_EQ(one_by_one, right) << kind << " " << k;
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

TEST(RankedKeys, GoThroughTheSameOrderOneByOne) {
  std::mt19937_64 random(7);
  RankedKeys ranked;
  TopK top_k;
  for (const int size : {1, 255, 256, 257, 2000}) {
    std::vector<float> keys(static_cast<std::size_t>(size));
    for (float& k : keys)
      k = static_cast<float>(random() % 50) - 5.0f;  // ties, zeros, negative ones
    ranked.start(keys);
    std::vector<int> so_far, chosen;
    float last = std::numeric_limits<float>::infinity();
    for (int index = ranked.next(); index >= 0; index = ranked.next()) {
      EXPECT_LE(keys[static_cast<std::size_t>(index)], last);
      last = keys[static_cast<std::size_t>(index)];
      so_far.insert(std::lower_bound(so_far.begin(), so_far.end(), index), index);
      top_k.select(keys, static_cast<int>(so_far.size()), chosen);
      EXPECT_EQ(so_far, chosen);
    }
    EXPECT_EQ(so_far.size(), static_cast<std::size_t>(std::count_if(
                                 keys.begin(), keys.end(), [](float k) { return k > 0; })));
    EXPECT_EQ(ranked.next(), -1);
  }
}

}  // namespace
}  // namespace haarlight
