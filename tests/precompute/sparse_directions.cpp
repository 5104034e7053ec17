// A part of the sky at a time.

#include "precompute/sparse_directions.h"

#include <gtest/gtest.h>

#include <vector>

#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

// Squares of all phases are a partition of the texels; counted once for every phase they cover the
// sphere; and each direction lies in its square.
TEST(SparseDirections, SquaresAreAPartition) {
  struct Case {
    int n, resolution, phases;
  };
  for (const Case& c : {Case{4, 4, 1}, Case{8, 4, 1}, Case{32, 32, 16}, Case{64, 16, 4},
                        Case{64, 64, 64}, Case{16, 8, 1}}) {
    const DirectionTable table(c.n, 2);
    const SparseDirections sparse(table, c.resolution);
    EXPECT_EQ(sparse.phases(), c.phases);
    EXPECT_EQ(sparse.slots() % 8, 0u);
    const auto width = static_cast<std::size_t>(c.n / c.resolution);
    std::vector<int> texels_of(static_cast<std::size_t>(c.phases) * sparse.slots(), 0);
    std::vector<double> share_of(texels_of.size(), 0.0);
    for (std::size_t k = 0; k < table.texels(); ++k) {
      ++texels_of[static_cast<std::size_t>(sparse.square()[k])];
      share_of[static_cast<std::size_t>(sparse.square()[k])] +=
          static_cast<double>(sparse.share()[k]);
    }
    double sphere = 0;
    for (std::size_t at = 0; at < texels_of.size(); ++at) {
      const auto phase = static_cast<int>(at / sparse.slots());
      const std::size_t slot = at % sparse.slots();
      const bool padding = texels_of[at] == 0;
      if (!padding) {
        EXPECT_EQ(texels_of[at], static_cast<int>(width * width));
        EXPECT_NEAR(share_of[at], 1, 1e-6);
      }
      for (int place = 0; place < sparse.places(); ++place) {
        const auto& p = sparse.packets(phase, place)[slot / 8];
        const std::size_t lane = slot % 8;
        const Vec3 d{static_cast<double>(p.x[lane]), static_cast<double>(p.y[lane]),
                     static_cast<double>(p.z[lane])};
        EXPECT_NEAR(length(d), 1, 1e-6);
        if (padding) {
          EXPECT_EQ(p.weight[lane], 0.0f);
          continue;
        }
        EXPECT_EQ(static_cast<std::size_t>(sparse.square()[texel_of(d, c.n)]), at);
        if (place == 0) sphere += static_cast<double>(p.weight[lane]) / c.phases;
      }
    }
    EXPECT_NEAR(sphere, 4 * kPi, 1e-4);  // at most 24,576 floats of 4 pi together
  }
}

}  // namespace
}  // namespace haarlight
