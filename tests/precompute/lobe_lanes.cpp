// Lobes and coats in single precision, eight at a time, against those of one direction in double.

#include "precompute/lobe_lanes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "precompute/ggx.h"

namespace haarlight {
namespace {

Vec3 any_direction(std::mt19937& engine) {
  std::normal_distribution<double> normal;
  for (;;) {
    const Vec3 v{normal(engine), normal(engine), normal(engine)};
    if (dot(v, v) > 1e-6) return normalize(v);
  }
}

Bsdf any_lobe(std::mt19937& engine, Bsdf::Lobe kind, double width) {
  Bsdf b;
  b.normal = b.geometric_normal = any_direction(engine);
  b.to_viewer = any_direction(engine);
  if (dot(b.to_viewer, b.normal) < 0) b.to_viewer = -b.to_viewer;
  b.lobe = kind;
  b.width = width;
  return b;
}

// Directions rounded to float, half of them where the lobe is.
struct Directions {
  std::vector<float> x, y, z;
  Directions(std::mt19937& engine, const Bsdf& b, std::size_t count) {
    std::uniform_real_distribution<double> even(0, 1);
    for (std::size_t i = 0; i < count; ++i) {
      Vec3 w = any_direction(engine);
      if (i % 2 == 0) {
        if (const auto s = b.sample_lobe(even(engine), even(engine))) w = s->direction;
      }
      x.push_back(static_cast<float>(w.x)), y.push_back(static_cast<float>(w.y));
      z.push_back(static_cast<float>(w.z));
    }
  }
  Vec3 at(std::size_t i) const {
    return {static_cast<double>(x[i]), static_cast<double>(y[i]), static_cast<double>(z[i])};
  }
};

// A lobe of width a changes by at most 2 / a of itself a radian of the half angle (GGX), or by its
// exponent (Phong, whose exp has the rounding of its argument for a factor, too). The half angle
// comes from three rounded vectors by some six operations: 20 roundings of 2^-24 at worst. At the
// foot of a lobe, rounding is of its peak. Where w and o nearly cancel, the half angle's direction
// has the rounding of both over their sum; where w grazes, so has its cosine.
TEST(LobeLanes, EqualLobesInDouble) {
  std::mt19937 engine(3);
  for (const auto& [kind, width] :
       std::initializer_list<std::pair<Bsdf::Lobe, double>>{{Bsdf::Lobe::ggx, 0.016},
                                                            {Bsdf::Lobe::ggx, 0.1},
                                                            {Bsdf::Lobe::ggx, 1},
                                                            {Bsdf::Lobe::phong, 0},
                                                            {Bsdf::Lobe::phong, 3.5},
                                                            {Bsdf::Lobe::phong, 80},
                                                            {Bsdf::Lobe::phong, 1000}}) {
    for (int k = 0; k < 20; ++k) {
      const Bsdf b = any_lobe(engine, kind, width);
      const Directions w(engine, b, 400);
      std::vector<float> first(400), second(400);
      lobe_values(b, 400, w.x.data(), w.y.data(), w.z.data(), first.data(), second.data());
      double peak = 0;
      for (std::size_t i = 0; i < 400; ++i) peak = std::max(peak, b.lobe_values(w.at(i)).first);
      const double steep = kind == Bsdf::Lobe::ggx ? 2 / width : std::max(2.0, width);
      for (std::size_t i = 0; i < 400; ++i) {
        const Bsdf::LobeValues v = b.lobe_values(w.at(i));
        const double half = kind == Bsdf::Lobe::ggx ? 0.5 * length(w.at(i) + b.to_viewer) : 1;
        const double grazing = 1 / std::max(1e-3, std::abs(dot(b.normal, w.at(i))));
        const double largest = std::max(v.first + v.second, 0.01 * peak);
        const double tolerance = 20 * 0x1p-24 * (steep / half + grazing) * largest + 1e-7;
        ASSERT_NEAR(static_cast<double>(first[i]), v.first, tolerance) << width << " " << i;
        ASSERT_NEAR(static_cast<double>(second[i]), v.second, tolerance) << width << " " << i;
      }
    }
  }
}

TEST(LobeLanes, LanesOfDifferentKindsKeepToThemselves) {
  std::mt19937 engine(4);
  LobeLanes lanes;
  std::vector<Bsdf> bsdf;
  std::vector<float> x, y, z;
  for (int i = 0; i < 21; ++i) {
    const auto kind = i % 3 == 0   ? Bsdf::Lobe::none
                      : i % 3 == 1 ? Bsdf::Lobe::ggx
                                   : Bsdf::Lobe::phong;
    bsdf.push_back(any_lobe(engine, kind, i % 3 == 1 ? 0.3 : 10));
    lanes.add(bsdf.back(), i != 13);
    const Directions w(engine, bsdf.back(), 1);
    x.push_back(w.x[0]), y.push_back(w.y[0]), z.push_back(w.z[0]);
  }
  EXPECT_EQ(lanes.size(), 21u);
  for (auto* v : {&x, &y, &z}) v->resize(24, 1.0f);
  std::vector<float> first(24, -1.0f), second(24, -1.0f);
  lanes.values(0, 24, x.data(), y.data(), z.data(), first.data(), second.data());
  for (std::size_t i = 0; i < 24; ++i) {
    Bsdf::LobeValues v;
    if (i < 21 && i != 13) {
      v = bsdf[i].lobe_values(
          {static_cast<double>(x[i]), static_cast<double>(y[i]), static_cast<double>(z[i])});
    }
    EXPECT_NEAR(static_cast<double>(first[i]), v.first, 1e-4 * v.first + 1e-6) << i;
    EXPECT_NEAR(static_cast<double>(second[i]), v.second, 1e-4 * v.second + 1e-6) << i;
  }
}

// The table is the one behind coat_albedo(), so that only single precision stands between them; a
// coat over a mirror (alpha 0) is interpolated, within 64^-2 / 8 of its second derivative by the
// square root of the cosine, at most 20.
TEST(CoatTables, EqualCoatsInDouble) {
  CoatTables tables;
  std::vector<std::int32_t> number;
  std::vector<float> cosine;
  std::vector<Bsdf> bsdf;
  std::mt19937 engine(5);
  std::uniform_real_distribution<float> even(0, 1);
  for (int i = 0; i < 200; ++i) {
    Bsdf b;
    b.coat_f0 = i % 4 == 0 ? 0 : 0.01 + 0.1 * (i % 3);
    b.width = 0.25 * (i % 5);
    number.push_back(tables.add(b));
    bsdf.push_back(b);
    cosine.push_back(i < 10 ? static_cast<float>(i) / 9 : even(engine));
  }
  EXPECT_EQ(tables.size(), 16u);  // none, and 3 reflectances of 5 widths
  std::vector<float> pass(200);
  tables.passing(number.data(), cosine.data(), 200, pass.data());
  for (std::size_t i = 0; i < 200; ++i) {
    const Bsdf& b = bsdf[i];
    const double expected =
        b.coat_f0 > 0 ? 1 - coat_albedo(static_cast<double>(cosine[i]), b.width, b.coat_f0) : 1;
    const double tolerance = b.width > 0 ? 3e-6 : 20.0 / 8 / 63 / 63;
    EXPECT_NEAR(static_cast<double>(pass[i]), expected, tolerance) << i;
    alignas(32) float one[8];
    std::fill_n(one, 8, cosine[i]);
    tables.passing(number[i], one, 8, one);
    EXPECT_NEAR(one[3], pass[i], 1e-6f) << i;
  }
}

}  // namespace
}  // namespace haarlight
