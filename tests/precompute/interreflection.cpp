// Interreflection where its answer is known in closed form.

#include "precompute/interreflection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "precompute/tile_tracer.h"
#include "prt/prior_lighting.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

// A box open at the top, seen from above: its floor and walls.
Scene open_box(float albedo) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-1, 0, -1}, {0, 0, 2}, {2, 0, 0});
  shapes::add_quad(scene, {-1, 0, -1}, {2, 0, 0}, {0, 1.5, 0});
  shapes::add_quad(scene, {-1, 0, 1}, {0, 1.5, 0}, {2, 0, 0});
  shapes::add_quad(scene, {-1, 0, -1}, {0, 1.5, 0}, {0, 0, 2});
  shapes::add_quad(scene, {1, 0, -1}, {0, 0, 2}, {0, 1.5, 0});
  scene.material[0].albedo = {albedo, albedo, albedo};
  return scene;
}

struct Traced {
  TileRows rows;
  TileNoise noise;
  RayCounts counts;
};

Traced trace(const Scene& scene, const TraceOptions& options, const Vec3& from = {0.1, 4, 0.2}) {
  const Visibility visibility(scene);
  const TileTracer tracer(scene, visibility, look_at(from, {0, 0.4, 0}, 0.4, 8, 8), options);
  TileTracer::Scratch scratch;
  Traced t;
  tracer.trace(image_row_order(8, 8), scratch, t.rows, t.counts, &t.noise);
  return t;
}

// What a row shows of channel `c` under an even sky of 1: texel sum = n * sum of the scaling
// coefficients.
double under_even_sky(const TileRows& rows, std::size_t row, std::size_t c, int n) {
  const bool rgb = (rows.rgb_blocks >> (row / kBlockRows) & 1u) != 0;
  const auto size = static_cast<std::size_t>(HaarLayout(n).size());
  const float* values = rows.values.data() + ((rgb ? c * kTileRows : 0) + row) * size;
  double sum = 0;
  for (std::size_t face = 0; face < 6; ++face) sum += static_cast<double>(values[face]);
  const Rgb color = rows.color[row];
  return n * sum * static_cast<double>(c == 0 ? color.r : c == 1 ? color.g : color.b);
}

TraceOptions options_with(int bounces, int paths) {
  TraceOptions options;
  options.face_size = 16;
  options.pixel_samples = 1;
  options.spp = 16;
  options.effects.bounces = bounces;
  options.noise = 1e-9;  // all the paths
  options.paths = paths;
  return options;
}

// White furnace: where nothing is absorbed, every point shows the sky's radiance after enough
// bounces, whatever the shape. The mean over 64 rows and seeds is within 4 of its standard errors.
TEST(Interreflection, WhiteFurnace) {
  const Scene scene = open_box(1.0f);
  double sum = 0, square = 0;
  constexpr int kSeeds = 8;
  for (int seed = 0; seed < kSeeds; ++seed) {
    TraceOptions options = options_with(kMostBounces, 1024);
    options.seed = static_cast<std::uint64_t>(seed);
    const Traced t = trace(scene, options);
    double mean = 0;
    int covered = 0;
    for (std::size_t row = 0; row < kTileRows; ++row) {
      if (t.rows.coverage[row] == 0) continue;
      ++covered;
      mean += under_even_sky(t.rows, row, 1, 16);
    }
    ASSERT_GT(covered, 30);
    mean /= covered;
    sum += mean;
    square += mean * mean;
  }
  const double mean = sum / kSeeds;
  const double error = std::sqrt(std::max(0.0, square / kSeeds - mean * mean) / (kSeeds - 1));
  // Direct light is right to 2e-3 by itself: 16 samples a texel of 16x16 faces.
  EXPECT_NEAR(mean, 1, 4 * error + 2e-3) << "standard error " << error;
  EXPECT_LT(error, 0.01);
}

// Each bounce of albedo a brings at most a times the one before, and sums of bounces grow.
TEST(Interreflection, BouncesAreAGeometricSeriesAtMost) {
  const Scene scene = open_box(0.5f);
  std::vector<double> total;
  for (const int bounces : {0, 1, 2, 3, 4}) {
    const Traced t = trace(scene, options_with(bounces, 4096));
    double sum = 0;
    for (std::size_t row = 0; row < kTileRows; ++row) sum += under_even_sky(t.rows, row, 1, 16);
    total.push_back(sum);
  }
  for (std::size_t b = 1; b < total.size(); ++b) {
    const double gain = total[b] - total[b - 1];
    EXPECT_GT(gain, 0) << b;
    if (b > 1) {
      EXPECT_LT(gain, 0.5 * (total[b - 1] - total[b - 2])) << b;
    }
  }
}

// Light that has left a red wall is red: beside black walls the floor gains nothing in green.
TEST(Interreflection, ColorBleeds) {
  Scene scene = open_box(0.0f);
  scene.material[0].albedo = {0.5f, 0.5f, 0.5f};
  Material red, black;
  red.albedo = {0.9f, 0, 0};
  black.albedo = {0, 0, 0};
  scene.material.push_back(red);
  scene.material.push_back(black);
  for (std::size_t t = 0; t < scene.triangle.size(); ++t) {
    scene.triangle[t].material = t < 2 ? 0 : t < 4 ? 1 : 2;
  }
  // Straight down onto the floor alone.
  const TraceOptions options = options_with(1, 2048);
  const Traced t = trace(scene, options, {0, 9, 0.001});
  TraceOptions direct = options;
  direct.effects.bounces = 0;
  const Traced without = trace(scene, direct, {0, 9, 0.001});
  double red_gain = 0, green_gain = 0;
  for (std::size_t row = 0; row < kTileRows; ++row) {
    red_gain += under_even_sky(t.rows, row, 0, 16) - under_even_sky(without.rows, row, 0, 16);
    green_gain += under_even_sky(t.rows, row, 1, 16) - under_even_sky(without.rows, row, 1, 16);
  }
  EXPECT_GT(red_gain, 0.1);
  EXPECT_NEAR(green_gain, 0, 1e-3 * red_gain);
}

// A floor beside a high, smooth wall of white metal: what the wall hides of an even sky it shows
// instead, so that the floor reflects all of it, up to what the lobe sends below the horizon and
// past the wall's borders (1 % each). Half of the light comes by way of a lobe of 0.005 radians,
// and hardly any of it by chance: it must be looked for, and must not count twice.
TEST(Interreflection, NarrowLobesAreLookedFor) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-2, 0, -6}, {0, 0, 12}, {8, 0, 0});
  shapes::add_quad(scene, {-2, 0, -50}, {0, 50, 0}, {0, 0, 100}, 1);
  scene.material[0].albedo = {0.8f, 0.8f, 0.8f};
  Material metal;
  metal.model = SurfaceModel::metallic_roughness;
  metal.albedo = {1, 1, 1};
  metal.metallic = 1;
  metal.roughness = 0.05f;
  scene.material.push_back(metal);
  double sum = 0, square = 0;
  constexpr int kSeeds = 4;
  for (int seed = 0; seed < kSeeds; ++seed) {
    TraceOptions options = options_with(1, 512);
    options.seed = static_cast<std::uint64_t>(seed);
    const Traced t = trace(scene, options, {0, 4, 0.001});
    double mean = 0;
    for (std::size_t row = 0; row < kTileRows; ++row) {
      mean += under_even_sky(t.rows, row, 1, 16) / kTileRows;
    }
    sum += mean, square += mean * mean;
    // Under lamps of a texel each: without looking, 32 paths a row would bring noise of more than
    // 1.
    EXPECT_LT(t.noise.worst(), 0.3);
  }
  const double mean = sum / kSeeds;
  const double error = std::sqrt(std::max(0.0, square / kSeeds - mean * mean) / (kSeeds - 1));
  EXPECT_LT(error, 0.01);
  EXPECT_NEAR(mean, 0.8, 4 * error + 0.02);
}

TEST(Interreflection, BlackSceneTracesNoPath) {
  const Traced t = trace(open_box(0.0f), options_with(8, 1024));
  EXPECT_EQ(t.counts.paths, 0);
  EXPECT_EQ(t.counts.bounce, 0);
}

TEST(Interreflection, StopsWhenQuietEnoughAndSaysHowNoisyItIs) {
  const Scene scene = open_box(0.5f);
  TraceOptions loose = options_with(2, 1 << 14);
  loose.noise = 0.2;
  const Traced quick = trace(scene, loose);
  TraceOptions strict = loose;
  strict.noise = 0.01;
  const Traced slow = trace(scene, strict);
  EXPECT_EQ(quick.noise.paths, kPathBatch);
  EXPECT_LE(quick.noise.worst(), 0.2);
  EXPECT_GT(slow.noise.paths, quick.noise.paths);
  EXPECT_TRUE(slow.noise.worst() <= 0.01 || slow.noise.paths >= 1 << 14);
}

// The noise a tile states is the spread that other seeds have: pictures under the built-in
// lightings, the ratio of both within a factor of 2 (both are estimates of few degrees of freedom).
TEST(Interreflection, StatedNoiseIsTheSpreadOverSeeds) {
  const Scene scene = open_box(0.6f);
  const HaarLayout layout(16);
  const auto size = static_cast<std::size_t>(layout.size());
  constexpr int kSeeds = 12;
  std::vector<double> sum(kTileRows, 0.0), square(kTileRows, 0.0);
  double stated = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    TraceOptions options = options_with(3, 1024);
    options.seed = static_cast<std::uint64_t>(seed);
    const Traced t = trace(scene, options);
    stated += t.noise.variance[0] / 3 / kSeeds;  // grey scene: three equal channels
    const auto& light = prior_lightings(layout)[0];
    for (std::size_t row = 0; row < kTileRows; ++row) {
      double value = 0;
      for (std::size_t j = 0; j < size; ++j) {
        value += static_cast<double>(t.rows.values[row * size + j]) * static_cast<double>(light[j]);
      }
      value *= static_cast<double>(t.rows.color[row].g);
      sum[row] += value, square[row] += value * value;
    }
  }
  double spread = 0;
  for (std::size_t row = 0; row < kTileRows; ++row) {
    const double mean = sum[row] / kSeeds;
    spread += (square[row] / kSeeds - mean * mean) * kSeeds / (kSeeds - 1);
  }
  EXPECT_GT(spread, 0);
  EXPECT_LT(stated / spread, 4) << "stated " << stated << ", found " << spread;
  EXPECT_GT(stated / spread, 0.25) << "stated " << stated << ", found " << spread;
}

TEST(Interreflection, SameBitsTwiceAndOtherBitsFromAnotherSeed) {
  const Scene scene = open_box(0.5f);
  TraceOptions options = options_with(2, 512);
  const Traced a = trace(scene, options), b = trace(scene, options);
  const auto same = [](const TileRows& x, const TileRows& y) {
    return x.values.size() == y.values.size() &&
           std::memcmp(x.values.data(), y.values.data(), x.values.size() * sizeof(float)) == 0;
  };
  EXPECT_TRUE(same(a.rows, b.rows));
  options.seed = 1;
  EXPECT_FALSE(same(a.rows, trace(scene, options).rows));
}

}  // namespace
}  // namespace haarlight
