// Transport times environment against a plain path tracer: every effect alone, and all together.
//
// Both sides look through the middles of pixels at the same piecewise constant sky. The transport
// is made kReplicas times, each with other places in the texels, another seed of its paths and
// other keys for what is drawn per pixel, so that the spread of the replicas is its whole error.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "data_gen/mesh_builder.h"
#include "data_gen/scenes.h"
#include "precompute/default_stage.h"
#include "precompute/scene_import.h"
#include "precompute/tile_tracer.h"
#include "prt/transport_writer.h"
#include "tests/reference/path_tracer.h"
#include "wavelet/haar.h"

namespace haarlight {
namespace {

constexpr int kFace = 8, kSize = 32, kReplicas = 4;
constexpr double kSigmas = 4;

// Blocks of 4 x 4 texels of one radiance, each exponentially distributed, as coarse sky; with a sun
// in one texel if wanted (not for caustics, which a path tracer finds by chance only).
Cubemap sky_light(bool sun) {
  std::mt19937 random(17);
  std::exponential_distribution<float> spread(1.0f);
  Cubemap map(kFace);
  for (int face = 0; face < 6; ++face) {
    for (int block = 0; block < 4; ++block) {
      const Rgb light{spread(random), spread(random), spread(random)};
      for (int i = 0; i < 16; ++i) {
        map.texels[cube_index(face, block % 2 * 4 + i % 4, block / 2 * 4 + i / 4, kFace)] = light;
      }
    }
  }
  if (sun) map.texels[cube_index(2, 5, 6, kFace)] += {60, 55, 45};  // high, in front to the right
  return map;
}

// A picture by rows of a transport, tile by tile in the order of image_row_order.
struct Rendered {
  std::vector<RgbD> pixel;
  std::vector<std::uint32_t> tile;  // of each pixel
};

Rendered rendered(const Scene& scene, const Visibility& visibility, const Camera& camera,
                  const TraceOptions& options, const Cubemap& light) {
  // The same pixels as a part of a wider picture: what is drawn by a pixel's number is drawn anew.
  const int margin = 8 * static_cast<int>(options.seed);
  Camera wide = camera;
  wide.width += 2 * margin;
  const TileTracer tracer(scene, visibility, wide, options);
  const HaarLayout layout(kFace);
  const auto size = static_cast<std::size_t>(layout.size());
  std::array<std::vector<double>, 3> coefficient;
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> texels(size);
    for (std::size_t k = 0; k < size; ++k) {
      const RgbD t(light.texels[k]);
      texels[k] = c == 0 ? t.r : c == 1 ? t.g : t.b;
    }
    coefficient[c].resize(size);
    haar_forward(layout, texels, coefficient[c]);
  }

  const auto count =
      static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  Rendered out{std::vector<RgbD>(count), std::vector<std::uint32_t>(count)};
  // Tiles of the narrow picture, asked for by their numbers in the wide one.
  const auto order = image_row_order(camera.width, camera.height);
  parallel_for(static_cast<int>(order.size() / kTileRows), [&](int number) {
    const auto first = static_cast<std::size_t>(number) * kTileRows;
    std::vector<std::uint32_t> outputs(kTileRows);
    for (std::size_t row = 0; row < kTileRows; ++row) {
      const std::uint32_t own = order[first + row];
      const auto width = static_cast<std::uint32_t>(camera.width);
      outputs[row] = own == kNoOutput ? kNoOutput
                                      : own / width * static_cast<std::uint32_t>(wide.width) +
                                            own % width + static_cast<std::uint32_t>(margin);
    }
    TileTracer::Scratch scratch;
    TileRows rows;
    RayCounts counts;
    tracer.trace(outputs, scratch, rows, counts);
    for (std::size_t row = 0; row < kTileRows; ++row) {
      if (order[first + row] == kNoOutput) continue;
      const bool rgb = (rows.rgb_blocks >> (row / kBlockRows) & 1u) != 0;
      std::array<double, 3> sum{};
      for (std::size_t c = 0; c < 3; ++c) {
        const float* values = rows.values.data() + ((rgb ? c * kTileRows : 0) + row) * size;
        for (std::size_t j = 0; j < size; ++j) {
          sum[c] += static_cast<double>(values[j]) * coefficient[c][j];
        }
      }
      out.pixel[order[first + row]] = RgbD{sum[0], sum[1], sum[2]} * RgbD(rows.color[row]);
      out.tile[order[first + row]] = static_cast<std::uint32_t>(number);
    }
  });
  return out;
}

struct Shot {
  Scene scene;
  Camera camera;
  bool sun = true;
  int samples = 400;  // of the path tracer, a pixel
  int paths = 1024;   // of the transport, a tile
  // How certain the comparison must be: standard error of the picture's mean, relative.
  double certainty = 0.01;
};

double sum_of(const RgbD& c) { return c.r + c.g + c.b; }

void compare(const Shot& shot, const Effects& effects) {
  const Cubemap light = sky_light(shot.sun);
  const reference::Sky sky(light);
  reference::PathOptions options;
  options.samples = shot.samples;
  options.max_bounces = effects.bounces;
  options.shadows = effects.shadows;
  options.gloss = effects.gloss;
  options.specular = effects.specular;
  options.caustics = effects.caustics;
  options.pixel_centers = true;
  const auto truth = reference::PathTracer(shot.scene, sky, options).picture(shot.camera);

  const Visibility visibility(shot.scene);
  std::vector<Rendered> replica;
  for (int k = 0; k < kReplicas; ++k) {
    constexpr std::array kPlaces{11, 13, 16, 19};
    TraceOptions trace;
    trace.face_size = kFace;
    trace.spp = kPlaces[static_cast<std::size_t>(k)];
    trace.adaptive = false;
    trace.pixel_samples = 1;
    trace.effects = effects;
    trace.noise = 1e-9;  // all the paths
    trace.paths = shot.paths;
    trace.seed = static_cast<std::uint64_t>(k);
    replica.push_back(rendered(shot.scene, visibility, shot.camera, trace, light));
  }

  // Pixels share paths within their tile: the transport's noise is one of tiles.
  const std::size_t pixels = truth.size();
  const std::size_t tiles = 1 + *std::max_element(replica[0].tile.begin(), replica[0].tile.end());
  double total = 0, difference = 0, path_variance = 0;
  double squares = 0, expected_squares = 0, squares_variance = 0;
  std::vector<std::array<double, kReplicas>> tile_sum(tiles);
  std::vector<double> tile_variance(tiles, 0.0);
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::uint32_t tile = replica[0].tile[i];
    double mean = 0, square = 0;
    for (std::size_t k = 0; k < kReplicas; ++k) {
      const double value = sum_of(replica[k].pixel[i]);
      mean += value / kReplicas;
      tile_sum[tile][k] += value;
    }
    for (std::size_t k = 0; k < kReplicas; ++k) {
      square += std::pow(sum_of(replica[k].pixel[i]) - mean, 2);
    }
    const double own = square / (kReplicas - 1) / kReplicas;
    const double path = truth[i].sum_variance;
    const double off = mean - sum_of(truth[i].mean);
    total += sum_of(truth[i].mean);
    difference += off;
    path_variance += path;
    squares += off * off;
    expected_squares += own + path;
    squares_variance += 2 * path * path;
    tile_variance[tile] += own;
  }
  double transport_variance = 0;
  std::array<double, kReplicas> picture{};
  for (std::size_t t = 0; t < tiles; ++t) {
    double mean = 0, square = 0;
    for (std::size_t k = 0; k < kReplicas; ++k) {
      mean += tile_sum[t][k] / kReplicas;
      picture[k] += tile_sum[t][k];
    }
    for (const double s : tile_sum[t]) square += (s - mean) * (s - mean);
    transport_variance += square / (kReplicas - 1) / kReplicas;
    // As if all pixels of a tile were off by one number: the square of a Gaussian, and that of its
    // estimate from kReplicas.
    squares_variance += tile_variance[t] * tile_variance[t] * (2 + 2.0 / (kReplicas - 1));
  }
  // What all tiles are off by together, if that is more.
  double mean = 0, square = 0;
  for (const double p : picture) mean += p / kReplicas;
  for (const double p : picture) square += (p - mean) * (p - mean);
  transport_variance = std::max(transport_variance, square / (kReplicas - 1) / kReplicas);

  const double sigma = std::sqrt(path_variance + transport_variance);
  EXPECT_GT(total, 0);
  EXPECT_LT(sigma, shot.certainty * total) << "too noisy to tell";
  EXPECT_LT(std::abs(difference), kSigmas * sigma)
      << "the picture is off by " << difference / total << ", standard error " << sigma / total;
  EXPECT_LT(squares, expected_squares + kSigmas * std::sqrt(squares_variance))
      << "pixels are off by " << std::sqrt(squares / expected_squares) << " standard errors";
  if (std::getenv("HAARLIGHT_TEST_VERBOSE") != nullptr) {
    std::printf("  mean off %+.4f %%, sigma %.4f %%, z %+.2f; chi^2 %.3f, of which 1 + %.3f go\n",
                100 * difference / total, 100 * sigma / total, difference / sigma,
                squares / expected_squares,
                kSigmas * std::sqrt(squares_variance) / expected_squares);
  }
}

Effects only(const std::function<void(Effects&)>& change) {
  Effects effects;  // shadows
  effects.bounces = 0;
  effects.gloss = effects.specular = effects.caustics = false;
  change(effects);
  return effects;
}

Effects everything() {
  Effects effects = all_effects();
  effects.bounces = 6;  // either side ends there
  return effects;
}

Shot made(const std::string& name) {
  Shot shot{data_gen::make_scene(name), {}};
  shot.camera = *shot.scene.camera;
  shot.camera.width = shot.camera.height = kSize;
  // Off the scenes' symmetry, or lines of sight would run into edges exactly, where either side is
  // right.
  shot.camera.position = shot.camera.position + Vec3{0.0131, 0.0073, 0};
  return shot;
}

TEST(TransportAgainstReference, CornellBox) {
  const Shot box = made("cornell");
  compare(box, only([](Effects&) {}));
  compare(box, only([](Effects& e) { e.shadows = false; }));
  compare(box, only([](Effects& e) { e.bounces = 1; }));
  compare(box, everything());
}

// The bunny where the data is, else something bumpy of the same size.
Shot bunny() {
  Shot shot;
  const char* given = std::getenv("HAARLIGHT_TEST_DATA");
  const auto file = std::filesystem::path(given ? given : "") / "meshes" / "stanford-bunny.obj";
  if (given && std::filesystem::exists(file)) {
    shot.scene = import_scene(file);
  } else {
    data_gen::MeshBuilder builder;
    const auto clay = builder.add_material("clay", {0.6f, 0.5f, 0.4f});
    builder.add_grid(
        clay, 96, 48,
        [](double s, double t) {
          const double around = 2 * kPi * s;
          const double ring = t == 0 || t == 1 ? 0.0 : std::sin(kPi * t);
          const double up = t == 0 ? -1.0 : t == 1 ? 1.0 : -std::cos(kPi * t);
          const double r = 0.08 * (1 + 0.3 * ring * ring * std::sin(5 * around) * std::cos(7 * up));
          return Vec3{r * ring * std::sin(around), 0.08 * (1 + up), r * ring * std::cos(around)};
        },
        true);
    shot.scene = builder.finish(look_at({0, 0, 1}, {0, 0, 0}, 0.6, kSize, kSize));
    shot.scene.camera.reset();
  }
  StageOptions options;
  options.width = options.height = kSize;
  shot.camera = set_stage(shot.scene, options).camera;
  return shot;
}

TEST(TransportAgainstReference, Bunny) {
  const Shot shot = bunny();
  compare(shot, only([](Effects&) {}));
  compare(shot, everything());
}

TEST(TransportAgainstReference, Glass) {
  Shot shot = made("glass");
  shot.sun = false;
  compare(shot, only([](Effects& e) { e.specular = true; }));
  compare(shot, only([](Effects& e) { e.caustics = true; }));
  compare(shot, everything());
}

TEST(TransportAgainstReference, Metals) {
  const Shot shot = made("metals");
  compare(shot, only([](Effects& e) { e.gloss = true; }));
  compare(shot, everything());
}

TEST(TransportAgainstReference, RingCaustic) {
  Shot shot = made("ring");
  shot.sun = false;
  compare(shot, only([](Effects& e) { e.caustics = true; }));
  compare(shot, everything());
}

// Where nothing is absorbed everything shows the radiance of an even sky, whatever its shape and
// however light gets there: the picture's mean is 1 to 1 %, of which three standard errors, found
// from the replicas, must leave room.
TEST(TransportAgainstReference, WhiteFurnace) {
  Cubemap white(kFace);
  for (Rgb& c : white.texels) c = {1, 1, 1};
  const auto check = [&](Shot shot, const char* name) {
    for (Material& m : shot.scene.material) {
      m.albedo = {1, 1, 1};
      m.texture = -1;
      m.specular = m.extinction = {};
    }
    const Visibility visibility(shot.scene);
    double sum = 0, squares = 0;
    for (int k = 0; k < kReplicas; ++k) {
      TraceOptions trace;
      trace.face_size = kFace;
      trace.spp = 16;
      trace.pixel_samples = 1;
      trace.effects = all_effects();
      trace.noise = 1e-9;
      trace.paths = shot.paths;
      trace.seed = static_cast<std::uint64_t>(k);
      double light = 0, covered = 0;
      for (const RgbD& c : rendered(shot.scene, visibility, shot.camera, trace, white).pixel) {
        if (sum_of(c) == 0) continue;  // background
        light += sum_of(c) / 3;
        ++covered;
      }
      EXPECT_GT(covered, 100) << name;
      sum += light / covered;
      squares += std::pow(light / covered, 2);
    }
    const double mean = sum / kReplicas;
    const double error =
        std::sqrt(std::max(0.0, squares / kReplicas - mean * mean) / (kReplicas - 1));
    EXPECT_LT(3 * error, 0.01) << name << ": too noisy to tell";
    EXPECT_NEAR(mean, 1, 0.01) << name << ", standard error " << error;
    if (std::getenv("HAARLIGHT_TEST_VERBOSE") != nullptr) {
      std::printf("  %s: %.4f, error %.4f\n", name, mean, error);
    }
  };
  check(bunny(), "bunny");
  for (const char* name : {"glass", "ring"}) check(made(name), name);
  for (const char* name : {"metals", "cornell"}) {  // light stays in the box longest
    Shot shot = made(name);
    shot.paths = 4096;
    check(shot, name);
  }
}

}  // namespace
}  // namespace haarlight
