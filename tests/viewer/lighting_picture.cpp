// Flat pictures of cube maps, and which texels a wavelet lies over.

#include "viewer/lighting_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace haarlight::viewer {
namespace {

// A wavelet lies over the texels where the inverse transform of its coefficient is not zero.
TEST(CountTouched, CountsTheSupportOfEveryWavelet) {
  const HaarLayout layout(8);
  const auto size = static_cast<std::size_t>(layout.size());
  std::vector<double> one(size), texels(size);
  std::vector<std::uint16_t> counts, all(size);
  LightingUpdate every;
  for (int j = 0; j < layout.size(); ++j) {
    std::fill(one.begin(), one.end(), 0.0);
    one[static_cast<std::size_t>(j)] = 1;
    haar_inverse(layout, std::span<const double>(one), std::span(texels));
    LightingUpdate update;
    update.deltas.push_back({j, {1, 1, 1}});
    every.deltas.push_back({j, {1, 1, 1}});
    count_touched(layout, update, counts);
    for (std::size_t t = 0; t < size; ++t) {
      ASSERT_EQ(counts[t], texels[t] != 0 ? 1 : 0) << "coefficient " << j << " texel " << t;
      all[t] = static_cast<std::uint16_t>(all[t] + counts[t]);
    }
  }
  count_touched(layout, every, counts);
  EXPECT_EQ(counts, all);
}

TEST(UnfoldedCube, TheCrossShowsEveryTexelOnceAtItsOwnSize) {
  const UnfoldedCube cross(Unfolding::cross, 8, 32);
  std::vector<int> seen(6 * 64);
  int empty = 0;
  for (const int texel : cross.texels()) {
    if (texel < 0) {
      ++empty;
    } else {
      ++seen[static_cast<std::size_t>(texel)];
    }
  }
  EXPECT_EQ(empty, 6 * 64);  // six of the twelve squares hold no face
  EXPECT_TRUE(std::all_of(seen.begin(), seen.end(), [](int count) { return count == 1; }));
}

TEST(UnfoldedCube, LatlongLooksWhereEnvironmentsDo) {
  const UnfoldedCube flat(Unfolding::latlong, 4, 64);
  const auto face = [&](int x, int y) {
    return flat.texels()[static_cast<std::size_t>(y * flat.width() + x)] / 16;
  };
  EXPECT_EQ(face(64, 32), 5);  // the middle is -Z
  EXPECT_EQ(face(96, 32), 0);  // +X to the right
  EXPECT_EQ(face(32, 32), 1);
  EXPECT_EQ(face(0, 32), 4);
  EXPECT_EQ(face(50, 0), 2);
  EXPECT_EQ(face(50, 63), 3);
}

TEST(DrawCubemap, ShowsExposedRadianceAndTints) {
  const UnfoldedCube cross(Unfolding::cross, 1, 4);
  Cubemap map(1);
  for (Rgb& c : map.texels) c = {0.25f, 0, 8};
  std::vector<std::uint8_t> rgba;
  draw_cubemap(cross, map, 1, {}, rgba);
  const auto first = [&](std::size_t from) {
    std::size_t i = from;
    while (rgba[4 * i + 3] == 0) ++i;
    return i;
  };
  const std::size_t i = first(0);
  // 0.5 in sRGB is 187.5; the table rounds by less than a byte.
  EXPECT_NEAR(rgba[4 * i], 187.5, 1);
  EXPECT_EQ(rgba[4 * i + 1], 0);
  EXPECT_EQ(rgba[4 * i + 2], 255);
  std::vector<std::uint16_t> touched(6, 0);
  touched[static_cast<std::size_t>(cross.texels()[i])] = 50;
  draw_cubemap(cross, map, 1, touched, rgba);
  // Four fifths of (255, 140, 30) over what was there, rounded.
  EXPECT_NEAR(rgba[4 * i], 0.2 * 187.5 + 0.8 * 255, 1);
  EXPECT_NEAR(rgba[4 * i + 1], 0.8 * 140, 1);
  const std::vector<std::uint16_t> everywhere(6, 3);
  std::vector<std::uint8_t> plain, same;
  draw_cubemap(cross, map, 1, {}, plain);
  draw_cubemap(cross, map, 1, everywhere, same);
  EXPECT_EQ(same, plain);
}

}  // namespace
}  // namespace haarlight::viewer
