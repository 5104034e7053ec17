// Which rays are blocked: the triangles of a scene in Embree.

#include "precompute/visibility.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "core/error.h"
#include "precompute/alpha_holes.h"
#include "precompute/bsdf.h"

#if HAARLIGHT_EMBREE == 4
#include <embree4/rtcore.h>
#elif HAARLIGHT_EMBREE == 3
#include <embree3/rtcore.h>
#else
#error "HAARLIGHT_EMBREE must be 3 or 4"
#endif

namespace haarlight {

namespace {

// Triangles by what rays do with them; each kind is one geometry of Embree.
enum Kind : std::size_t {
  opaque,
  opaque_holed,
  glossy,
  glossy_holed,
  specular,
  specular_holed,
  kinds
};

bool is_holed(std::size_t kind) { return kind % 2 != 0; }

Kind kind_of(const Material& material) {
  const bool holed = material.alpha_cutoff > 0;
  if (has_single_directions(material)) return holed ? specular_holed : specular;
  if (may_have_narrow_lobe(material)) return holed ? glossy_holed : glossy;
  return holed ? opaque_holed : opaque;
}

unsigned mask_of(std::size_t kind) {
  if (kind >= specular) return Visibility::kSpecular;
  return kind >= glossy ? Visibility::kOpaque | Visibility::kGlossy : Visibility::kOpaque;
}

}  // namespace

struct Visibility::Device {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  const float* position = nullptr;              // in Embree's buffer, 3 a vertex
  const std::uint32_t* corner_index = nullptr;  // in Embree's buffer, 3 a place
  bool packets = false;                         // 8-wide packets are native
  // Embree's triangles are in the order of their kinds. Where there is more than one kind:
  std::array<std::uint32_t, kinds> first{};  // the place where each begins
  std::vector<std::uint32_t> triangle_at;    // of a place; empty: the same number
  std::vector<std::uint32_t> place_of;       // of a triangle
  std::array<AlphaHoles, kinds> holes;

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
void intersect_eight(const int* valid, RTCScene scene, RTCRayHit8* ray, bool coherent) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
  rtcIntersect8(valid, scene, ray, &arguments);
}
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
void intersect_eight(const int* valid, RTCScene scene, RTCRayHit8* ray, bool coherent) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags =
      coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  rtcIntersect8(valid, scene, &context, ray);
}
#endif

// Takes back hits in holes.
void pass_holes(const RTCFilterFunctionNArguments* arguments) {
  const auto& holes = *static_cast<const AlphaHoles*>(arguments->geometryUserPtr);
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (arguments->valid[i] == 0) continue;
    const auto b1 = static_cast<double>(RTCHitN_u(arguments->hit, arguments->N, i));
    const auto b2 = static_cast<double>(RTCHitN_v(arguments->hit, arguments->N, i));
    if (holes.is_hole(RTCHitN_primID(arguments->hit, arguments->N, i), b1, b2)) {
      arguments->valid[i] = 0;
    }
  }
}

// A buffer of Embree, let go of at the end of the scope; geometries keep what they use.
struct Buffer {
  RTCBuffer buffer;
  void* data;

  // Embree reads up to 16 bytes at once: past the end, too.
  Buffer(RTCDevice device, std::size_t bytes)
      : buffer(rtcNewBuffer(device, bytes + 16)),
        data(buffer ? rtcGetBufferData(buffer) : nullptr) {}
  ~Buffer() {
    if (buffer) rtcReleaseBuffer(buffer);
  }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;
};

// One device for all parts of scenes, which come and go every frame: a device of its own costs more
// than a small part does.
RTCDevice device_of_parts() {
  struct Shared {
    RTCDevice device = rtcNewDevice(nullptr);
    ~Shared() {
      if (device) rtcReleaseDevice(device);
    }
  };
  static const Shared shared;
  if (shared.device) rtcRetainDevice(shared.device);
  return shared.device;
}

}  // namespace

Visibility::LocalFrame Visibility::local_frame(const Scene& scene) {
  if (scene.triangle.empty()) {
    throw Error(ErrorKind::missing,
                fmt::format("{}: no triangles, expected at least one", scene.name));
  }

  // Only vertices that triangles use may shape it.
  constexpr double kMax = std::numeric_limits<double>::max();
  Vec3 low{kMax, kMax, kMax}, high{-kMax, -kMax, -kMax};
  for (const Triangle& t : scene.triangle) {
    for (const std::uint32_t v : t.vertex) {
      const Vec3& p = scene.position[v];
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  }
  LocalFrame frame;
  frame.center = (low + high) * 0.5;
  const Vec3 half = high - frame.center;
  const double largest = std::max({half.x, half.y, half.z});
  if (!(largest > 0) || !std::isfinite(largest)) {
    throw Error(ErrorKind::format, fmt::format("{}: bounding box half width is {}, expected a "
                                               "finite value above 0",
                                               scene.name, largest));
  }
  int exponent = 0;
  std::frexp(largest, &exponent);  // largest in [2^(e-1), 2^e)
  frame.scale = std::ldexp(1.0, 1 - exponent);
  return frame;
}

Visibility::Visibility(const Scene& scene) : device_(std::make_unique<Device>()) {
  const LocalFrame frame = local_frame(scene);
  center_ = frame.center, scale_ = frame.scale;
  build(scene, nullptr);
}

Visibility::Visibility(const Scene& scene, const LocalFrame& frame,
                       std::span<const std::uint32_t> triangles)
    : device_(std::make_unique<Device>()), center_(frame.center), scale_(frame.scale) {
  const std::vector<std::uint32_t> part(triangles.begin(), triangles.end());
  if (part.empty()) {
    throw Error(ErrorKind::missing,
                fmt::format("{}: a part without triangles, expected at least one", scene.name));
  }
  build(scene, &part);
}

void Visibility::build(const Scene& scene, const std::vector<std::uint32_t>* part) {
  triangle_count_ = part ? part->size() : scene.triangle.size();
  const auto number = [&](std::size_t i) { return part ? (*part)[i] : i; };
  device_->device = part ? device_of_parts() : rtcNewDevice(nullptr);
  if (!device_->device) {
    throw Error(ErrorKind::io, fmt::format("Embree gives no device (error {}), expected one",
                                           static_cast<int>(rtcGetDeviceError(nullptr))));
  }
  device_->packets =
      rtcGetDeviceProperty(device_->device, RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) != 0;

  std::array<std::size_t, kinds> count{};
  for (std::size_t i = 0; i < triangle_count_; ++i) {
    ++count[kind_of(scene.material[scene.triangle[number(i)].material])];
  }
  has_specular_ = count[specular] + count[specular_holed] > 0;
  // Lobes are looked for to have less noise: without masks they are found by chance.
  const bool masks =
      rtcGetDeviceProperty(device_->device, RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED) != 0;
  has_glossy_ = masks && count[glossy] + count[glossy_holed] > 0;
  has_holes_ = count[opaque_holed] + count[glossy_holed] + count[specular_holed] > 0;
  if ((has_specular_ && !masks) ||
      (has_holes_ &&
       rtcGetDeviceProperty(device_->device, RTC_DEVICE_PROPERTY_FILTER_FUNCTION_SUPPORTED) == 0)) {
    throw Error(ErrorKind::io, fmt::format("{}: Embree was built without ray masks or filter "
                                           "functions, expected both for mirrors, glass and holes",
                                           scene.name));
  }
  for (std::size_t k = 1; k < kinds; ++k) {
    device_->first[k] = device_->first[k - 1] + static_cast<std::uint32_t>(count[k - 1]);
  }
  const bool mixed = part || std::count(count.begin(), count.end(), triangle_count_) == 0;
  // A part takes the vertices it names, which lie beside each other if it is one body.
  std::size_t first_vertex = 0, vertices = scene.position.size();
  if (part) {
    std::size_t end = 0;
    first_vertex = vertices;
    for (const std::uint32_t t : *part) {
      for (const std::size_t v : scene.triangle[t].vertex) {
        first_vertex = std::min(first_vertex, v), end = std::max(end, v + 1);
      }
    }
    vertices = end - first_vertex;
  }

  device_->scene = rtcNewScene(device_->device);
  const Buffer positions(device_->device, 3 * sizeof(float) * vertices);
  const Buffer indices(device_->device, 3 * sizeof(std::uint32_t) * triangle_count_);
  if (!positions.data || !indices.data || !device_->scene) {
    device_->check(fmt::format("{}: {} triangles", scene.name, triangle_count_));
    throw Error(ErrorKind::io, fmt::format("{}: Embree has no room for {} triangles", scene.name,
                                           triangle_count_));
  }
  auto* position = static_cast<float*>(positions.data);
  for (std::size_t v = 0; v < vertices; ++v) {
    const Vec3 p = to_local(scene.position[first_vertex + v]);
    position[3 * v] = static_cast<float>(p.x);
    position[3 * v + 1] = static_cast<float>(p.y);
    position[3 * v + 2] = static_cast<float>(p.z);
  }
  auto* index = static_cast<std::uint32_t*>(indices.data);
  if (mixed) {
    device_->triangle_at.resize(triangle_count_), device_->place_of.resize(scene.triangle.size());
  }
  std::array<std::uint32_t, kinds> next = device_->first;
  for (std::size_t i = 0; i < triangle_count_; ++i) {
    const std::size_t t = number(i);
    const Triangle& triangle = scene.triangle[t];
    const Kind kind = kind_of(scene.material[triangle.material]);
    const std::size_t place = next[kind]++;
    for (std::size_t c = 0; c < 3; ++c) {
      index[3 * place + c] = triangle.vertex[c] - static_cast<std::uint32_t>(first_vertex);
    }
    if (is_holed(kind)) device_->holes[kind].add(scene, triangle);
    if (!mixed) continue;
    device_->triangle_at[place] = static_cast<std::uint32_t>(t);
    device_->place_of[t] = static_cast<std::uint32_t>(place);
  }
  device_->position = position;
  device_->corner_index = index;
  for (std::size_t k = 0; k < kinds; ++k) {
    if (count[k] == 0) continue;
    RTCGeometry geometry = rtcNewGeometry(device_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions.buffer,
                         0, 3 * sizeof(float), vertices);
    rtcSetGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices.buffer,
                         3 * sizeof(std::uint32_t) * device_->first[k], 3 * sizeof(std::uint32_t),
                         count[k]);
    rtcSetGeometryMask(geometry, mask_of(k));
    if (is_holed(k)) {
      rtcSetGeometryUserData(geometry, &device_->holes[k]);
      rtcSetGeometryIntersectFilterFunction(geometry, pass_holes);
      rtcSetGeometryOccludedFilterFunction(geometry, pass_holes);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(device_->scene, geometry, static_cast<unsigned>(k));
    rtcReleaseGeometry(geometry);  // the scene keeps it
  }
  // Robust: no ray slips between triangles that share an edge.
  rtcSetSceneFlags(device_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(device_->scene, part ? RTC_BUILD_QUALITY_MEDIUM : RTC_BUILD_QUALITY_HIGH);
  rtcCommitScene(device_->scene);
  device_->check(fmt::format("{}: {} triangles", scene.name, triangle_count_));
}

Visibility::~Visibility() = default;

std::optional<Visibility::Hit> Visibility::first_hit(const Vec3& from, const Vec3& direction,
                                                     Surfaces seen) const {
  // From far away single precision would miss the scene, and Embree refuses what is farther still:
  // the ray begins nearer then. All surfaces are within 2 sqrt(3) of the middle.
  constexpr double kFar = 1e4, kNear = 4;
  Vec3 origin = from;
  double skipped = 0;
  if (!(dot(from, from) <= kFar * kFar)) {
    skipped = -dot(from, direction) - kNear;
    origin = from + skipped * direction;
    if (!(skipped > 0) || !(dot(origin, origin) <= 4 * kNear * kNear)) return std::nullopt;
  }
  RTCRayHit ray;
  std::memset(&ray, 0, sizeof ray);
  ray.ray.org_x = static_cast<float>(origin.x);
  ray.ray.org_y = static_cast<float>(origin.y);
  ray.ray.org_z = static_cast<float>(origin.z);
  ray.ray.dir_x = static_cast<float>(direction.x);
  ray.ray.dir_y = static_cast<float>(direction.y);
  ray.ray.dir_z = static_cast<float>(direction.z);
  ray.ray.tfar = kInfinity;
  ray.ray.mask = seen;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.primID = RTC_INVALID_GEOMETRY_ID;
  intersect_one(device_->scene, &ray);
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const std::uint32_t place = device_->first[ray.hit.geomID] + ray.hit.primID;
  return Hit{device_->triangle_at.empty() ? place : device_->triangle_at[place],
             static_cast<double>(ray.hit.u), static_cast<double>(ray.hit.v),
             skipped + static_cast<double>(ray.ray.tfar)};
}

bool Visibility::occluded(const std::array<float, 3>& origin, const Vec3& direction,
                          double distance, Surfaces seen) const {
  RTCRay ray{};
  ray.org_x = origin[0], ray.org_y = origin[1], ray.org_z = origin[2];
  ray.dir_x = static_cast<float>(direction.x);
  ray.dir_y = static_cast<float>(direction.y);
  ray.dir_z = static_cast<float>(direction.z);
  ray.tfar = static_cast<float>(distance);
  ray.mask = seen;
  occluded_one(device_->scene, &ray);
  return ray.tfar < 0;
}

unsigned Visibility::occluded8(const std::array<float, 3>& origin, const float* x, const float* y,
                               const float* z, unsigned lanes, Surfaces seen) const {
  return trace8(origin, x, y, z, lanes, kInfinity, seen);
}

unsigned Visibility::occluded8_segments(const std::array<float, 3>& origin, const float* x,
                                        const float* y, const float* z, unsigned lanes,
                                        Surfaces seen) const {
  return trace8(origin, x, y, z, lanes, 1.0f, seen);
}

unsigned Visibility::trace8(const std::array<float, 3>& origin, const float* x, const float* y,
                            const float* z, unsigned lanes, float distance, Surfaces seen) const {
  if (!device_->packets) {
    unsigned blocked = 0;
    for (unsigned i = 0; i < 8; ++i) {
      if (!(lanes >> i & 1u)) continue;
      RTCRay ray{};
      ray.org_x = origin[0], ray.org_y = origin[1], ray.org_z = origin[2];
      ray.dir_x = x[i], ray.dir_y = y[i], ray.dir_z = z[i];
      ray.tfar = distance;
      ray.mask = seen;
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
    ray.tfar[i] = distance;
    ray.time[i] = 0;
    ray.mask[i] = seen;
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

void Visibility::first_hits8(Rays8& rays, Hits8& hits, bool coherent) const {
  RTCRayHit8 ray;
  alignas(32) int valid[8];
  std::memcpy(ray.ray.org_x, rays.origin[0].data(), sizeof ray.ray.org_x);
  std::memcpy(ray.ray.org_y, rays.origin[1].data(), sizeof ray.ray.org_y);
  std::memcpy(ray.ray.org_z, rays.origin[2].data(), sizeof ray.ray.org_z);
  std::memcpy(ray.ray.dir_x, rays.direction[0].data(), sizeof ray.ray.dir_x);
  std::memcpy(ray.ray.dir_y, rays.direction[1].data(), sizeof ray.ray.dir_y);
  std::memcpy(ray.ray.dir_z, rays.direction[2].data(), sizeof ray.ray.dir_z);
  std::memcpy(ray.ray.tfar, rays.length.data(), sizeof ray.ray.tfar);
  for (unsigned i = 0; i < 8; ++i) {
    valid[i] = (rays.lanes >> i & 1u) ? -1 : 0;
    ray.ray.tnear[i] = ray.ray.time[i] = 0;
    ray.ray.mask[i] = kAll;
    ray.ray.id[i] = i, ray.ray.flags[i] = 0;
    ray.hit.geomID[i] = ray.hit.primID[i] = RTC_INVALID_GEOMETRY_ID;
    ray.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  intersect_eight(valid, device_->scene, &ray, coherent);
  for (unsigned i = 0; i < 8; ++i) {
    if (!(rays.lanes >> i & 1u) || ray.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    const std::uint32_t place = device_->first[ray.hit.geomID[i]] + ray.hit.primID[i];
    hits.triangle[i] = device_->triangle_at.empty() ? place : device_->triangle_at[place];
    hits.b1[i] = ray.hit.u[i], hits.b2[i] = ray.hit.v[i];
    rays.length[i] = ray.ray.tfar[i];
    hits.found |= 1u << i;
  }
}

std::array<Vec3, 3> Visibility::corners(std::uint32_t triangle) const {
  const std::size_t place = device_->place_of.empty() ? triangle : device_->place_of[triangle];
  std::array<Vec3, 3> corners;
  for (std::size_t c = 0; c < 3; ++c) {
    const float* p = device_->position + 3 * std::size_t{device_->corner_index[3 * place + c]};
    corners[c] = {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  }
  return corners;
}

}  // namespace haarlight
