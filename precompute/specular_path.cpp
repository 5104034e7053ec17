// Follows light backwards through mirrors and glass until it meets something else.

#include "precompute/specular_path.h"

#include <algorithm>
#include <cmath>

namespace haarlight {
namespace {

constexpr int kMostInteractions = 64;
constexpr double kLittle = 0.01;

double largest(const RgbD& c) { return std::max({c.r, c.g, c.b}); }

double luminance_of(const SingleDirections& at) {
  double sum = 0;
  for (int i = 0; i < at.delta_count; ++i) {
    sum += luminance(at.delta[static_cast<std::size_t>(i)].weight);
  }
  return sum;
}

}  // namespace

Vec3 leave_surface(const SurfaceHit& hit, const Vec3& direction) {
  const double side = dot(direction, hit.geometric_normal) < 0 ? -1 : 1;
  return hit.position + (side * Visibility::kSurfaceOffset) * hit.geometric_normal;
}

RgbD weakened(const RgbD& weight, const Material& material, const Visibility& visibility,
              double distance) {
  const RgbD k(material.extinction);
  if (!(l1_norm(k) > 0)) return weight;
  const double metres = visibility.to_world_length(distance);
  if (k.r == k.g && k.g == k.b) return weight * std::exp(-k.r * metres);
  return weight * RgbD(std::exp(-k.r * metres), std::exp(-k.g * metres), std::exp(-k.b * metres));
}

PathEnd follow_specular(const Scene& scene, const Visibility& visibility, const SurfaceHit& first,
                        const SingleDirections& at_first, AtMixed mixed, PathRandom& random,
                        std::int64_t& rays) {
  PathEnd end;
  end.weight = {1, 1, 1};
  SurfaceHit hit = first;
  SingleDirections at = at_first;
  std::uint32_t glass = 0;  // material of the glass the path is in
  bool inside = false;
  for (int interactions = 0;; ++interactions) {
    const double total = luminance_of(at);
    if (!(total > 0) || interactions == kMostInteractions) {
      end.weight = {};
      return end;
    }
    std::size_t chosen = 0;
    if (at.delta_count == 2 && random.next() * total >= luminance(at.delta[0].weight)) {
      chosen = 1;
    }
    const Bsdf::Delta& delta = at.delta[chosen];
    end.weight = end.weight * delta.weight * (total / luminance(delta.weight));
    if (const double left = largest(end.weight); left < kLittle) {
      const double survive = left / kLittle;
      if (random.next() >= survive) {
        end.weight = {};
        return end;
      }
      end.weight *= 1 / survive;
    }
    end.direction = normalize(delta.direction);
    if (delta.transmitted) inside = delta.enters, glass = hit.material;
    ++rays;
    const auto next =
        surface_hit(scene, visibility, leave_surface(hit, end.direction), end.direction);
    if (!next) return end;
    if (inside) {
      end.weight = weakened(end.weight, scene.material[glass], visibility, next->distance);
    }
    hit = *next;
    const Material& material = scene.material[hit.material];
    if (is_mirror_or_glass(material)) {
      at = SingleDirections(material, hit);
      continue;
    }
    const Bsdf bsdf = bsdf_at(scene, hit);
    at = SingleDirections(bsdf);
    bool stop = at.delta_count == 0;
    if (!stop && mixed == AtMixed::choose && !bsdf.is_specular()) {
      const double rest = luminance(bsdf.diffuse_albedo() + bsdf.lobe_albedo());
      const double share = rest / (rest + luminance_of(at));
      stop = random.next() < share;
      end.weight *= 1 / (stop ? share : 1 - share);
    }
    if (stop) {
      end.hit = hit;
      end.bsdf = bsdf;
      end.bsdf.delta_count = 0;
      return end;
    }
  }
}

}  // namespace haarlight
