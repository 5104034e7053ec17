// One pixel -> the points whose light it shows.

#include "precompute/pixel_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "precompute/surface.h"

namespace haarlight {
namespace {

constexpr int kMostSamples = 16;
const double kSimilarCosine = std::cos(8 * kPi / 180);

// A number in [0, 1) that depends on nothing but its arguments (SplitMix64's mixer).
double hashed_unit(std::uint64_t pixel, std::uint64_t counter) {
  std::uint64_t z = pixel * 64 + counter + 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  z ^= z >> 31;
  return static_cast<double>(z >> 11) * 0x1p-53;
}

// Whether both lie on one smooth piece of surface, as far as a pixel of this width can tell.
bool similar(const SurfaceHit& a, const SurfaceHit& b, double pixel_width) {
  if (a.material != b.material) return false;
  if (dot(a.normal, b.normal) < kSimilarCosine) return false;
  if (dot(a.geometric_normal, b.geometric_normal) < kSimilarCosine) return false;
  const double off_plane = std::abs(dot(b.position - a.position, a.geometric_normal));
  return off_plane <= pixel_width * a.distance;
}

}  // namespace

PixelSampler::PixelSampler(const Scene& scene, const Visibility& visibility, const Camera& camera,
                           int samples)
    : scene_(scene),
      visibility_(visibility),
      camera_(camera),
      eye_(visibility.to_local(camera.position)),
      side_(static_cast<int>(std::lround(std::sqrt(samples)))),
      pixel_width_(2 * std::tan(0.5 * camera.vertical_fov) / camera.height) {}

void PixelSampler::sample(int x, int y, std::vector<PixelPoint>& points, RayCounts& counts) const {
  points.clear();
  const auto shoot = [&](double px, double py) {
    ++counts.primary;
    return surface_hit(scene_, visibility_, eye_, camera_.direction(px, py));
  };
  const auto add = [&](const SurfaceHit& hit, double weight, const Rgb& albedo) {
    points.push_back(
        {shading_point(scene_, hit), weight, albedo, scene_.material[hit.material].specular});
  };
  if (side_ == 1) {
    if (const auto hit = shoot(x + 0.5, y + 0.5)) add(*hit, 1, hit->albedo);
    return;
  }

  std::array<SurfaceHit, kMostSamples> hits;
  std::size_t count = 0, nearest = 0;
  double nearest_off = 1e9;
  const std::uint64_t pixel =
      static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(camera_.width) +
      static_cast<std::uint64_t>(x);
  for (int s = 0; s < side_ * side_; ++s) {
    const auto counter = static_cast<std::uint64_t>(2 * s);
    const double px = (s % side_ + hashed_unit(pixel, counter)) / side_;
    const double py = (s / side_ + hashed_unit(pixel, counter + 1)) / side_;
    const auto hit = shoot(x + px, y + py);
    if (!hit) continue;
    const double off = (px - 0.5) * (px - 0.5) + (py - 0.5) * (py - 0.5);
    if (off < nearest_off) nearest_off = off, nearest = count;
    hits[count++] = *hit;
  }
  if (count == 0) return;

  const double share = 1.0 / (side_ * side_);
  const SurfaceHit& reference = hits[nearest];
  bool one_piece = true;
  RgbD albedo;
  for (std::size_t i = 0; i < count; ++i) {
    one_piece = one_piece && similar(reference, hits[i], pixel_width_);
    albedo += RgbD(hits[i].albedo);
  }
  if (!one_piece) {
    for (std::size_t i = 0; i < count; ++i) add(hits[i], share, hits[i].albedo);
    return;
  }
  albedo *= 1.0 / static_cast<double>(count);
  const double weight = share * static_cast<double>(count);
  const auto middle = shoot(x + 0.5, y + 0.5);
  if (middle && similar(reference, *middle, pixel_width_)) {
    add(*middle, weight, Rgb(albedo));
  } else {
    add(reference, weight, Rgb(albedo));
  }
}

}  // namespace haarlight
