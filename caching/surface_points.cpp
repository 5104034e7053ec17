// What the pixels of a picture see, lit directly.

#include "caching/surface_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "caching/frame_tracer.h"
#include "caching/gather_points.h"
#include "core/hash_bits.h"
#include "core/parallel.h"
#include "precompute/random.h"

namespace haarlight {
namespace {

constexpr int kMostMirrors = 8;
constexpr double kLeastWeight = 1e-3;
constexpr double kFarOff = 1e4;       // origins beyond: single rays, which begin nearer
constexpr int kWide = 32, kHigh = 4;  // of a tile, pixels

std::array<float, 3> floats(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

// Rays of a tile of pixels, all of one depth at a time: eight that lie beside
// each other go together.
class Tile {
 public:
  Tile(const MovingVisibility& scene, const SurfacePointOptions& options,
       std::span<const VirtualLight> shining)
      : scene_(scene), options_(options), shining_(shining) {
    lamps_ = scene.frame().light;
    for (const SceneLight& sun : scene.frame().suns()) lamps_.push_back(sun);
    for (SceneLight& lamp : lamps_) {
      lamp.position = scene.to_local(lamp.position);
      packet_.emplace_back().origin = floats(lamp.position);
    }
    for (const VirtualLight& place : shining)
      packet_.emplace_back().origin = floats(just_off(place));
  }

  // `keys` (of random numbers) and `ways` of the pixels.
  void look(const Vec3& eye, std::span<const std::uint64_t> keys, std::span<const Vec3> ways) {
    keys_ = keys;
    light_.assign(keys.size(), {});
    point_.clear(), next_.clear();
    for (std::uint32_t i = 0; i < ways.size(); ++i) {
      next_.push_back({eye, ways[i], {1, 1, 1}, i, 0, true, true});
    }
    while (!next_.empty()) {
      now_.swap(next_);
      next_.clear();
      meet();
    }
    for (Packet& packet : packet_) flush(packet);
    in_order();
  }

  // All but what points add, by pixel.
  std::span<const RgbD> light() const { return light_; }
  // By pixel; what is seen straight first, then what the first mirrors show,
  // and so on.
  std::span<const SurfacePoint> points(std::size_t pixel) const {
    return {sorted_.data() + first_[pixel], first_[pixel + 1] - first_[pixel]};
  }

 private:
  struct Ray {
    Vec3 from, way;
    RgbD weight;
    std::uint32_t pixel;
    int mirrors;
    bool lobes;   // whether narrow lobes are followed
    bool shines;  // whether what it meets is seen to shine: not where direct()
                  // has counted it
  };
  // Segments from one light, and what arrives by them.
  struct Packet {
    std::array<float, 3> origin{};
    alignas(32) std::array<float, 8> x{}, y{}, z{};
    std::array<RgbD, 8> light;
    std::array<std::uint32_t, 8> pixel{};
    std::size_t count = 0;
  };

  void meet() {
    Visibility::Rays8 rays;
    Visibility::Hits8 hits;
    for (std::size_t begin = 0; begin < now_.size(); begin += 8) {
      const std::size_t count = std::min<std::size_t>(8, now_.size() - begin);
      for (std::size_t i = 0; i < count; ++i) {
        const Ray& ray = now_[begin + i];
        rays.set(i, floats(ray.from), ray.way, std::numeric_limits<double>::infinity());
      }
      rays.lanes = (1u << count) - 1;
      hits.found = 0;
      scene_.first_hits8(rays, hits, now_[begin].mirrors == 0);
      for (std::size_t i = 0; i < count; ++i) {
        const Ray& ray = now_[begin + i];
        std::optional<Visibility::Hit> hit;
        if (dot(ray.from, ray.from) > kFarOff * kFarOff) {
          hit = scene_.first_hit(ray.from, ray.way);
        } else if (hits.found >> i & 1u) {
          hit = hits.hit(i, rays);
        }
        shade(ray, hit);
      }
    }
  }

  void shade(const Ray& ray, const std::optional<Visibility::Hit>& hit) {
    const AnimatedFrame& frame = scene_.frame();
    RgbD& light = light_[ray.pixel];
    if (!hit) {
      light += ray.weight * (ray.shines ? frame.background_from(ray.way)
                                        : frame.background_without_suns(ray.way));
      return;
    }
    const SurfaceHit surface = scene_.surface(*hit, ray.way);
    const Emission& emission = frame.emission[surface.material];
    if (ray.shines && (surface.outside || emission.both_sides)) {
      light += ray.weight * emission.radiance;
    }
    const Bsdf bsdf = bsdf_at(frame.scene, surface);
    if (!bsdf.is_specular()) {
      direct(ray, surface, bsdf);
      const LobeKind lobe = lobe_kind(bsdf);
      const bool narrow = lobe == LobeKind::glossy || lobe == LobeKind::narrow;
      RgbD even = broad_reflectance(bsdf);
      // At the end of the way a lobe is as good as an even one.
      if (narrow && !ray.lobes) even += bsdf.lobe_albedo();
      if (l1_norm(even) > 0) add(ray, *hit, surface, ray.weight * even * (1 / kPi));
      if (narrow && ray.lobes) follow_lobe(ray, surface, bsdf);
    }
    if (ray.mirrors == kMostMirrors) return;
    for (int d = 0; d < bsdf.delta_count; ++d) {
      const Bsdf::Delta& delta = bsdf.delta[static_cast<std::size_t>(d)];
      RgbD on = ray.weight * delta.weight;
      if (!(luminance(on) > kLeastWeight)) continue;
      const Vec3 next = normalize(delta.direction);
      const Vec3 start = FrameTracer::off_surface(surface.position, surface.geometric_normal, next);
      if (delta.transmitted && delta.enters) on = on * swallowed(surface.material, start, next);
      next_.push_back({start, next, on, ray.pixel, ray.mirrors + 1, ray.lobes, true});
    }
  }

  // What glass leaves of light on the way to its other side.
  RgbD swallowed(std::uint32_t material, const Vec3& from, const Vec3& way) const {
    const RgbD e(scene_.frame().scene.material[material].extinction);
    if (!(l1_norm(e) > 0)) return {1, 1, 1};
    const auto far = scene_.first_hit(from, way);
    if (!far) return {1, 1, 1};
    const double metres = far->distance / scene_.scale();
    return {std::exp(-e.r * metres), std::exp(-e.g * metres), std::exp(-e.b * metres)};
  }

  // Light that arrives if nothing is between `source` and a surface; by way of
  // a packet.
  void wait_for(Packet& packet, const Vec3& source, const Vec3& end, const Ray& ray,
                const RgbD& light) {
    const Vec3 way = end - source;
    const std::size_t i = packet.count++;
    packet.x[i] = static_cast<float>(way.x), packet.y[i] = static_cast<float>(way.y);
    packet.z[i] = static_cast<float>(way.z);
    packet.light[i] = light, packet.pixel[i] = ray.pixel;
    if (packet.count == 8) flush(packet);
  }

  void flush(Packet& packet) {
    if (packet.count == 0) return;
    const unsigned blocked = scene_.occluded8(packet.origin, packet.x.data(), packet.y.data(),
                                              packet.z.data(), (1u << packet.count) - 1);
    for (std::size_t i = 0; i < packet.count; ++i) {
      if (!(blocked >> i & 1u)) light_[packet.pixel[i]] += packet.light[i];
    }
    packet.count = 0;
  }

  void direct(const Ray& ray, const SurfaceHit& surface, const Bsdf& bsdf) {
    const double per_area = scene_.scale() * scene_.scale();
    for (std::size_t n = 0; n < lamps_.size(); ++n) {
      const SceneLight& lamp = lamps_[n];
      const bool distant = lamp.kind == SceneLight::Kind::directional;
      LightArrival a = light_at(lamp, surface.position);
      if (!distant) a.irradiance *= per_area;
      if (!(l1_norm(a.irradiance) > 0)) continue;
      const RgbD f = reflected(bsdf, a.from);
      if (!(l1_norm(f) > 0)) continue;
      const RgbD light = ray.weight * f * a.irradiance;
      if (distant) {
        const Segment s = segment_towards(surface.position, surface.geometric_normal, a.from);
        if (!scene_.occluded(s)) light_[ray.pixel] += light;
        continue;
      }
      wait_for(packet_[n], lamp.position,
               FrameTracer::off_surface(surface.position, surface.geometric_normal, a.from), ray,
               light);
    }
    for (std::size_t n = 0; n < shining_.size(); ++n) {
      const VirtualLight& place = shining_[n];
      const Vec3 way = place.position - surface.position;
      const double square = dot(way, way), there = -dot(place.normal, way);
      if (!(there > 0) || !(square > 0)) continue;
      const double distance = std::sqrt(square);
      const RgbD f = reflected(bsdf, way * (1 / distance));
      if (!(l1_norm(f) > 0)) continue;
      const RgbD light = ray.weight * f * place.intensity * (there / (distance * square));
      const Vec3 source = just_off(place);
      const Vec3 end = FrameTracer::off_surface(surface.position, surface.geometric_normal, way);
      // Where both ends have passed each other there is nothing in between.
      if (!(dot(source - end, way) > 0)) {
        light_[ray.pixel] += light;
      } else {
        wait_for(packet_[lamps_.size() + n], source, end, ray, light);
      }
    }
  }

  static Vec3 just_off(const VirtualLight& place) {
    return place.position + place.geometric_normal * Visibility::kSurfaceOffset;
  }

  void add(const Ray& ray, const Visibility::Hit& hit, const SurfaceHit& surface,
           const RgbD& weight) {
    SurfacePoint p;
    p.place = {hit.triangle, hit.b1, hit.b2, surface.outside};
    p.position = surface.position, p.geometric_normal = surface.geometric_normal;
    p.normal = smooth_normal(scene_.frame().scene, hit, surface.geometric_normal);
    p.weight = weight;
    point_.emplace_back(ray.pixel, p);
  }

  void follow_lobe(const Ray& ray, const SurfaceHit& surface, const Bsdf& bsdf) {
    PathRandom random(mix_bits(keys_[ray.pixel], static_cast<std::uint64_t>(ray.mirrors)));
    const double su = random.next(), sv = random.next();
    for (int s = 0; s < options_.glossy_samples; ++s) {
      const double u = (s + su) / options_.glossy_samples;
      const double w = sv + s * 0.6180339887498949;
      const auto sample = bsdf.sample_lobe(u, w - std::floor(w));
      if (!sample || !(dot(sample->direction, surface.geometric_normal) > 0)) continue;
      const Bsdf::LobeValues lobe = bsdf.lobe_values(sample->direction);
      const RgbD f = bsdf.gloss_first * lobe.first + bsdf.gloss_second * lobe.second;
      const RgbD on = ray.weight * f * (1 / (sample->pdf * options_.glossy_samples));
      if (!(luminance(on) > 0)) continue;
      next_.push_back(
          {FrameTracer::off_surface(surface.position, surface.geometric_normal, sample->direction),
           sample->direction, on, ray.pixel, kMostMirrors, false, false});
    }
  }

  void in_order() {
    first_.assign(keys_.size() + 1, 0);
    for (const auto& [pixel, p] : point_) ++first_[pixel + 1];
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    at_.assign(first_.begin(), first_.end());
    sorted_.resize(point_.size());
    for (const auto& [pixel, p] : point_) sorted_[at_[pixel]++] = p;
  }

  const MovingVisibility& scene_;
  const SurfacePointOptions& options_;
  std::span<const VirtualLight> shining_;
  std::vector<SceneLight> lamps_;  // local, suns of the background last
  std::span<const std::uint64_t> keys_;
  std::vector<RgbD> light_;
  std::vector<Ray> now_, next_;
  std::vector<Packet> packet_;                                 // of lamps_, then of shining_
  std::vector<std::pair<std::uint32_t, SurfacePoint>> point_;  // and their pixels
  std::vector<SurfacePoint> sorted_;
  std::vector<std::size_t> first_, at_;
};

}  // namespace

void surface_points(const MovingVisibility& scene, const Camera& camera,
                    const SurfacePointOptions& options, Image& picture,
                    std::vector<SurfaceRow>& rows,
                    const std::function<void(int rows_done)>& progress_row) {
  const std::vector<VirtualLight> shining = shining_places(scene, options.light_points);
  const Vec3 eye = scene.to_local(camera.position);
  picture = Image(camera.width, camera.height);
  rows.resize(static_cast<std::size_t>(camera.height));
  constexpr int kRows = 32;  // between two looks at the clock
  for (int top = 0; top < camera.height; top += kRows) {
    const int rows_here = std::min(kRows, camera.height - top);
    parallel_for((rows_here + kHigh - 1) / kHigh, [&](int band) {
      const int first = top + kHigh * band, high = std::min(kHigh, top + rows_here - first);
      for (int v = 0; v < high; ++v) {
        SurfaceRow& row = rows[static_cast<std::size_t>(first + v)];
        row.point.clear(), row.first.clear();
      }
      Tile tile(scene, options, shining);
      std::vector<std::uint64_t> keys;
      std::vector<Vec3> ways;
      for (int left = 0; left < camera.width; left += kWide) {
        const int wide = std::min(kWide, camera.width - left);
        keys.clear(), ways.clear();
        // Column by column: eight pixels are two by four.
        for (int u = 0; u < wide; ++u) {
          for (int v = 0; v < high; ++v) {
            keys.push_back(mix_bits(1, picture.index(left + u, first + v)));
            ways.push_back(camera.direction(left + u + 0.5, first + v + 0.5));
          }
        }
        tile.look(eye, keys, ways);
        for (int v = 0; v < high; ++v) {
          SurfaceRow& row = rows[static_cast<std::size_t>(first + v)];
          for (int u = 0; u < wide; ++u) {
            const auto pixel = static_cast<std::size_t>(u * high + v);
            const auto points = tile.points(pixel);
            row.first.push_back(row.point.size());
            row.point.insert(row.point.end(), points.begin(), points.end());
            picture.at(left + u, first + v) = Rgb(tile.light()[pixel]);
          }
        }
      }
      for (int v = 0; v < high; ++v) {
        SurfaceRow& row = rows[static_cast<std::size_t>(first + v)];
        row.first.push_back(row.point.size());
      }
    });
    if (progress_row) progress_row(top + rows_here);
  }
}

}  // namespace haarlight
