// Which rays are blocked: the triangles of a scene in Embree.

#include "precompute/visibility.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"

#if HAARLIGHT_EMBREE == 4
#include <embree4/rtcore.h>
#elif HAARLIGHT_EMBREE == 3
#include <embree3/rtcore.h>
#else
#error "HAARLIGHT_EMBREE must be 3 or 4"
#endif

namespace haarlight {

struct Visibility::Device {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  const float* position = nullptr;              // in Embree's buffer, 3 a vertex
  const std::uint32_t* corner_index = nullptr;  // in Embree's buffer, 3 a triangle
  bool packets = false;                         // 8-wide packets are native

  ~Device() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
  void check(const std::string& what) const {
    const RTCError error = rtcGetDeviceError(device);
    if (error != RTC_ERROR_NONE) {
      throw Error(ErrorKind::io, fmt::format("{}: Embree reports error {}, expected none", what,
                                             static_cast<int>(error)));
    }
  }
};

namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// One ray or packet through either version of Embree. Rays of one point spread over the whole
// hemisphere, so "incoherent" is the faster setting even for packets of neighbouring texels.
#if HAARLIGHT_EMBREE == 4
void occluded_one(RTCScene scene, RTCRay* ray) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_INCOHERENT;
  rtcOccluded1(scene, ray, &arguments);
}
void occluded_eight(const int* valid, RTCScene scene, RTCRay8* ray) {
  RTCOccludedArguments arguments;
  rtcInitOccludedArguments(&arguments);
  arguments.flags = RTC_RAY_QUERY_FLAG_INCOHERENT;
  rtcOccluded8(valid, scene, ray, &arguments);
}
void intersect_one(RTCScene scene, RTCRayHit* ray) { rtcIntersect1(scene, ray, nullptr); }
#else
RTCIntersectContext incoherent() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}
void occluded_one(RTCScene scene, RTCRay* ray) {
  RTCIntersectContext context = incoherent();
  rtcOccluded1(scene, &context, ray);
}
void occluded_eight(const int* valid, RTCScene scene, RTCRay8* ray) {
  RTCIntersectContext context = incoherent();
  rtcOccluded8(valid, scene, &context, ray);
}
void intersect_one(RTCScene scene, RTCRayHit* ray) {
  RTCIntersectContext context = incoherent();
  rtcIntersect1(scene, &context, ray);
}
#endif

}  // namespace

Visibility::Visibility(const Scene& scene) : device_(std::make_unique<Device>()) {
  triangle_count_ = scene.triangle.size();
  if (triangle_count_ == 0) {
    throw Error(ErrorKind::missing,
                fmt::format("{}: no triangles, expected at least one", scene.name));
  }

  // The local frame: only vertices that triangles use may shape it.
  constexpr double kMax = std::numeric_limits<double>::max();
  Vec3 low{kMax, kMax, kMax}, high{-kMax, -kMax, -kMax};
  for (const Triangle& t : scene.triangle) {
    for (const std::uint32_t v : t.vertex) {
      const Vec3& p = scene.position[v];
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  }
  center_ = (low + high) * 0.5;
  const Vec3 half = high - center_;
  const double largest = std::max({half.x, half.y, half.z});
  if (!(largest > 0) || !std::isfinite(largest)) {
    throw Error(ErrorKind::format,
                fmt::format("{}: bounding box half width is {}, expected a finite value above 0",
                            scene.name, largest));
  }
  int exponent = 0;
  std::frexp(largest, &exponent);  // largest in [2^(e-1), 2^e)
  scale_ = std::ldexp(1.0, 1 - exponent);

  device_->device = rtcNewDevice(nullptr);
  if (!device_->device) {
    throw Error(ErrorKind::io, fmt::format("Embree gives no device (error {}), expected one",
                                           static_cast<int>(rtcGetDeviceError(nullptr))));
  }
  device_->packets =
      rtcGetDeviceProperty(device_->device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0;
  RTCGeometry geometry = rtcNewGeometry(device_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* position = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 3 * sizeof(float),
                                                               scene.position.size()));
  auto* index = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), triangle_count_));
  device_->scene = rtcNewScene(device_->device);
  if (!position || !index || !device_->scene) {
    rtcReleaseGeometry(geometry);
    device_->check(fmt::format("{}: {} triangles", scene.name, triangle_count_));
    throw Error(ErrorKind::io, fmt::format("{}: Embree has no room for {} triangles", scene.name,
                                           triangle_count_));
  }
  for (std::size_t v = 0; v < scene.position.size(); ++v) {
    const Vec3 p = to_local(scene.position[v]);
    position[3 * v] = static_cast<float>(p.x);
    position[3 * v + 1] = static_cast<float>(p.y);
    position[3 * v + 2] = static_cast<float>(p.z);
  }
  for (std::size_t t = 0; t < triangle_count_; ++t) {
    for (std::size_t c = 0; c < 3; ++c) index[3 * t + c] = scene.triangle[t].vertex[c];
  }
  device_->position = position;
  device_->corner_index = index;
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(device_->scene, geometry);
  rtcReleaseGeometry(geometry);  // the scene keeps it
  // Robust: no ray slips between triangles that share an edge.
  rtcSetSceneFlags(device_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(device_->scene, RTC_BUILD_QUALITY_HIGH);
  rtcCommitScene(device_->scene);
  device_->check(fmt::format("{}: {} triangles", scene.name, triangle_count_));
}

Visibility::~Visibility() = default;

std::optional<Visibility::Hit> Visibility::first_hit(const Vec3& origin,
                                                     const Vec3& direction) const {
  RTCRayHit ray;
  std::memset(&ray, 0, sizeof ray);
  ray.ray.org_x = static_cast<float>(origin.x);
  ray.ray.org_y = static_cast<float>(origin.y);
  ray.ray.org_z = static_cast<float>(origin.z);
  ray.ray.dir_x = static_cast<float>(direction.x);
  ray.ray.dir_y = static_cast<float>(direction.y);
  ray.ray.dir_z = static_cast<float>(direction.z);
  ray.ray.tfar = kInfinity;
  ray.ray.mask = ~0u;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.primID = RTC_INVALID_GEOMETRY_ID;
  intersect_one(device_->scene, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return Hit{ray.hit.primID, static_cast<double>(ray.hit.u), static_cast<double>(ray.hit.v),
             static_cast<double>(ray.ray.tfar)};
}

unsigned Visibility::occluded8(const std::array<float, 3>& origin, const float* x, const float* y,
                               const float* z, unsigned lanes) const {
  if (!device_->packets) {
    unsigned blocked = 0;
    for (unsigned i = 0; i < 8; ++i) {
      if (!(lanes >> i & 1u)) continue;
      RTCRay ray{};
      ray.org_x = origin[0], ray.org_y = origin[1], ray.org_z = origin[2];
      ray.dir_x = x[i], ray.dir_y = y[i], ray.dir_z = z[i];
      ray.tfar = kInfinity;
      ray.mask = ~0u;
      occluded_one(device_->scene, &ray);
      if (ray.tfar < 0) blocked |= 1u << i;
    }
    return blocked;
  }
  RTCRay8 ray;
  alignas(32) int valid[8];
  for (unsigned i = 0; i < 8; ++i) {
    valid[i] = (lanes >> i & 1u) ? -1 : 0;
    ray.org_x[i] = origin[0], ray.org_y[i] = origin[1], ray.org_z[i] = origin[2];
    ray.dir_x[i] = x[i], ray.dir_y[i] = y[i], ray.dir_z[i] = z[i];
    ray.tnear[i] = 0;
    ray.tfar[i] = kInfinity;
    ray.time[i] = 0;
    ray.mask[i] = ~0u;
    ray.id[i] = i;
    ray.flags[i] = 0;
  }
  occluded_eight(valid, device_->scene, &ray);
  unsigned blocked = 0;
  for (unsigned i = 0; i < 8; ++i) {
    blocked |= static_cast<unsigned>(ray.tfar[i] < 0) << i;  // Embree writes -infinity when blocked
  }
  return blocked & lanes;
}

Vec3 Visibility::corner(std::uint32_t triangle, int corner) const {
  const std::uint32_t v = device_->corner_index[3 * std::size_t{triangle} + std::size_t(corner)];
  const float* p = device_->position + 3 * std::size_t{v};
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

}  // namespace haarlight
