// A sixteenth of all directions at a time.

#include "precompute/sparse_directions.h"

#include <gtest/gtest.h>

#include <vector>

#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

// Phases share the texels out between them, one of each 4x4 square, and counted 16-fold each covers
// the sphere on average.
TEST(SparseDirections, PhasesAreAPartition) {
  for (const int n : {4, 8, 64}) {
    const DirectionTable table(n, 2);
    const SparseDirections sparse(table);
    EXPECT_EQ(sparse.slots() % 8, 0u);
    std::vector<int> met(table.texels(), 0);
    double all = 0;
    for (int phase = 0; phase < SparseDirections::kPhases; ++phase) {
      std::vector<int> squares(table.texels(), 0);
      for (std::size_t slot = 0; slot < sparse.slots(); ++slot) {
        const std::int32_t texel = sparse.texels(phase)[slot];
        for (int s = 0; s < 2; ++s) {
          const auto& p = sparse.packets(phase, s)[slot / 8];
          const auto lane = slot % 8;
          EXPECT_NEAR(p.x[lane] * p.x[lane] + p.y[lane] * p.y[lane] + p.z[lane] * p.z[lane], 1,
                      1e-6);
          if (texel < 0) {
            EXPECT_EQ(p.weight[lane], 0.0f);
            continue;
          }
          const Vec3 d{static_cast<double>(p.x[lane]), static_cast<double>(p.y[lane]),
                       static_cast<double>(p.z[lane])};
          EXPECT_EQ(texel_of(d, n), static_cast<std::size_t>(texel));
          all += static_cast<double>(p.weight[lane]) / 2;
        }
        if (texel < 0) continue;
        ++met[static_cast<std::size_t>(texel)];
        const int x = texel % n, y = texel / n % n, face = texel / (n * n);
        ++squares[cube_index(face, x / 4, y / 4, n)];
      }
      for (const int count : squares) EXPECT_LE(count, 1);
    }
    for (const int count : met) EXPECT_EQ(count, 1);
    // 16 phases, each 16-fold: 16 spheres; weights are floats, sums of 12 n^2 of them.
    EXPECT_NEAR(all, 16 * 4 * kPi, 1e-3);
  }
}

}  // namespace
}  // namespace haarlight
