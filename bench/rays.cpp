// Visibility rays: our tracer against bare Embree loops over the same rays, prepared beforehand.

#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "bench/inputs.h"
#include "core/parallel.h"
#include "precompute/default_stage.h"
#include "precompute/point_tracer.h"

#if HAARLIGHT_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace haarlight::bench {
namespace {

constexpr int kPointsAcross = 32;

// Points that a camera sees, and the table of directions that all of them look along.
struct RaySetup {
  Scene scene;
  std::unique_ptr<Visibility> visibility;
  std::unique_ptr<DirectionTable> table;
  std::vector<ShadingPoint> points;
  RTCDevice device = nullptr;
  RTCScene bare = nullptr;
};

RaySetup& setup() {
  static RaySetup s;
  if (s.visibility) return s;
  s.scene = *inputs().scene;
  StageOptions stage_options;
  const Camera camera = set_stage(s.scene, stage_options).camera;
  s.visibility = std::make_unique<Visibility>(s.scene);
  s.table = std::make_unique<DirectionTable>(64, 1);
  const Vec3 eye = s.visibility->to_local(camera.position);
  for (int y = 0; y < kPointsAcross; ++y) {
    for (int x = 0; x < kPointsAcross; ++x) {
      const Vec3 direction = camera.direction((x + 0.5) * camera.width / kPointsAcross,
                                              (y + 0.5) * camera.height / kPointsAcross);
      const auto hit = s.visibility->first_hit(eye, direction);
      if (!hit) continue;
      const Vec3 a = s.visibility->corner(hit->triangle, 0);
      const Vec3 b = s.visibility->corner(hit->triangle, 1) - a;
      const Vec3 c = s.visibility->corner(hit->triangle, 2) - a;
      Vec3 normal = normalize(cross(b, c));
      if (dot(normal, direction) > 0) normal = -normal;
      const Vec3 p = a + b * hit->b1 + c * hit->b2 + normal * Visibility::kSurfaceOffset;
      ShadingPoint point;
      point.origin = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
      point.geometric_normal = point.normal = normal;
      s.points.push_back(point);
    }
  }
  s.device = rtcNewDevice(nullptr);
  s.bare = rtcNewScene(s.device);
  rtcSetSceneFlags(s.bare, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(s.bare, RTC_BUILD_QUALITY_HIGH);
  const std::size_t triangles = s.visibility->triangle_count();
  RTCGeometry geometry = rtcNewGeometry(s.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* position = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3 * triangles));
  auto* index = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles));
  for (std::size_t t = 0; t < triangles; ++t) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 p = s.visibility->corner(static_cast<std::uint32_t>(t), k);
      const std::size_t v = 3 * t + static_cast<std::size_t>(k);
      position[3 * v] = static_cast<float>(p.x);
      position[3 * v + 1] = static_cast<float>(p.y);
      position[3 * v + 2] = static_cast<float>(p.z);
      index[v] = static_cast<unsigned>(v);
    }
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(s.bare, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(s.bare);
  return s;
}

float above(const ShadingPoint& point, float x, float y, float z) {
  const Vec3& n = point.normal;
  return static_cast<float>(n.x) * x + static_cast<float>(n.y) * y + static_cast<float>(n.z) * z;
}

// All first rays of all points, with what the tracer does around them: horizons, bits, sums.
void tracer(benchmark::State& state) {
  RaySetup& s = setup();
  const PointTracer point_tracer(*s.visibility, *s.table, false);
  std::int64_t rays = 0;
  double sum = 0;
  std::vector<RayCounts> counts(s.points.size());
  std::vector<double> sums(s.points.size());
  for (auto _ : state) {
    parallel_for(static_cast<int>(s.points.size()), [&](int i) {
      thread_local PointScratch scratch;
      thread_local std::vector<float> lambert;
      lambert.resize(s.table->texels());
      const auto p = static_cast<std::size_t>(i);
      counts[p] = {};
      point_tracer.trace(s.points[p], lambert, {}, scratch, counts[p]);
      sums[p] = 0;
      for (float v : lambert) sums[p] += static_cast<double>(v);
    });
    for (const RayCounts& c : counts) rays += c.shadow;
  }
  for (double v : sums) sum += v;
  state.SetItemsProcessed(rays);
  state.counters["rays"] = static_cast<double>(rays) / static_cast<double>(state.iterations());
  state.counters["mean_visibility"] = sum / static_cast<double>(s.points.size());
}

// Embree alone, packets of eight prepared outside the loop's arithmetic.
void bare_packets(benchmark::State& state) {
  RaySetup& s = setup();
  std::int64_t rays = 0;
  std::vector<std::int64_t> count(s.points.size());
  std::vector<double> sums(s.points.size());
  for (auto _ : state) {
    parallel_for(static_cast<int>(s.points.size()), [&](int i) {
      const auto p = static_cast<std::size_t>(i);
      const ShadingPoint& point = s.points[p];
      count[p] = 0;
      sums[p] = 0;
      RTCRay8 ray;
      alignas(32) int valid[8];
      for (const DirectionTable::Packet& packet : s.table->packet) {
        int any = 0;
        for (int k = 0; k < 8; ++k) {
          valid[k] = above(point, packet.x[k], packet.y[k], packet.z[k]) > 0 ? -1 : 0;
          any -= valid[k];
          ray.org_x[k] = point.origin[0], ray.org_y[k] = point.origin[1];
          ray.org_z[k] = point.origin[2], ray.dir_x[k] = packet.x[k];
          ray.dir_y[k] = packet.y[k], ray.dir_z[k] = packet.z[k];
          ray.tnear[k] = 0, ray.tfar[k] = INFINITY, ray.time[k] = 0;
          ray.mask[k] = 0xffffffffu, ray.id[k] = 0, ray.flags[k] = 0;
        }
        if (any == 0) continue;
#if HAARLIGHT_EMBREE == 4
        RTCOccludedArguments arguments;
        rtcInitOccludedArguments(&arguments);
        arguments.flags = RTC_RAY_QUERY_FLAG_INCOHERENT;
        rtcOccluded8(valid, s.bare, &ray, &arguments);
#else
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
        rtcOccluded8(valid, s.bare, &context, &ray);
#endif
        count[p] += any;
        for (int k = 0; k < 8; ++k) sums[p] += valid[k] != 0 && ray.tfar[k] > 0;
      }
    });
    for (std::int64_t c : count) rays += c;
  }
  double free_rays = 0, all = 0;
  for (std::size_t p = 0; p < count.size(); ++p) {
    free_rays += sums[p];
    all += static_cast<double>(count[p]);
  }
  state.SetItemsProcessed(rays);
  state.counters["rays"] = static_cast<double>(rays) / static_cast<double>(state.iterations());
  state.counters["free_share"] = free_rays / all;
}

#if HAARLIGHT_EMBREE == 3
// Embree's own stream interface (gone in Embree 4), one stream a point.
void bare_stream(benchmark::State& state) {
  RaySetup& s = setup();
  std::int64_t rays = 0;
  std::vector<std::int64_t> count(s.points.size());
  for (auto _ : state) {
    parallel_for(static_cast<int>(s.points.size()), [&](int i) {
      thread_local std::vector<RTCRay> stream;
      stream.clear();
      const ShadingPoint& point = s.points[static_cast<std::size_t>(i)];
      for (const DirectionTable::Packet& packet : s.table->packet) {
        for (int k = 0; k < 8; ++k) {
          if (!(above(point, packet.x[k], packet.y[k], packet.z[k]) > 0)) continue;
          RTCRay ray{};
          ray.org_x = point.origin[0], ray.org_y = point.origin[1], ray.org_z = point.origin[2];
          ray.dir_x = packet.x[k], ray.dir_y = packet.y[k], ray.dir_z = packet.z[k];
          ray.tfar = INFINITY;
          ray.mask = 0xffffffffu;
          stream.push_back(ray);
        }
      }
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
      rtcOccluded1M(s.bare, &context, stream.data(), static_cast<unsigned>(stream.size()),
                    sizeof(RTCRay));
      count[static_cast<std::size_t>(i)] = static_cast<std::int64_t>(stream.size());
    });
    for (std::int64_t c : count) rays += c;
  }
  state.SetItemsProcessed(rays);
}
#endif

}  // namespace

void register_rays() {
  const auto add = [](const char* name, auto function) {
    benchmark::RegisterBenchmark(name, function)->Unit(benchmark::kMillisecond)->UseRealTime();
  };
  add("rays.tracer", tracer);
  add("rays.bare.packets", bare_packets);
#if HAARLIGHT_EMBREE == 3
  add("rays.bare.stream", bare_stream);
#endif
}

}  // namespace haarlight::bench
