// The direction table: every texel once, exact solid angles, bounds that hold, seams that touch.

#include "precompute/direction_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

Vec3 vec(float x, float y, float z) {
  return {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
}

TEST(TexelPlaces, OneInEachColumnAndRowMiddleFirst) {
  for (const int count : {1, 2, 3, 4, 7, 16, 64}) {
    const auto places = texel_places(count);
    ASSERT_EQ(places.size(), static_cast<std::size_t>(count));
    std::set<int> columns, rows;
    const auto off = [](const TexelPlace& p) { return std::hypot(p.u - 0.5, p.v - 0.5); };
    for (const TexelPlace& p : places) {
      columns.insert(static_cast<int>(p.u * count));
      rows.insert(static_cast<int>(p.v * count));
      EXPECT_GT(std::min({p.u, p.v, 1 - p.u, 1 - p.v}), 0);
      EXPECT_LE(off(places[0]), off(p));
    }
    EXPECT_EQ(columns.size(), static_cast<std::size_t>(count));
    EXPECT_EQ(rows.size(), static_cast<std::size_t>(count));
  }
}

TEST(DirectionTable, SamplesLieInTheirTexelAndShareItsSolidAngle) {
  for (const int n : {4, 16, 64}) {
    const DirectionTable table(n, 4);
    double total = 0;
    for (std::size_t k = 0; k < table.texels(); ++k) {
      double sum = 0;
      Vec3 moment;
      for (std::size_t s = 0; s < 4; ++s) {
        const DirectionTable::Sample& d = table.sample[4 * k + s];
        const Vec3 direction = vec(d.x, d.y, d.z);
        const CubePoint at = cube_point(direction);
        ASSERT_EQ(cube_index(at.face, cube_texel(at.u, n), cube_texel(at.v, n), n), k);
        sum += static_cast<double>(d.solid_angle);
        moment = moment + static_cast<double>(d.solid_angle) * direction;
      }
      const auto size = static_cast<std::size_t>(n);
      const double exact =
          cube_texel_solid_angle(static_cast<int>(k % size), static_cast<int>(k / size % size), n);
      // Four shares rounded to float: relative error at most 2^-24.
      EXPECT_NEAR(sum, exact, 1e-7 * exact);
      // Directions and shares rounded to float, then the sum: three roundings.
      EXPECT_NEAR(length(moment - vec(table.moment_x[k], table.moment_y[k], table.moment_z[k])), 0,
                  4e-7 * exact);
      total += sum;
    }
    EXPECT_NEAR(total, 4 * kPi, 1e-7 * 4 * kPi);
  }
}

TEST(DirectionTable, PacketsCoverEveryTexelOnceWithinTheirBounds) {
  for (const int n : {4, 8, 64}) {
    const DirectionTable table(n, 4);
    std::vector<int> seen(table.texels(), 0);
    std::int32_t next = 0;
    for (const DirectionTable::Group& g : table.group) {
      EXPECT_EQ(g.first, next);
      next += g.count;
      for (std::int32_t j = g.first; j < g.first + g.count; ++j) {
        const DirectionTable::Packet& p = table.packet[static_cast<std::size_t>(j)];
        for (int lane = 0; lane < 8; ++lane) {
          const int texel = (lane < 4 ? p.top : p.bottom) + lane % 4;
          ++seen[static_cast<std::size_t>(texel)];
          for (std::size_t s = 0; s < 4; ++s) {
            const auto& d = table.sample[4 * static_cast<std::size_t>(texel) + s];
            const Vec3 direction = vec(d.x, d.y, d.z);
            EXPECT_LE(length(direction - vec(g.x, g.y, g.z)), static_cast<double>(g.radius));
            EXPECT_LE(length(direction - vec(p.cx[lane], p.cy[lane], p.cz[lane])),
                      static_cast<double>(p.radius));
            if (s == 0) {
              EXPECT_EQ(direction, vec(p.x[lane], p.y[lane], p.z[lane]));
            }
          }
        }
      }
    }
    EXPECT_EQ(next, static_cast<std::int32_t>(table.packet.size()));
    EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](int c) { return c == 1; }));
  }
}

TEST(DirectionTable, SeamsJoinTouchingTexelsOfDifferentFaces) {
  for (const int n : {4, 16, 64}) {
    const DirectionTable table(n, 1);
    const auto size = static_cast<std::size_t>(n);
    EXPECT_EQ(table.seam.size(), 12 * size);
    const std::set<std::array<std::int32_t, 2>> unique(table.seam.begin(), table.seam.end());
    EXPECT_EQ(unique.size(), table.seam.size());
    const auto center = [&](std::int32_t k) {
      const auto t = static_cast<std::size_t>(k);
      return cube_texel_center(static_cast<int>(t / (size * size)), static_cast<int>(t % size),
                               static_cast<int>(t / size % size), n);
    };
    for (const auto& [a, b] : table.seam) {
      EXPECT_NE(a / (n * n), b / (n * n));
      // Each centre is half a texel (1 / n) from the shared edge, the faces meeting there squarely.
      EXPECT_LE(length(center(a) - center(b)), 2.0 / n);
      const Vec3 ca = center(a), cb = center(b);
      // The shared edge is the mirror plane between the faces: swapping the two axes maps one
      // centre to the other, so sorted absolute coordinates agree.
      std::array<double, 3> pa{std::abs(ca.x), std::abs(ca.y), std::abs(ca.z)};
      std::array<double, 3> pb{std::abs(cb.x), std::abs(cb.y), std::abs(cb.z)};
      std::sort(pa.begin(), pa.end());
      std::sort(pb.begin(), pb.end());
      for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(pa[i], pb[i], 1e-12);
    }
  }
}

}  // namespace
}  // namespace haarlight
