// The steps of a frame one by one, on made-up transports, lights and meshes: each is checked after
// it was timed, and says how many bytes it moved.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "bench/inputs.h"
#include "core/image_metrics.h"
#include "prt/error_estimator.h"
#include "prt/finish_rows.h"
#include "prt/image_relighter.h"
#include "prt/mesh_picture.h"
#include "prt/row_sums.h"
#include "prt/sh_relighter.h"
#include "tests/prt/fixtures.h"
#include "wavelet/haar.h"
#include "wavelet/top_k.h"

namespace haarlight::bench {
namespace {

constexpr int kFace = 64, kTransportFace = 32, kSide = 256;

void moved(benchmark::State& state, double bytes_an_iteration) {
  state.counters["bytes_per_second"] = benchmark::Counter(
      bytes_an_iteration * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["MB"] = bytes_an_iteration / 1e6;
}

std::vector<Rgb> random_light(int face, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  return fixtures::random_lighting(HaarLayout(face), random);
}

void haar(benchmark::State& state, bool forward) {
  const HaarLayout layout(kFace);
  const std::vector<Rgb> texels = random_light(kFace, 1);
  std::vector<Rgb> coefficients(texels.size()), back(texels.size());
  haar_forward(layout, texels, coefficients);
  for (auto _ : state) {
    if (forward) {
      haar_forward(layout, texels, coefficients);
    } else {
      haar_inverse(layout, coefficients, back);
    }
    benchmark::ClobberMemory();
  }
  haar_inverse(layout, coefficients, back);
  // Twelve additions a way, each of at most 2^-24 of what may be a hundred times the texel.
  for (std::size_t i = 0; i < texels.size(); ++i) {
    if (l1_norm(back[i] - texels[i]) > 1e-2f) state.SkipWithError("the transform is no transform");
  }
  moved(state, 2.0 * static_cast<double>(texels.size() * sizeof(Rgb)));
}

void top_k(benchmark::State& state, int k, bool ranked) {
  const std::vector<Rgb> light = random_light(kFace, 2);
  std::vector<float> keys;
  for (const Rgb& c : light) keys.push_back(l1_norm(c));
  TopK select;
  RankedKeys rank;
  std::vector<int> chosen;
  for (auto _ : state) {
    if (ranked) {
      chosen.clear();
      rank.start(keys);
      for (int i = 0; i < k; ++i) chosen.push_back(rank.next());
    } else {
      select.select(keys, k, chosen);
    }
    benchmark::DoNotOptimize(chosen.data());
  }
  // The chosen ones are the largest: no other key is above the least of them.
  float least = keys[static_cast<std::size_t>(chosen[0])];
  for (const int i : chosen) least = std::min(least, keys[static_cast<std::size_t>(i)]);
  const auto above = std::count_if(keys.begin(), keys.end(), [&](float v) { return v > least; });
  if (chosen.size() != static_cast<std::size_t>(k) || above >= k) {
    state.SkipWithError("not the largest keys");
  }
  moved(state, static_cast<double>(keys.size() * sizeof(float)));
}

const Transport& made_up(bool colored) {
  const auto make = [](bool rgb) {
    fixtures::SmallTransport small =
        fixtures::small_transport(kTransportFace, kSide, kSide, 3, 0.4, false);
    std::mt19937_64 random(4);
    if (rgb) {
      for (TileRows& tile : small.tiles) {
        do {
          tile = fixtures::random_tile(HaarLayout(kTransportFace), random, 0.4, true);
        } while (tile.rgb_blocks != 15);
      }
    }
    return build_transport(small.info, small.tiles, small.thresholds);
  };
  static const Transport grey = make(false);
  if (!colored) return grey;
  static const Transport rgb = make(true);
  return rgb;
}

LightingUpdate some_columns(const HaarLayout& layout, int count) {
  LightingUpdate update;
  for (int i = 0; i < count; ++i) {
    const double d = 1 + 0.01 * i;
    update.deltas.push_back({static_cast<int>(static_cast<std::int64_t>(i) * layout.size() / count),
                             {d, -0.5 * d, 0.25 * d}});
  }
  return update;
}

// Columns of one storage kind into sums: after n times, n times the columns.
void apply_kind(benchmark::State& state, bool colored, int columns) {
  const Transport& transport = made_up(colored);
  const LightingUpdate update = some_columns(transport.layout(), columns);
  RowSums sums(transport), once(transport);
  sums.expect_resets(false);
  double bytes = 0;
  for (auto _ : state) {
    const ApplyStats stats = sums.apply(update);
    bytes += static_cast<double>(stats.transport_bytes + stats.sum_bytes);
  }
  once.apply(update);
  expect_repeated(state, sums, once);
  moved(state, bytes / static_cast<double>(state.iterations()));
}

// Sums to pixels, with an update of one small column that touches every chunk.
void finish(benchmark::State& state) {
  const Transport& transport = made_up(false);
  RowSums sums(transport);
  sums.expect_resets(false);
  Image picture(kSide, kSide);
  LightingUpdate update;
  update.deltas.push_back({0, {1, 1, 1}});
  double finish_ms = 0;
  for (auto _ : state) {
    const RelightStats stats = apply_and_finish(sums, update, picture.pixels);
    finish_ms += stats.finish_ms;
    state.SetIterationTime(1e-3 * stats.finish_ms);
  }
  std::vector<Rgb> light(static_cast<std::size_t>(transport.layout().size()));
  const auto times = static_cast<float>(state.iterations());
  light[0] = {times, times, times};
  if (compare_images(picture, relight_once(transport, light)).relative_rmse > 1e-6) {
    state.SkipWithError("the picture is not that of the sums");
  }
  const double pixels = static_cast<double>(kSide) * kSide;
  moved(state, pixels * (3 * sizeof(double) + 2 * sizeof(Rgb) + sizeof(std::uint32_t)));
}

// Spherical harmonics, all of them: dense columns.
void sh(benchmark::State& state, int order) {
  const Transport& transport = made_up(false);
  ShRelighter relighter(transport, {.order = order});
  std::vector<Rgb> lights[2] = {random_light(kTransportFace, 5), random_light(kTransportFace, 6)};
  double bytes = 0;
  int turn = 0;
  for (auto _ : state) {
    const auto frame = relighter.relight(lights[turn ^= 1], false);
    bytes += static_cast<double>(frame.stats.apply.transport_bytes + frame.stats.apply.sum_bytes);
  }
  ShRelighter fresh(transport, {.order = order});
  fresh.relight(lights[turn], true);
  if (compare_images(relighter.picture(), fresh.picture()).relative_rmse > 1e-6) {
    state.SkipWithError("the picture is not that of the light");
  }
  moved(state, bytes / static_cast<double>(state.iterations()));
}

// Estimate and bound of a frame's error.
void judge(benchmark::State& state) {
  const Transport& transport = made_up(false);
  ErrorEstimator estimator(transport);
  const std::vector<Rgb> target = random_light(kTransportFace, 7),
                         shown = random_light(kTransportFace, 8);
  const Image a = relight_once(transport, shown), b = relight_once(transport, target);
  double norm = 0;
  for (const Rgb& p : a.pixels) {
    const RgbD d(p);
    norm += d.r * d.r + d.g * d.g + d.b * d.b;
  }
  PictureErrorGuess guess;
  for (auto _ : state) guess = estimator.judge(target, shown, std::sqrt(norm));
  const double error = compare_images(a, b).relative_rmse;
  if (guess.bound < error || guess.estimate > 1.5 * error || guess.estimate < error / 1.5) {
    state.SkipWithError("the estimate is far off, or the bound broken");
  }
  moved(state, static_cast<double>(estimator.tables().bytes() + 2 * target.size() * sizeof(Rgb)));
}

// A mesh from a new camera, and under a new light.
void raster(benchmark::State& state, bool look) {
  auto mesh = std::make_shared<const TransportMesh>(fixtures::bumpy_sphere(40000, 9));
  const BoundingSphere sphere = bounding_sphere(*mesh);
  Camera camera =
      look_at(sphere.center + Vec3{0, 1, 3} * sphere.radius, sphere.center, 0.8, 512, 512);
  MeshPicture picture(mesh);
  const std::vector<Rgb> radiance(mesh->position.size(), Rgb{0.5f, 0.25f, 2});
  Image image;
  picture.look(camera);
  for (auto _ : state) {
    if (look) {
      picture.look(camera);
    } else {
      picture.shade(radiance, image);
    }
  }
  picture.shade(radiance, image);
  std::size_t fragments = 0;
  for (int y = 0; y < 512; ++y) {
    for (int x = 0; x < 512; ++x) {
      fragments += picture.fragments(x, y).size();
      const float covered = picture.coverage()[image.index(x, y)];
      if (std::abs(image.at(x, y).b - 2 * covered) > 1e-5f) {
        state.SkipWithError("a constant radiance does not come out");
      }
    }
  }
  const double all = static_cast<double>(fragments) * sizeof(MeshPicture::Fragment);
  if (look) {
    moved(state,
          all + static_cast<double>(mesh->triangle.size() * 12 + mesh->position.size() * 12));
  } else {
    moved(state, all + static_cast<double>(image.pixels.size() * sizeof(Rgb)) +
                     static_cast<double>(fragments) * 3 * (4 + sizeof(Rgb)));
  }
}

}  // namespace

void register_kernels() {
  const auto add = [](const std::string& name, auto function, auto... arguments) {
    return benchmark::RegisterBenchmark(name.c_str(), function, arguments...)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  };
  add("haar.forward.f64", haar, true);
  add("haar.inverse.f64", haar, false);
  add("topk.k30", top_k, 30, false);
  add("topk.k300", top_k, 300, false);
  add("topk.ranked.k300", top_k, 300, true);
  add("apply.grey.k30", apply_kind, false, 30);
  add("apply.grey.k300", apply_kind, false, 300);
  add("apply.rgb.k30", apply_kind, true, 30);
  add("apply.rgb.k300", apply_kind, true, 300);
  benchmark::RegisterBenchmark("finish.256", finish)
      ->Unit(benchmark::kMillisecond)
      ->UseManualTime();
  add("sh.order5", sh, 5);
  add("sh.order10", sh, 10);
  add("judge", judge);
  add("raster.look.512", raster, true);
  add("raster.shade.512", raster, false);
}

}  // namespace haarlight::bench
