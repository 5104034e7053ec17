// Light of every kind: tiles against a bare loop over the same rays, and whole runs by their parts.

#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "bench/inputs.h"
#include "bench/ray_record.h"
#include "core/error.h"
#include "core/parallel.h"
#include "data_gen/scenes.h"
#include "precompute/default_stage.h"
#include "precompute/precompute.h"
#include "precompute/random.h"
#include "precompute/surface.h"
#include "precompute/tile_tracer.h"
#include "prt/prior_lighting.h"

namespace haarlight::bench {
namespace {

constexpr std::size_t kTiles = 4;
constexpr int kWholeRuns = 3;  // repetitions: a run takes seconds

TraceOptions trace_options(bool everything) {
  TraceOptions trace;
  trace.face_size = inputs().light_face;
  if (everything) trace.effects = all_effects();
  return trace;
}

// A scene, and a few tiles of its picture with the rays that they take.
struct LightSetup {
  Scene scene;
  Camera camera;
  std::unique_ptr<Visibility> visibility;
  std::unique_ptr<TileTracer> tracer;
  std::vector<std::vector<std::uint32_t>> outputs;  // of a tile
  std::vector<RayRecord> record;                    // likewise
};

LightSetup& setup() {
  static LightSetup s;
  if (s.visibility) return s;
  s.scene = data_gen::make_scene(inputs().light_scene);
  StageOptions stage;
  stage.width = stage.height = inputs().light_size;
  s.camera = set_stage(s.scene, stage).camera;
  s.visibility = std::make_unique<Visibility>(s.scene);
  s.tracer = std::make_unique<TileTracer>(s.scene, *s.visibility, s.camera, trace_options(true));
  const std::vector<std::uint32_t> order = image_row_order(s.camera.width, s.camera.height);
  const std::size_t all = order.size() / kTileRows;
  const std::size_t count = std::min(kTiles, all);
  s.record.resize(count);
  TileTracer::Scratch scratch;
  TileRows rows;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t tile = (2 * i + 1) * all / (2 * count);
    const auto first = order.begin() + static_cast<std::ptrdiff_t>(tile * kTileRows);
    s.outputs.emplace_back(first, first + kTileRows);
    RayCounts counts;
    const Recording recording(s.record[i]);
    s.tracer->trace(s.outputs.back(), scratch, rows, counts);
    if (counts.rays() != s.record[i].rays) {
      throw Error(ErrorKind::invalid_argument,
                  fmt::format("{}: {} rays counted, {} seen by Embree, expected the same",
                              inputs().light_scene, counts.rays(), s.record[i].rays));
    }
  }
  return s;
}

Vec3 place_off(const Vec3& position, const Bsdf& b) {
  return position + Visibility::kSurfaceOffset * b.geometric_normal;
}

// The light that one path brings under a sky of n x n faces.
double plain_path(const LightSetup& s, const Receiver& receiver, const std::vector<float>& sky,
                  int n, PathRandom& random, std::int64_t& rays) {
  Vec3 from = place_off(receiver.position, receiver.bsdf);
  Bsdf b = receiver.bsdf;
  double weight = luminance(receiver.weight), sum = 0;
  for (;;) {
    const auto send = [&](const Vec3& w) {
      return b.diffuse_in(w) * luminance(b.diffuse_out(b.to_viewer)) +
             (b.has_lobe() ? b.lobe_values(w).first * luminance(b.gloss_first) : 0);
    };
    const double light_u = random.next(), light_v = random.next();
    const Vec3 light = cosine_direction(b.normal, light_u, light_v);
    if (dot(light, b.geometric_normal) > 0) {
      const std::array<float, 3> origin{static_cast<float>(from.x), static_cast<float>(from.y),
                                        static_cast<float>(from.z)};
      ++rays;
      if (!s.visibility->occluded(origin, light, std::numeric_limits<double>::infinity())) {
        sum += weight * send(light) * kPi / dot(b.normal, light) *
               static_cast<double>(sky[texel_of(light, n)]);
      }
    }
    const double albedo = std::min(luminance(b.diffuse_albedo() + b.lobe_albedo()), 0.95);
    if (!(random.next() < albedo)) return sum;
    const double u = random.next(), v = random.next();
    const Vec3 w = cosine_direction(b.normal, u, v);
    if (!(dot(w, b.geometric_normal) > 0)) return sum;
    weight *= send(w) * kPi / (dot(b.normal, w) * albedo);
    ++rays;
    const auto hit = surface_hit(s.scene, *s.visibility, from, w);
    if (!hit) return sum;
    b = bsdf_at(s.scene, *hit);
    if (b.is_specular()) return sum;
    from = place_off(hit->position, b);
  }
}

// Tiles as a run traces them, wavelets included.
void tiles(benchmark::State& state) {
  const LightSetup& s = setup();
  std::vector<std::int64_t> rays(s.outputs.size());
  std::vector<double> transform(s.outputs.size());
  std::int64_t sum = 0;
  double transform_sum = 0;
  for (auto _ : state) {
    parallel_for(static_cast<int>(s.outputs.size()), [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      thread_local TileTracer::Scratch scratch;
      thread_local TileRows rows;
      RayCounts counts;
      scratch.transform_seconds = 0;
      s.tracer->trace(s.outputs[at], scratch, rows, counts);
      rays[at] = counts.rays();
      transform[at] = scratch.transform_seconds;
    });
    for (const std::int64_t r : rays) sum += r;
    for (const double t : transform) transform_sum += t;
  }
  state.SetItemsProcessed(sum);
  state.counters["transform_ms"] = 1e3 * transform_sum / static_cast<double>(state.iterations());
}

// The same rays by Embree alone: no surfaces, no weights, no rows.
void bare_paths(benchmark::State& state) {
  const LightSetup& s = setup();
  std::vector<std::int64_t> hits(s.record.size());
  std::int64_t rays = 0;
  double bytes = 0;
  for (auto _ : state) {
    parallel_for(static_cast<int>(s.record.size()), [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      hits[at] = replay(s.record[at]);
    });
    for (const RayRecord& record : s.record) rays += record.rays;
  }
  for (std::size_t i = 0; i < hits.size(); ++i) {
    bytes += static_cast<double>(s.record[i].bytes());
    if (hits[i] != s.record[i].hits) state.SkipWithError("the rays met other things than before");
  }
  state.SetItemsProcessed(rays);
  state.counters["record_mib"] = bytes / 1048576;
}

// What a renderer would do with one sky known beforehand: paths from the same receivers, at each
// vertex one ray towards the light and one along the path, and what is needed to choose and weigh
// them. No packets, no rows.
void path_loop(benchmark::State& state) {
  const LightSetup& s = setup();
  constexpr int kPathsAReceiver = 64;
  const int n = inputs().light_face;
  const HaarLayout layout(n);
  std::vector<float> sky(static_cast<std::size_t>(layout.size()));
  haar_inverse(layout, prior_lightings(layout)[0], sky);
  std::vector<TileReceivers> receivers(s.outputs.size());
  for (std::size_t i = 0; i < receivers.size(); ++i) {
    RayCounts counts;
    s.tracer->find_receivers(s.outputs[i], receivers[i], counts);
  }
  std::vector<std::int64_t> rays(receivers.size());
  std::vector<double> light(receivers.size());
  std::int64_t sum = 0;
  for (auto _ : state) {
    parallel_for(static_cast<int>(receivers.size()), [&](int t) {
      const auto at = static_cast<std::size_t>(t);
      rays[at] = 0;
      for (std::size_t r = 0; r < receivers[at].receivers.size(); ++r) {
        for (int i = 0; i < kPathsAReceiver; ++i) {
          PathRandom random(mix_bits(mix_bits(at, r), static_cast<std::uint64_t>(i)));
          light[at] += plain_path(s, receivers[at].receivers[r], sky, n, random, rays[at]);
        }
      }
    });
    for (const std::int64_t count : rays) sum += count;
  }
  benchmark::DoNotOptimize(light.data());
  state.SetItemsProcessed(sum);
}

// A folder of this process, gone at its end.
const std::filesystem::path& folder() {
  struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / fmt::format("haarlight-bench-{}", ::getpid());
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  };
  static const Folder made;
  return made.path;
}

// A whole run, scene to file.
void whole_run(benchmark::State& state, bool everything, int threads) {
  const LightSetup& s = setup();
  const int before = thread_count();
  set_thread_count(threads);
  PrecomputeOptions options;
  options.trace = trace_options(everything);
  PrecomputeReport report;
  StageSeconds stages;
  for (auto _ : state) {
    report = precompute_image(s.scene, s.camera, options, folder() / "run.hlt");
    stages += report.stages;
  }
  set_thread_count(before);
  // Assembly is wall time on all threads, the rest is summed over threads.
  const double assemble = stages.assemble * report.workers;
  const double whole = stages.trace + stages.compress + stages.write + assemble;
  state.SetItemsProcessed(report.rays * state.iterations());
  state.counters["haar"] = stages.transform / whole;
  state.counters["quantise"] = stages.compress / whole;
  state.counters["write"] = (stages.write + assemble) / whole;
  state.counters["mib"] = static_cast<double>(report.bytes) / 1048576;
  state.counters["workers"] = report.workers;
}

}  // namespace

void register_full_light() {
  const auto add = [](const std::string& name, auto function) {
    return benchmark::RegisterBenchmark(name.c_str(), function)
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  };
  add("light.tiles", tiles);
  add("light.bare.paths", bare_paths);
  add("light.path.loop", path_loop);
  for (const bool everything : {false, true}) {
    for (const int threads : {1, 2}) {
      add(fmt::format("run.{}.t{}", everything ? "full" : "direct", threads),
          [=](benchmark::State& state) { whole_run(state, everything, threads); })
          ->Iterations(1)
          ->Repetitions(kWholeRuns);
    }
  }
}

}  // namespace haarlight::bench
