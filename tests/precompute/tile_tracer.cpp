// Rows of a tile against a plain reference, and what must not change them.

#include "precompute/tile_tracer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "core/error.h"
#include "prt/transport_writer.h"
#include "tests/precompute/shapes.h"
#include "tests/reference/ray_triangle.h"
#include "wavelet/cubemap.h"

namespace haarlight {
namespace {

Camera camera_at(const Vec3& from, const Vec3& to, int size) {
  return look_at(from, to, 0.8, size, size);
}

// A ball and a box on a ground, and a picture of 8x8 pixels: one tile.
Scene still_life() {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-3, 0, -3}, {0, 0, 6}, {6, 0, 0});
  shapes::add_sphere(scene, {-0.5, 0.5, 0}, 0.5, 3);
  shapes::add_box(scene, {0.3, 0, -0.3}, {0.8, 0.9, 0.4});
  return scene;
}

TileRows rows_of(const Scene& scene, const Camera& camera, const TraceOptions& options,
                 std::size_t tile = 0, RayCounts* counts = nullptr) {
  const Visibility visibility(scene);
  const TileTracer tracer(scene, visibility, camera, options);
  const auto order = image_row_order(camera.width, camera.height);
  TileTracer::Scratch scratch;
  TileRows rows;
  RayCounts local;
  tracer.trace(std::span<const std::uint32_t>(order).subspan(tile * kTileRows, kTileRows), scratch,
               rows, counts ? *counts : local);
  return rows;
}

TileRows rows_of_picture(const Scene& scene, const TraceOptions& options) {
  return rows_of(scene, camera_at({0.5, 1.5, 3}, {0, 0.3, 0}, 8), options);
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

// t[k] = sum over samples V max(0, n.w) / pi dw, every ray by brute force in double, transformed in
// double: nothing shared with the tracer but the places in a texel.
TEST(TileTracer, RowsMatchBruteForce) {
  const Scene scene = still_life();
  const Camera camera = camera_at({0.5, 1.5, 3}, {0, 0.3, 0}, 8);
  TraceOptions options;
  options.face_size = 8;
  options.spp = 4;
  options.adaptive = false;
  options.pixel_samples = 1;
  const TileRows rows = rows_of(scene, camera, options);
  EXPECT_EQ(rows.rgb_blocks, 0u);

  const Visibility visibility(scene);
  const auto order = image_row_order(8, 8);
  const HaarLayout layout(8);
  const auto size = static_cast<std::size_t>(layout.size());
  const auto places = texel_places(4);
  int covered = 0;
  for (std::size_t row = 0; row < kTileRows; ++row) {
    const auto pixel = static_cast<int>(order[row]);
    const Vec3 eye = visibility.to_local(camera.position);
    const Vec3 towards = camera.direction(pixel % 8 + 0.5, pixel / 8 + 0.5);
    const auto seen = reference::trace(visibility, eye, towards);
    EXPECT_EQ(rows.coverage[row], seen.blocked ? 1.0f : 0.0f);
    const std::span<const float> values(rows.values.data() + row * size, size);
    if (!seen.blocked) {
      for (const float v : values) EXPECT_EQ(v, 0.0f);
      continue;
    }
    ++covered;
    EXPECT_EQ(rows.color[row], (Rgb{0.5f, 0.5f, 0.5f}));
    // Normals are not the reference's business: those of the tracer's own hit.
    RayCounts counts;
    TileReceivers seen_by_tracer;
    TileTracer(scene, visibility, camera, options)
        .pixels()
        .sample(pixel % 8, pixel / 8, 0, seen_by_tracer, counts);
    ASSERT_EQ(seen_by_tracer.receivers.size(), 1u);
    const ShadingPoint p = shading_point(seen_by_tracer.receivers[0]);
    const Vec3 origin{static_cast<double>(p.origin[0]), static_cast<double>(p.origin[1]),
                      static_cast<double>(p.origin[2])};
    EXPECT_NEAR(length(origin - (eye + seen.nearest * towards)), 0, 2e-5);

    std::vector<double> texels(size, 0.0), expected(size);
    double doubtful = 0;  // what rays near a border may add or take away
    for (std::size_t k = 0; k < size; ++k) {
      const int face = static_cast<int>(k / 64), y = static_cast<int>(k / 8 % 8),
                x = static_cast<int>(k % 8);
      double total = 0, densities[4];
      for (std::size_t s = 0; s < 4; ++s) {
        const double u = 2 * (x + places[s].u) / 8 - 1, v = 2 * (y + places[s].v) / 8 - 1;
        total += densities[s] = std::pow(1 + u * u + v * v, -1.5);
      }
      for (std::size_t s = 0; s < 4; ++s) {
        const Vec3 w =
            cube_direction({face, 2 * (x + places[s].u) / 8 - 1, 2 * (y + places[s].v) / 8 - 1});
        const double weight = std::max(0.0, dot(p.normal, w)) / kPi *
                              cube_texel_solid_angle(x, y, 8) * densities[s] / total;
        if (weight == 0 || dot(p.geometric_normal, w) <= 0) continue;
        const auto way = reference::trace(visibility, origin, w);
        if (way.margin < 1e-5) doubtful += weight;
        if (!way.blocked) texels[k] += weight;
      }
    }
    haar_forward(layout, texels, expected);
    for (std::size_t j = 0; j < size; ++j) {
      // Float: a dozen roundings of terms that add up to at most 1 / n^2 of the sky each.
      EXPECT_NEAR(static_cast<double>(values[j]), expected[j], 1e-6 + doubtful)
          << "row " << row << " coefficient " << j;
    }
    EXPECT_LT(doubtful, 0.05);
  }
  EXPECT_GT(covered, 32);
}

TEST(TileTracer, ScaleByPowersOfTwoChangesNoBit) {
  const Scene scene = still_life();
  TraceOptions options;
  options.face_size = 16;
  const Vec3 from{0.5, 1.5, 3}, to{0, 0.3, 0};
  const TileRows plain = rows_of(scene, camera_at(from, to, 8), options);
  for (const int exponent : {-20, 20}) {
    const double scale = std::ldexp(1.0, exponent);
    const TileRows scaled =
        rows_of(shapes::moved(scene, scale, {}), camera_at(scale * from, scale * to, 8), options);
    EXPECT_TRUE(same_bits(plain.values, scaled.values)) << exponent;
    EXPECT_TRUE(same_bits(plain.coverage, scaled.coverage)) << exponent;
    EXPECT_EQ(plain.color, scaled.color) << exponent;
  }
}

TEST(TileTracer, EqualPointsGiveEqualRows) {
  // The same quad twice in the same place, and the second one the other way round.
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-3, 0, -3}, {0, 0, 6}, {6, 0, 0});
  Scene twice = scene;
  shapes::add_quad(twice, {-3, 0, -3}, {6, 0, 0}, {0, 0, 6});
  TraceOptions options;
  options.face_size = 16;
  EXPECT_TRUE(
      same_bits(rows_of_picture(scene, options).values, rows_of_picture(twice, options).values));
}

TEST(TileTracer, BlocksAreGreyWhereOneColorFactorsOut) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-9, 0, -9}, {0, 0, 18}, {9, 0, 0}, 0);  // left half
  shapes::add_quad(scene, {0, 0, -9}, {0, 0, 18}, {9, 0, 0}, 1);   // right half
  scene.material[0].albedo = {0.8f, 0.2f, 0.1f};
  scene.material.push_back(scene.material[0]);
  TraceOptions options;
  options.face_size = 8;
  // Looking down along the seam, which runs through the middle of pixel columns 3 and 4's border
  // shifted by a third of a pixel: blocks on both sides, column 3 or 4 mixed.
  const Camera camera = camera_at({0.05, 4, 0.001}, {0.05, 0, 0}, 8);

  EXPECT_EQ(rows_of(scene, camera, options).rgb_blocks, 0u);  // two materials, one colour

  scene.material[1].albedo = {0.4f, 0.1f, 0.05f};  // half as bright, the same colour
  const TileRows shades = rows_of(scene, camera, options);
  EXPECT_EQ(shades.rgb_blocks, 0u);

  // Two colours that see the same sky still are one grey row a pixel, whatever the mixture.
  scene.material[1].albedo = {0.1f, 0.2f, 0.8f};
  const TileRows level = rows_of(scene, camera, options);
  EXPECT_EQ(level.rgb_blocks, 0u);

  // A roof of two colours: what lies left and right of the ridge sees different skies.
  Scene roof = scene;
  for (const std::size_t v : {0u, 1u}) roof.position[v].y = -6;
  for (const std::size_t v : {6u, 7u}) roof.position[v].y = -6;
  const TileRows mixed = rows_of(roof, camera, options);
  EXPECT_NE(mixed.rgb_blocks, 0u);
  EXPECT_NE(mixed.rgb_blocks, 15u);

  // Whatever the storage, a pixel of the level ground under an even sky of 1 is its mean albedo.
  const auto size = static_cast<std::size_t>(HaarLayout(8).size());
  for (std::size_t row = 0; row < kTileRows; ++row) {
    // Texel sum = n * (sum of the six scaling coefficients).
    double sum = 0;
    for (std::size_t face = 0; face < 6; ++face) {
      sum += 8 * static_cast<double>(level.values[row * size + face]);
    }
    const RgbD shown = RgbD(level.color[row]) * sum;
    // r + b is 0.9 on both sides, g 0.2 on both.
    EXPECT_NEAR(shown.r + shown.b, 0.9, 0.01);
    EXPECT_NEAR(shown.g, 0.2, 0.002);
    EXPECT_TRUE(mixed.rgb_blocks >> (row / kBlockRows) & 1u ||
                (mixed.color[row].r > 0.5f) != (mixed.color[row].b > 0.5f));
  }
}

TEST(TileTracer, GlossyColorsNeedThreeChannelsUnlessProportional) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-9, 0, -9}, {0, 0, 18}, {18, 0, 0});
  TraceOptions options;
  options.face_size = 8;
  scene.material[0].albedo = {0.4f, 0.2f, 0.1f};
  scene.material[0].specular = {0.2f, 0.1f, 0.05f};
  const TileRows grey = rows_of_picture(scene, options);
  EXPECT_EQ(grey.rgb_blocks, 0u);
  scene.material[0].specular = {0.1f, 0.1f, 0.1f};
  const TileRows rgb = rows_of_picture(scene, options);
  EXPECT_NE(rgb.rgb_blocks, 0u);
  scene.material[0].specular = {0, 0, 0};
  const TileRows matte = rows_of_picture(scene, options);
  EXPECT_EQ(matte.rgb_blocks, 0u);

  // colour * grey row == the row of the channels; matte + lobe, so grey - matte is a lobe of
  // (0.2, 0.1, 0.05) and rgb - matte one of 0.1 in each channel: their ratio is 2, 1, 1/2.
  const auto size = static_cast<std::size_t>(HaarLayout(8).size());
  double lobes = 0;  // the largest entry that is not Lambert's
  for (std::size_t row = 0; row < kTileRows; ++row) {
    if (grey.coverage[row] == 0) continue;
    if (!(rgb.rgb_blocks >> (row / kBlockRows) & 1u)) continue;
    const auto& color = grey.color[row];
    const float grey_color[3] = {color.r, color.g, color.b};
    const auto& matte_color_rgb = matte.color[row];
    const float matte_color[3] = {matte_color_rgb.r, matte_color_rgb.g, matte_color_rgb.b};
    const double ratio[3] = {2, 1, 0.5};
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t j = 0; j < size; j += 7) {
        const std::size_t at = row * size + j;
        const double base = static_cast<double>(matte_color[c] * matte.values[at]);
        const double proportional = static_cast<double>(grey_color[c] * grey.values[at]) - base;
        const double even =
            static_cast<double>(rgb.values[(c * kTileRows + row) * size + j]) - base;
        EXPECT_NEAR(proportional, ratio[c] * even, 1e-6);
        lobes = std::max(lobes, std::abs(even));
      }
    }
  }
  EXPECT_GT(lobes, 1e-3);
}

TEST(TileTracer, CoverageIsTheShareOfHits) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-1, 0, -9}, {0, 0, 18}, {1, 0, 0});  // ends at x = 0
  TraceOptions options;
  options.face_size = 4;
  options.pixel_samples = 16;
  const TileRows rows = rows_of(scene, camera_at({0.03, 4, 0.001}, {0.03, 0, 0}, 8), options);
  int part = 0;
  for (const float c : rows.coverage) {
    EXPECT_EQ(c * 16, std::floor(c * 16));  // a share of 16 samples
    if (c > 0 && c < 1) ++part;
  }
  EXPECT_GT(part, 0);
  EXPECT_LE(part, 16);  // the border crosses one column, or two
}

TEST(TileTracer, PaddingIsEmpty) {
  const Camera camera = camera_at({0.5, 1.5, 3}, {0, 0.3, 0}, 5);  // 5x5 pixels in an 8x8 tile
  TraceOptions options;
  options.face_size = 4;
  const TileRows rows = rows_of(still_life(), camera, options);
  const auto order = image_row_order(5, 5);
  const auto size = static_cast<std::size_t>(HaarLayout(4).size());
  int outside = 0;
  for (std::size_t row = 0; row < kTileRows; ++row) {
    if (order[row] != kNoOutput) continue;
    ++outside;
    EXPECT_EQ(rows.coverage[row], 0.0f);
    for (std::size_t j = 0; j < size; ++j) EXPECT_EQ(rows.values[row * size + j], 0.0f);
  }
  EXPECT_EQ(outside, 64 - 25);
}

TEST(TileTracer, RefusesOptionsOutsideTheirRange) {
  const auto message = [](TraceOptions options) {
    try {
      check(options);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::invalid_argument);
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message({}), "");
  for (const int face : {0, 2, 48, 512, -64}) {
    TraceOptions o;
    o.face_size = face;
    EXPECT_NE(message(o).find(std::to_string(face)), std::string::npos);
  }
  const auto with = [&](auto TraceOptions::*member, auto value) {
    TraceOptions o;
    o.*member = value;
    return message(o);
  };
  EXPECT_NE(with(&TraceOptions::spp, 0).find("spp is 0"), std::string::npos);
  EXPECT_NE(with(&TraceOptions::spp, 65), "");
  EXPECT_NE(with(&TraceOptions::pixel_samples, 5).find("1, 4 or 16"), std::string::npos);
  EXPECT_NE(with(&TraceOptions::noise, 0.0).find("above 0"), std::string::npos);
  EXPECT_NE(with(&TraceOptions::paths, 0).find("paths is 0"), std::string::npos);
  TraceOptions o;
  o.effects.bounces = 65;
  EXPECT_NE(message(o).find("bounces is 65"), std::string::npos);
  o.effects.bounces = 2;
  o.effects.shadows = false;
  EXPECT_NE(message(o).find("without shadows"), std::string::npos);
}

}  // namespace
}  // namespace haarlight
