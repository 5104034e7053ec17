// What rays a piece of work sends through Embree, to send the same again with nothing around them.
//
// The linker leads the program's calls of Embree's functions here (--wrap, see CMakeLists.txt), so
// that the tracer under test is the one that is installed, without a hook of its own.

#include "bench/ray_record.h"

#include <bit>
#include <cstring>

namespace haarlight::bench {
namespace {

RayRecord* recorded = nullptr;

void note_one(RTCScene scene, const RTCRay& ray, RayRecord::Call call) {
  recorded->scene = scene;
  recorded->call.push_back(call);
  recorded->one.push_back(
      {{ray.org_x, ray.org_y, ray.org_z}, {ray.dir_x, ray.dir_y, ray.dir_z}, ray.tfar, ray.mask});
  ++recorded->rays;
}

void note_eight(RTCScene scene, const int* valid, const RTCRay8& ray) {
  RayRecord::Eight e{};
  for (unsigned i = 0; i < 8; ++i) {
    if (valid[i] == 0) continue;
    e.origin[0] = ray.org_x[i], e.origin[1] = ray.org_y[i], e.origin[2] = ray.org_z[i];
    e.distance = ray.tfar[i], e.mask = ray.mask[i];
    e.x[i] = ray.dir_x[i], e.y[i] = ray.dir_y[i], e.z[i] = ray.dir_z[i];
    e.lanes |= 1u << i;
  }
  recorded->scene = scene;
  recorded->call.push_back(RayRecord::Call::occluded_eight);
  recorded->eight.push_back(e);
  recorded->rays += std::popcount(e.lanes);
}

std::int64_t hits_of(const int* valid, const RTCRay8& ray) {
  std::int64_t hits = 0;
  for (unsigned i = 0; i < 8; ++i) hits += valid[i] != 0 && ray.tfar[i] < 0;
  return hits;
}

}  // namespace
}  // namespace haarlight::bench

using haarlight::bench::hits_of;
using haarlight::bench::note_eight;
using haarlight::bench::note_one;
using haarlight::bench::RayRecord;
using haarlight::bench::recorded;

// Names that the linker gives: __wrap_X takes the place of X, __real_X is the X of the library.
extern "C" {
#if HAARLIGHT_EMBREE == 4
void __real_rtcIntersect1(RTCScene scene, RTCRayHit* ray, RTCIntersectArguments* arguments);
void __real_rtcOccluded1(RTCScene scene, RTCRay* ray, RTCOccludedArguments* arguments);
void __real_rtcOccluded8(const int* valid, RTCScene scene, RTCRay8* ray,
                         RTCOccludedArguments* arguments);

void __wrap_rtcIntersect1(RTCScene scene, RTCRayHit* ray, RTCIntersectArguments* arguments) {
  if (recorded) note_one(scene, ray->ray, RayRecord::Call::intersect_one);
  __real_rtcIntersect1(scene, ray, arguments);
  if (recorded) recorded->hits += ray->hit.geomID != RTC_INVALID_GEOMETRY_ID;
}
void __wrap_rtcOccluded1(RTCScene scene, RTCRay* ray, RTCOccludedArguments* arguments) {
  if (recorded) note_one(scene, *ray, RayRecord::Call::occluded_one);
  __real_rtcOccluded1(scene, ray, arguments);
  if (recorded) recorded->hits += ray->tfar < 0;
}
void __wrap_rtcOccluded8(const int* valid, RTCScene scene, RTCRay8* ray,
                         RTCOccludedArguments* arguments) {
  if (recorded) note_eight(scene, valid, *ray);
  __real_rtcOccluded8(valid, scene, ray, arguments);
  if (recorded) recorded->hits += hits_of(valid, *ray);
}
#else
void __real_rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* ray);
void __real_rtcOccluded1(RTCScene scene, RTCIntersectContext* context, RTCRay* ray);
void __real_rtcOccluded8(const int* valid, RTCScene scene, RTCIntersectContext* context,
                         RTCRay8* ray);

void __wrap_rtcIntersect1(RTCScene scene, RTCIntersectContext* context, RTCRayHit* ray) {
  if (recorded) note_one(scene, ray->ray, RayRecord::Call::intersect_one);
  __real_rtcIntersect1(scene, context, ray);
  if (recorded) recorded->hits += ray->hit.geomID != RTC_INVALID_GEOMETRY_ID;
}
void __wrap_rtcOccluded1(RTCScene scene, RTCIntersectContext* context, RTCRay* ray) {
  if (recorded) note_one(scene, *ray, RayRecord::Call::occluded_one);
  __real_rtcOccluded1(scene, context, ray);
  if (recorded) recorded->hits += ray->tfar < 0;
}
void __wrap_rtcOccluded8(const int* valid, RTCScene scene, RTCIntersectContext* context,
                         RTCRay8* ray) {
  if (recorded) note_eight(scene, valid, *ray);
  __real_rtcOccluded8(valid, scene, context, ray);
  if (recorded) recorded->hits += hits_of(valid, *ray);
}
#endif
}

namespace haarlight::bench {

Recording::Recording(RayRecord& record) { recorded = &record; }
Recording::~Recording() { recorded = nullptr; }

std::int64_t replay(const RayRecord& record) {
#if HAARLIGHT_EMBREE == 4
  RTCOccludedArguments occlusion;
  rtcInitOccludedArguments(&occlusion);
  occlusion.flags = RTC_RAY_QUERY_FLAG_INCOHERENT;
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
#endif
  const auto set = [](RTCRay& ray, const RayRecord::One& one) {
    ray.org_x = one.origin[0], ray.org_y = one.origin[1], ray.org_z = one.origin[2];
    ray.dir_x = one.direction[0], ray.dir_y = one.direction[1], ray.dir_z = one.direction[2];
    ray.tfar = one.distance;
    ray.mask = one.mask;
  };
  std::int64_t hits = 0;
  std::size_t next_one = 0, next_eight = 0;
  for (const RayRecord::Call call : record.call) {
    switch (call) {
      case RayRecord::Call::intersect_one: {
        RTCRayHit ray;
        std::memset(&ray, 0, sizeof ray);
        set(ray.ray, record.one[next_one++]);
        ray.hit.geomID = ray.hit.primID = RTC_INVALID_GEOMETRY_ID;
#if HAARLIGHT_EMBREE == 4
        __real_rtcIntersect1(record.scene, &ray, nullptr);
#else
        __real_rtcIntersect1(record.scene, &context, &ray);
#endif
        hits += ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        break;
      }
      case RayRecord::Call::occluded_one: {
        RTCRay ray{};
        set(ray, record.one[next_one++]);
#if HAARLIGHT_EMBREE == 4
        __real_rtcOccluded1(record.scene, &ray, &occlusion);
#else
        __real_rtcOccluded1(record.scene, &context, &ray);
#endif
        hits += ray.tfar < 0;
        break;
      }
      case RayRecord::Call::occluded_eight: {
        const RayRecord::Eight& e = record.eight[next_eight++];
        RTCRay8 ray;
        alignas(32) int valid[8];
        for (unsigned i = 0; i < 8; ++i) {
          valid[i] = e.lanes >> i & 1u ? -1 : 0;
          ray.org_x[i] = e.origin[0], ray.org_y[i] = e.origin[1], ray.org_z[i] = e.origin[2];
          ray.dir_x[i] = e.x[i], ray.dir_y[i] = e.y[i], ray.dir_z[i] = e.z[i];
          ray.tnear[i] = 0, ray.tfar[i] = e.distance, ray.time[i] = 0;
          ray.mask[i] = e.mask, ray.id[i] = i, ray.flags[i] = 0;
        }
#if HAARLIGHT_EMBREE == 4
        __real_rtcOccluded8(valid, record.scene, &ray, &occlusion);
#else
        __real_rtcOccluded8(valid, record.scene, &context, &ray);
#endif
        hits += hits_of(valid, ray);
        break;
      }
    }
  }
  return hits;
}

}  // namespace haarlight::bench
