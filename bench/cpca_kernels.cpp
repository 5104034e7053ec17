// The steps of relighting by clustered PCA one by one, on a made-up mesh of smooth rows: each is
// checked after it was timed, and says how many bytes it moved.

#include <benchmark/benchmark.h>

#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "bench/inputs.h"
#include "core/image_metrics.h"
#include "cpca/cluster_sums.h"
#include "cpca/compress.h"
#include "prt/mesh_picture.h"
#include "prt/row_sums.h"
#include "prt/term_finish.h"
#include "tests/cpca/inputs.h"

namespace haarlight::bench {
namespace {

constexpr int kFace = 16, kVertices = 4000, kTerms = 3;

const Transport& compressed() {
  static const Transport transport = [] {
    fixtures::SmallTransport small = fixtures::smooth_transport(kFace, kVertices, kTerms, true);
    small.info.view = std::make_shared<const ViewFactors>(
        fixtures::random_view_factors(small.info.mesh->position.size(), kTerms, 8, 256));
    const TemporaryFolder folder;
    const Transport plain = build_transport(small.info, small.tiles, small.thresholds);
    compress_transport(plain, folder / "c.hlt", {.clusters = 40, .basis = 16, .iterations = 4});
    return Transport::open(folder / "c.hlt");
  }();
  return transport;
}

LightingUpdate some_columns(int count, double scale) {
  const HaarLayout layout(kFace);
  LightingUpdate update;
  for (int i = 0; i < count; ++i) {
    const double d = scale * (1 + 0.01 * i);
    update.deltas.push_back({i * layout.size() / count, {d, -0.5 * d, 0.25 * d}});
  }
  return update;
}

void moved(benchmark::State& state, double bytes) {
  using benchmark::Counter;
  state.counters["bytes_per_second"] = Counter(bytes, Counter::kIsRate);
  state.counters["MB"] = bytes / 1e6 / static_cast<double>(state.iterations());
}

// Vectors follow the light (Overbeck 2006, Eq. 7): after n times, n times the columns.
void step1(benchmark::State& state, int columns) {
  RowSums sums(compressed()), once(compressed());
  sums.expect_resets(false);
  const LightingUpdate update = some_columns(columns, 1);
  double bytes = 0;
  for (auto _ : state) {
    const ApplyStats stats = sums.apply(update);
    bytes += static_cast<double>(stats.transport_bytes + stats.sum_bytes);
  }
  once.apply(update);
  expect_repeated(state, sums, once);
  moved(state, bytes);
}

// Vertices follow the vectors (Eq. 10), `most` of each cluster and term: there and back again.
void step2(benchmark::State& state, int most) {
  const Transport& transport = compressed();
  RowSums vectors(transport);
  vectors.expect_resets(false);
  ClusterSums vertices(transport.info());
  const std::vector<std::uint8_t> all(static_cast<std::size_t>(transport.chunk_count()), 1);
  std::vector<Rgb> shown(transport.info().mesh->position.size() * kTerms);
  vectors.apply(some_columns(300, 1));
  vertices.follow(vectors, all, {}, 0, shown);
  double bytes = 0, sign = 1;
  for (auto _ : state) {
    state.PauseTiming();
    vectors.apply(some_columns(30, sign *= -1));
    state.ResumeTiming();
    const CombineStats stats = vertices.follow(vectors, all, {}, most, shown);
    bytes += static_cast<double>(stats.weight_bytes + stats.sum_bytes);
  }
  // Followed to its end it is what vertices show that follow at once.
  while (!vertices.settled()) vertices.follow(vectors, all, {}, 0, shown);
  ClusterSums fresh(transport.info());
  std::vector<Rgb> right(shown.size());
  while (fresh.follow(vectors, all, {}, 0, right).changes > 0) {
  }
  double apart = 0, size = 0;
  for (std::size_t i = 0; i < right.size(); ++i) {
    apart = std::max(apart, static_cast<double>(l1_norm(right[i] - shown[i])));
    size = std::max(size, static_cast<double>(l1_norm(right[i])));
  }
  if (!(size > 0) || apart > 1e-5 * size) state.SkipWithError("vertices do not show W P");
  moved(state, bytes);
}

// Factors, radiance and pixels of what vertices show (Eq. 9), from one view.
void finish(benchmark::State& state) {
  const TransportInfo& info = compressed().info();
  const std::size_t vertices = info.mesh->position.size();
  std::vector<Rgb> sums(vertices * kTerms), radiance(vertices);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (Rgb& u : sums) u = {uniform(random), uniform(random), uniform(random)};
  TermFinish finish_terms(info.mesh, info.view);
  MeshPicture drawing(info.mesh);
  Camera camera = info.camera;
  camera.width = camera.height = 256;
  finish_terms.look(camera.position);
  drawing.look(camera);
  Image picture;
  for (auto _ : state) {
    finish_terms.shade(sums, radiance);
    drawing.shade(radiance, picture);
  }
  std::vector<Rgb> right(vertices);
  for (std::size_t v = 0; v < vertices; ++v) {
    RgbD sum;
    for (std::size_t k = 0; k < kTerms; ++k) {
      sum += RgbD(finish_terms.factors()[v * kTerms + k]) * RgbD(sums[v * kTerms + k]);
    }
    right[v] = Rgb(sum);
  }
  Image from_right;
  drawing.shade(right, from_right);
  if (!(compare_images(picture, from_right).relative_rmse < 1e-5)) {
    state.SkipWithError("the picture is not that of the sums");
  }
  std::size_t fragments = 0;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) fragments += drawing.fragments(x, y).size();
  }
  const std::size_t bytes = vertices * (2 * kTerms + 1) * sizeof(Rgb) +
                            fragments * (sizeof(MeshPicture::Fragment) + 3 * (4 + sizeof(Rgb))) +
                            picture.pixels.size() * sizeof(Rgb);
  moved(state, static_cast<double>(bytes) * static_cast<double>(state.iterations()));
}

}  // namespace

void register_cpca_kernels() {
  const auto add = [](const std::string& name, auto function, auto... arguments) {
    benchmark::RegisterBenchmark(name.c_str(), function, arguments...)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  };
  add("cpca.step1.k30", step1, 30);
  add("cpca.step1.k300", step1, 300);
  add("cpca.step2.quarter", step2, 4);
  add("cpca.step2.all", step2, 0);
  add("cpca.finish.256", finish);
}

}  // namespace haarlight::bench
