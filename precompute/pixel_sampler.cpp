// One pixel -> the receivers whose light it shows.

#include "precompute/pixel_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "precompute/random.h"
#include "precompute/specular_path.h"
#include "precompute/surface.h"

namespace haarlight {

/// What one ray from the camera met.
struct PixelSampler::Seen {
  SurfaceHit hit;
  Bsdf bsdf;
};

namespace {

constexpr int kMostSamples = 16;
constexpr int kSplits = 2;  // interactions at which both directions are followed
constexpr int kMostInteractions = 64;
constexpr double kLittle = 0.01;
const double kSimilarCosine = std::cos(8 * kPi / 180);

}  // namespace

PixelSampler::PixelSampler(const Scene& scene, const Visibility& visibility, const Camera& camera,
                           int samples, const Effects& effects)
    : scene_(scene),
      visibility_(visibility),
      camera_(camera),
      effects_(effects),
      eye_(visibility.to_local(camera.position)),
      places_(samples > 1 ? texel_places(samples) : std::vector<TexelPlace>{{0.5, 0.5}}),
      pixel_width_(2 * std::tan(0.5 * camera.vertical_fov) / camera.height) {}

bool PixelSampler::shoot(double px, double py, Seen& seen, RayCounts& counts) const {
  ++counts.primary;
  const auto hit = surface_hit(scene_, visibility_, eye_, camera_.direction(px, py));
  if (!hit) return false;
  seen.hit = *hit;
  seen.bsdf = bsdf_at(scene_, *hit);
  if (!effects_.gloss) seen.bsdf.lobe = Bsdf::Lobe::none;
  return true;
}

void PixelSampler::add(const Seen& seen, double weight, std::uint32_t row,
                       TileReceivers& tile) const {
  Receiver receiver{row, {weight, weight, weight}, seen.hit.position, seen.bsdf};
  receiver.bsdf.delta_count = 0;
  tile.receivers.push_back(receiver);
}

void PixelSampler::look_through(const Seen& first, double weight, double receiver_weight,
                                std::uint64_t key, std::uint32_t row, TileReceivers& tile,
                                RayCounts& counts) const {
  struct Branch {
    Seen seen;
    RgbD weight;
    int interactions;
    bool inside;          // glass
    std::uint32_t glass;  // its material
  };
  PathRandom random(key);
  std::vector<Branch> todo{{first, {weight, weight, weight}, 0, false, 0}};
  while (!todo.empty()) {
    const Branch at = todo.back();
    todo.pop_back();
    const Bsdf& b = at.seen.bsdf;
    if (receiver_weight > 0 && (b.has_diffuse() || b.has_lobe())) {
      Receiver receiver{row, at.weight * receiver_weight, at.seen.hit.position, b};
      receiver.bsdf.delta_count = 0;
      tile.receivers.push_back(receiver);
    }
    if (b.delta_count == 0 || at.interactions == kMostInteractions) continue;
    double total = 0;
    for (int i = 0; i < b.delta_count; ++i) {
      total += luminance(b.delta[static_cast<std::size_t>(i)].weight);
    }
    if (!(total > 0)) continue;
    int from = 0, to = b.delta_count;
    double chance = 1;
    if (at.interactions >= kSplits && b.delta_count == 2) {
      from = random.next() * total < luminance(b.delta[0].weight) ? 0 : 1;
      to = from + 1;
      chance = luminance(b.delta[static_cast<std::size_t>(from)].weight) / total;
    }
    for (int i = from; i < to; ++i) {
      const Bsdf::Delta& delta = b.delta[static_cast<std::size_t>(i)];
      RgbD through = at.weight * delta.weight * (1 / chance);
      const double left = std::max({through.r, through.g, through.b});
      if (!(left > 0)) continue;
      if (left < kLittle * weight) {
        const double survive = left / (kLittle * weight);
        if (random.next() >= survive) continue;
        through *= 1 / survive;
      }
      ++counts.specular;
      const auto next = surface_hit(scene_, visibility_,
                                    leave_surface(at.seen.hit, delta.direction), delta.direction);
      if (!next) {
        tile.escapes.push_back({row, through, delta.direction});
        continue;
      }
      const bool inside = delta.transmitted ? delta.enters : at.inside;
      const std::uint32_t glass = delta.transmitted ? at.seen.hit.material : at.glass;
      if (inside) through = weakened(through, scene_.material[glass], visibility_, next->distance);
      Branch on{{*next, bsdf_at(scene_, *next)}, through, at.interactions + 1, inside, glass};
      if (!effects_.gloss) on.seen.bsdf.lobe = Bsdf::Lobe::none;
      todo.push_back(on);
    }
  }
}

double PixelSampler::sample(int x, int y, std::uint32_t row, TileReceivers& tile,
                            RayCounts& counts) const {
  const std::uint64_t pixel =
      static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(camera_.width) +
      static_cast<std::uint64_t>(x);
  std::array<Seen, kMostSamples> seen;
  int count = 0;
  std::size_t nearest = 0;
  double nearest_off = 1e9;
  for (const TexelPlace& place : places_) {
    Seen& one = seen[static_cast<std::size_t>(count)];
    if (!shoot(x + place.u, y + place.v, one, counts)) continue;
    const double off = (place.u - 0.5) * (place.u - 0.5) + (place.v - 0.5) * (place.v - 0.5);
    if (off < nearest_off) nearest_off = off, nearest = static_cast<std::size_t>(count);
    ++count;
  }
  if (count == 0) return 0;
  const double share = 1.0 / static_cast<double>(places_.size());
  const auto end = seen.begin() + count;

  const bool through =
      std::any_of(seen.begin(), end, [](const Seen& s) { return s.bsdf.delta_count > 0; });
  if (through && effects_.specular) {
    constexpr int kSide = 4;
    const std::uint64_t key = mix_bits(1, pixel);
    if (places_.size() == 1) {
      look_through(seen[0], 1, 1, key, row, tile, counts);
      return 1;
    }
    int met = 0;
    for (int s = 0; s < kSide * kSide; ++s) {
      const std::uint64_t counter = pixel * 64 + 32 + static_cast<std::uint64_t>(2 * s);
      const double px = (s % kSide + unit_number(mix_bits(0, counter))) / kSide;
      const double py = (s / kSide + unit_number(mix_bits(0, counter + 1))) / kSide;
      Seen one;
      if (!shoot(x + px, y + py, one, counts)) continue;
      ++met;
      const bool receives = (s / kSide + s) % 4 == 0;  // four places, one in each row and column
      look_through(one, 1.0 / (kSide * kSide), receives ? 4 : 0,
                   mix_bits(key, static_cast<std::uint64_t>(s)), row, tile, counts);
    }
    return static_cast<double>(met) / (kSide * kSide);
  }

  const Seen& reference = seen[nearest];
  const auto similar = [&](const Seen& other) {
    const SurfaceHit& a = reference.hit;
    const SurfaceHit& b = other.hit;
    if (a.material != b.material) return false;
    if (dot(reference.bsdf.normal, other.bsdf.normal) < kSimilarCosine) return false;
    if (dot(a.geometric_normal, b.geometric_normal) < kSimilarCosine) return false;
    const double off_plane = std::abs(dot(b.position - a.position, a.geometric_normal));
    return off_plane <= pixel_width_ * a.distance;
  };
  if (places_.size() == 1 || !std::all_of(seen.begin(), end, similar)) {
    for (auto s = seen.begin(); s != end; ++s) add(*s, share, row, tile);
    return share * count;
  }
  RgbD diffuse, first, second;
  for (auto s = seen.begin(); s != end; ++s) {
    diffuse += s->bsdf.diffuse_reflectance;
    first += s->bsdf.gloss_first;
    second += s->bsdf.gloss_second;
  }
  Seen middle;
  if (!shoot(x + 0.5, y + 0.5, middle, counts) || !similar(middle)) middle = reference;
  middle.bsdf.diffuse_reflectance = diffuse * (1.0 / count);
  middle.bsdf.gloss_first = first * (1.0 / count);
  middle.bsdf.gloss_second = second * (1.0 / count);
  add(middle, share * count, row, tile);
  return share * count;
}

}  // namespace haarlight
