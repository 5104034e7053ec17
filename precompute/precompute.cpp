// The offline main path: a scene and a view in, a transport file out.

#include "precompute/precompute.h"

#include <fmt/format.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <span>
#include <type_traits>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/transport_writer.h"

namespace haarlight {
namespace {

// Raised whenever the same input would give other rows.
constexpr int kTracerVersion = 1;
constexpr int kPilotTiles = 64;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void check_options(const Camera& camera, const PrecomputeOptions& options) {
  check(options.trace);
  if (!(options.error >= 0) || !(options.error < 1)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("error is {}, expected 0 or more and below 1", options.error));
  }
  if (camera.width < 1 || camera.height < 1 || camera.width > 16384 || camera.height > 16384) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("picture size is {}x{}, expected 1x1 to 16384x16384", camera.width,
                            camera.height));
  }
  const auto& rows = camera.orientation.row;
  for (const Vec3& v : {camera.position, rows[0], rows[1], rows[2]}) {
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z)) {
      throw Error(ErrorKind::invalid_argument,
                  fmt::format("the camera's place or orientation holds ({}, {}, {}), expected "
                              "finite numbers",
                              v.x, v.y, v.z));
    }
  }
  if (!(camera.vertical_fov > 0) || !(camera.vertical_fov < kPi)) {
    throw Error(ErrorKind::invalid_argument,
                fmt::format("vertical field of view is {} rad, expected above 0 and below pi",
                            camera.vertical_fov));
  }
}

// Before minutes of tracing, whether the result has a place to go.
void check_output(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  std::error_code code;
  if (!std::filesystem::is_directory(folder, code)) {
    throw Error(ErrorKind::io, fmt::format("{}: there is no folder {}, expected one to write to",
                                           file.string(), folder.string()));
  }
  if (std::filesystem::is_directory(file, code) || access(folder.c_str(), W_OK) != 0) {
    throw Error(ErrorKind::io,
                fmt::format("{}: cannot be written, expected a file name in a folder that is open "
                            "for writing",
                            file.string()));
  }
}

bool is_padding(std::span<const std::uint32_t> outputs) {
  return std::all_of(outputs.begin(), outputs.end(),
                     [](std::uint32_t o) { return o == kNoOutput; });
}

// Scratch memory handed from tile to tile, at most one a thread.
struct Work {
  TileTracer::Scratch scratch;
  TileRows rows;
  RayCounts counts;
};

class WorkPool {
 public:
  std::unique_ptr<Work> take() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) return std::make_unique<Work>();
    auto work = std::move(free_.back());
    free_.pop_back();
    return work;
  }
  void give(std::unique_ptr<Work> work) {
    const std::lock_guard lock(mutex_);
    rays_ += work->counts;
    work->counts = {};
    free_.push_back(std::move(work));
  }
  const RayCounts& rays() const { return rays_; }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<Work>> free_;
  RayCounts rays_;
};

// Tells the caller about finished steps of work, one at a time.
class Steps {
 public:
  Steps(const Progress& progress, int total) : progress_(progress), total_(total) {}
  void done(int count) {
    const std::lock_guard lock(mutex_);
    done_ += count;
    if (progress_ && !progress_(std::min(1.0, static_cast<double>(done_) / total_))) {
      throw Error(ErrorKind::cancelled, "precomputation stopped by its caller");
    }
  }

 private:
  std::mutex mutex_;
  const Progress& progress_;
  int total_;
  int done_ = 0;
};

// Up to kPilotTiles tiles spread evenly over those that show the scene, by a glance at a few of
// their pixels.
std::vector<int> choose_pilots(const TileTracer& tracer, std::span<const std::uint32_t> order,
                               int width, RayCounts& counts) {
  std::vector<int> seen;
  std::vector<PixelPoint> points;
  const int tiles = static_cast<int>(order.size() / kTileRows);
  for (int t = 0; t < tiles; ++t) {
    for (const std::size_t row : {0u, 21u, 42u, 63u}) {  // one a block
      const std::uint32_t output = order[static_cast<std::size_t>(t) * kTileRows + row];
      if (output == kNoOutput) continue;
      const int pixel = static_cast<int>(output);
      tracer.pixels().sample(pixel % width, pixel / width, points, counts);
      if (!points.empty()) {
        seen.push_back(t);
        break;
      }
    }
  }
  const std::size_t count = std::min<std::size_t>(kPilotTiles, seen.size());
  std::vector<int> pilots;
  for (std::size_t i = 0; i < count; ++i) {
    pilots.push_back(seen[(2 * i + 1) * seen.size() / (2 * count)]);
  }
  return pilots;
}

// As many pilots at a time as there are threads, handed to the tuner in order.
std::vector<float> tune(const TileTracer& tracer, std::span<const std::uint32_t> order, int width,
                        double error, Steps& steps, RayCounts& counts) {
  const std::vector<int> pilots = choose_pilots(tracer, order, width, counts);
  ToleranceTuner tuner(tracer.layout(), error);
  std::vector<Work> work(
      std::min(pilots.size(), static_cast<std::size_t>(std::max(1, thread_count()))));
  for (std::size_t begin = 0; begin < pilots.size(); begin += work.size()) {
    const std::size_t count = std::min(work.size(), pilots.size() - begin);
    parallel_for(static_cast<int>(count), [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      const auto tile = static_cast<std::size_t>(pilots[begin + at]);
      tracer.trace(order.subspan(tile * kTileRows, kTileRows), work[at].scratch, work[at].rows,
                   work[at].counts);
    });
    for (std::size_t i = 0; i < count; ++i) tuner.add(work[i].rows);
    steps.done(static_cast<int>(count));
  }
  for (const Work& w : work) counts += w.counts;
  steps.done(kPilotTiles - static_cast<int>(pilots.size()));
  return tuner.thresholds();
}

// Everything in the file's meta is a function of the input, so that equal runs give equal bytes.
std::string meta_json(const Scene& scene, const PrecomputeOptions& options) {
  const SceneReport& r = scene.report;
  const TraceOptions& t = options.trace;
  const nlohmann::json meta{{"generator", fmt::format("haarlight tracer {}", kTracerVersion)},
                            {"scene",
                             {{"name", scene.name},
                              {"triangles", scene.triangle.size()},
                              {"materials", scene.material.size()},
                              {"dropped_degenerate", r.dropped_degenerate},
                              {"dropped_not_finite", r.dropped_not_finite},
                              {"dropped_duplicate", r.dropped_duplicate},
                              {"dropped_not_triangle", r.dropped_not_triangle},
                              {"normals_made", r.normals_made},
                              {"unused_vertices", r.unused_vertices},
                              {"textures_missing", r.textures_missing}}},
                            {"options",
                             {{"face", t.face_size},
                              {"spp", t.spp},
                              {"adaptive", t.adaptive},
                              {"pixel_samples", t.pixel_samples},
                              {"error", options.error}}},
                            {"effects", {"direct", "shadows"}}};
  return meta.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// Hashes plain values; structs go in field by field so that padding never counts.
class Hash {
 public:
  Hash() : state_(XXH3_createState()) { XXH3_128bits_reset(state_); }
  ~Hash() { XXH3_freeState(state_); }
  Hash(const Hash&) = delete;
  Hash& operator=(const Hash&) = delete;

  template <typename T>
  requires std::is_arithmetic_v<T>
  void add(T value) { XXH3_128bits_update(state_, &value, sizeof value); }
  void add(const Vec3& v) { add(v.x), add(v.y), add(v.z); }
  void add(const Rgb& c) { add(c.r), add(c.g), add(c.b); }
  template <typename T>
  void add_all(const std::vector<T>& values) {
    add(values.size());
    for (const T& v : values) add(v);
  }
  void add(const std::array<float, 2>& v) { add(v[0]), add(v[1]); }
  void add(const Triangle& t) {
    for (const std::uint32_t v : t.vertex) add(v);
    add(t.material);
  }
  void add(const Material& m) {
    add(static_cast<int>(m.model)), add(m.albedo), add(m.texture);
    add(m.specular), add(m.exponent);
    add(m.metallic), add(m.roughness), add(m.metallic_roughness_texture), add(m.transmission);
    add(m.ior), add(m.extinction), add(m.thin);
    add(m.normal_texture), add(m.normal_scale), add(m.alpha_cutoff);
  }
  void add(const std::vector<float>& values) { add_all(values); }
  void add(const Image& i) { add(i.width), add(i.height), add_all(i.pixels); }
  std::string text() const {
    const XXH128_hash_t h = XXH3_128bits_digest(state_);
    return fmt::format("{:016x}{:016x}", h.high64, h.low64);
  }

 private:
  XXH3_state_t* state_;
};

}  // namespace

std::string precompute_fingerprint(const Scene& scene, const Camera& camera,
                                   const PrecomputeOptions& options) {
  Hash hash;
  hash.add(kTracerVersion);
  hash.add_all(scene.position);
  hash.add_all(scene.normal);
  hash.add_all(scene.uv);
  hash.add_all(scene.tint);
  hash.add_all(scene.triangle);
  hash.add_all(scene.material);
  hash.add_all(scene.texture);
  hash.add_all(scene.alpha);
  hash.add(camera.position);
  for (const Vec3& row : camera.orientation.row) hash.add(row);
  hash.add(camera.vertical_fov), hash.add(camera.width), hash.add(camera.height);
  const TraceOptions& t = options.trace;
  hash.add(t.face_size), hash.add(t.spp), hash.add(t.adaptive), hash.add(t.pixel_samples);
  hash.add(options.error);
  return hash.text();
}

PrecomputeReport precompute_image(const Scene& scene, const Camera& camera,
                                  const PrecomputeOptions& options,
                                  const std::filesystem::path& file, const Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  check_options(camera, options);
  check_output(file);

  const Visibility visibility(scene);
  const TileTracer tracer(scene, visibility, camera, options.trace);
  const std::vector<std::uint32_t> order = image_row_order(camera.width, camera.height);
  PrecomputeReport report;

  for (std::size_t row = 0; row < order.size(); row += kTileRows) {
    if (!is_padding(std::span(order).subspan(row, kTileRows))) ++report.tiles;
  }

  // Pilot tiles say how much may be dropped.
  Steps steps(progress, report.tiles + kPilotTiles);
  report.thresholds = tune(tracer, order, camera.width, options.error, steps, report.ray_counts);
  report.pilot_seconds = seconds_since(start);

  TransportInfo info;
  info.face_size = options.trace.face_size;
  info.width = camera.width;
  info.height = camera.height;
  info.camera = camera;
  TransportWriterOptions writing;
  writing.thresholds = report.thresholds;
  writing.fingerprint = precompute_fingerprint(scene, camera, options);
  writing.resume = options.resume;
  TransportWriter writer(file, info, writing);

  // Every tile by itself: trace, transform, compress, append.
  WorkPool pool;
  std::mutex mutex;
  parallel_for(writer.tile_count(), [&](int tile) {
    const std::span<const std::uint32_t> outputs = writer.tile_outputs(tile);
    const bool padding =
        std::all_of(outputs.begin(), outputs.end(), [](std::uint32_t o) { return o == kNoOutput; });
    const bool known = !padding && writer.has_tile(tile);
    std::int64_t blocks = 0, rgb_blocks = 0;
    if (!padding && !known) {
      auto work = pool.take();
      tracer.trace(outputs, work->scratch, work->rows, work->counts);
      writer.write_tile(tile, work->rows);
      for (std::size_t b = 0; b < kTileBlocks; ++b) {
        const auto first =
            work->rows.coverage.begin() + static_cast<std::ptrdiff_t>(b * kBlockRows);
        if (std::any_of(first, first + kBlockRows, [](float c) { return c > 0; })) ++blocks;
        if (work->rows.rgb_blocks >> b & 1u) ++rgb_blocks;
      }
      pool.give(std::move(work));
    }
    {
      const std::lock_guard lock(mutex);
      if (known) ++report.resumed_tiles;
      report.blocks += blocks;
      report.rgb_blocks += rgb_blocks;
    }
    steps.done(1);
  });
  report.ray_counts += pool.rays();
  report.rays = report.ray_counts.primary + report.ray_counts.shadow;

  writer.finish(meta_json(scene, options));
  const Transport written = Transport::open(file);
  report.bytes = written.file_bytes();
  report.measured_error = nlohmann::json::parse(written.info().meta).value("measured_error", 0.0);
  report.seconds = seconds_since(start);
  return report;
}

}  // namespace haarlight
