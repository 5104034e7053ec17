// The kernel of step 2 against a plain sum.

#include "cpca/weight_kernel.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace haarlight {
namespace {

TEST(WeightKernel, EveryVersionIsTheSum) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const std::size_t vertices : {std::size_t{8}, std::size_t{24}, std::size_t{104}}) {
    for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{25}}) {
      std::vector<std::int16_t> weights(vertices * count);
      for (std::int16_t& w : weights) {
        w = static_cast<std::int16_t>(static_cast<int>(random() % 65535) - 32767);
      }
      std::vector<WeightTask> tasks(count);
      for (std::size_t t = 0; t < count; ++t) {
        tasks[t] = {weights.data() + t * vertices, {uniform(random), uniform(random), 1e6}};
      }
      std::vector<double> before(3 * vertices);
      for (double& s : before) s = uniform(random);
      for (const auto kernel : {add_weights, add_weights_portable}) {
        std::vector<double> sums = before;
        kernel(tasks, vertices, sums.data());
        for (std::size_t ch = 0; ch < 3; ++ch) {
          for (std::size_t v = 0; v < vertices; ++v) {
            long double right = static_cast<long double>(before[ch * vertices + v]), size = 1;
            for (const WeightTask& task : tasks) {
              const long double part = static_cast<long double>(task.factor[ch]) * task.weights[v];
              right += part;
              size += std::abs(part);
            }
            // Each of the additions, and a product without a fused one, rounds by 2^-53 of the
            // sizes that are there.
            EXPECT_NEAR(sums[ch * vertices + v], static_cast<double>(right),
                        static_cast<double>(size) * static_cast<double>(count + 1) * 0x1p-52);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace haarlight
