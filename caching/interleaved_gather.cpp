// Instant global illumination.

#include "caching/interleaved_gather.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "caching/frame_tracer.h"
#include "core/parallel.h"

namespace haarlight {
namespace {

// Segments of one origin, traced eight at a time.
class Packet {
 public:
  Packet(const MovingVisibility& scene, const SurfacePoint& point) : scene_(scene) {
    const Vec3 origin = point.position + point.geometric_normal * Visibility::kSurfaceOffset;
    origin_ = {static_cast<float>(origin.x), static_cast<float>(origin.y),
               static_cast<float>(origin.z)};
    start_ = origin;
  }
  void add(const Vec3& end, const RgbD& light) {
    const Vec3 way = end - start_;
    x_[count_] = static_cast<float>(way.x), y_[count_] = static_cast<float>(way.y);
    z_[count_] = static_cast<float>(way.z);
    light_[count_] = light;
    if (++count_ == 8) flush();
  }
  void flush() {
    if (count_ == 0) return;
    rays += static_cast<std::int64_t>(count_);
    const unsigned lanes = (1u << count_) - 1;
    const unsigned blocked = scene_.occluded8(origin_, x_, y_, z_, lanes);
    for (std::size_t i = 0; i < count_; ++i) {
      if (!(blocked >> i & 1u)) sum += light_[i];
    }
    count_ = 0;
  }
  RgbD sum;
  std::int64_t rays = 0;

 private:
  const MovingVisibility& scene_;
  Vec3 start_;
  std::array<float, 3> origin_{};
  alignas(32) float x_[8]{};
  alignas(32) float y_[8]{};
  alignas(32) float z_[8]{};
  RgbD light_[8];
  std::size_t count_ = 0;
};

bool on_same_surface(const SurfacePoint& a, const SurfacePoint& b, double reach) {
  constexpr double kLeastCosine = 0.9, kMostSlope = 0.3;
  if (!(dot(a.normal, b.normal) > kLeastCosine)) return false;
  const Vec3 way = b.position - a.position;
  const double distance = length(way);
  return distance < reach && std::abs(dot(way, a.normal)) <= kMostSlope * distance;
}

}  // namespace

std::int64_t interleaved_gather(const MovingVisibility& scene, std::span<const VirtualLight> lights,
                                std::span<const SurfaceRow> rows, const InterleavedOptions& options,
                                std::vector<std::vector<RgbD>>& irradiance) {
  const auto n = static_cast<std::size_t>(options.pattern);
  const std::size_t stride = n * n;
  std::vector<std::vector<RgbD>> own(rows.size());
  std::vector<std::int64_t> rays(rows.size());
  constexpr double kFar = 16;  // beyond any scene
  parallel_for(static_cast<int>(rows.size()), [&](int line) {
    const auto y = static_cast<std::size_t>(line);
    const SurfaceRow& row = rows[y];
    own[y].resize(row.point.size());
    for (std::size_t x = 0; x + 1 < row.first.size(); ++x) {
      for (std::size_t i = row.first[x]; i < row.first[x + 1]; ++i) {
        const SurfacePoint& p = row.point[i];
        Packet packet(scene, p);
        for (std::size_t k = y % n * n + x % n; k < lights.size(); k += stride) {
          const VirtualLight& light = lights[k];
          const RgbD c = arrival(light, p.position, p.normal, options.least_distance);
          if (!(l1_norm(c) > 0)) continue;
          if (light.kind == VirtualLight::Kind::distant) {
            if (!(dot(light.position, p.geometric_normal) > 0)) continue;
            packet.add(p.position + light.position * kFar, c);
            continue;
          }
          if (!(dot(light.position - p.position, p.geometric_normal) > 0)) continue;
          packet.add(FrameTracer::off_surface(light.position, light.geometric_normal,
                                              p.position - light.position),
                     c);
        }
        packet.flush();
        rays[y] += packet.rays;
        own[y][i] = packet.sum * static_cast<double>(stride);
      }
    }
  });
  irradiance.resize(rows.size());
  const int before = (options.pattern - 1) / 2, after = options.pattern / 2;
  parallel_for(static_cast<int>(rows.size()), [&](int line) {
    const auto y = static_cast<std::size_t>(line);
    const SurfaceRow& row = rows[y];
    irradiance[y].resize(row.point.size());
    const int top = std::max(line - before, 0);
    const int bottom = std::min(line + after, static_cast<int>(rows.size()) - 1);
    for (int x = 0; x < row.width(); ++x) {
      const auto at = static_cast<std::size_t>(x);
      for (std::size_t i = row.first[at]; i < row.first[at + 1]; ++i) {
        RgbD sum;
        int count = 0;
        for (int v = top; v <= bottom; ++v) {
          const SurfaceRow& other = rows[static_cast<std::size_t>(v)];
          const int left = std::max(x - before, 0), right = std::min(x + after, row.width() - 1);
          for (int u = left; u <= right; ++u) {
            // The same of the pixel's points: what is seen straight, by the first mirror, ...
            const std::size_t j = other.first[static_cast<std::size_t>(u)] + (i - row.first[at]);
            if (j >= other.first[static_cast<std::size_t>(u) + 1]) continue;
            if (!(u == x && v == line) &&
                !on_same_surface(row.point[i], other.point[j], options.reach)) {
              continue;
            }
            sum += own[static_cast<std::size_t>(v)][j];
            ++count;
          }
        }
        irradiance[y][i] = sum * (1.0 / count);
      }
    }
  });
  std::int64_t total = 0;
  for (const std::int64_t r : rays) total += r;
  return total;
}

}  // namespace haarlight
