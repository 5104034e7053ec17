// Sampling hemispheres.

#include "caching/hemisphere.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/hash_bits.h"

namespace haarlight {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

constexpr int kLooks = 256;

// The weight of strata against looks of that density: of all samples in a direction, strata's. As
// one stratum's radiance is worth one sample of the strata, a look's is worth as much times this
// weight.
double share_of_strata(const Hemisphere& h, double cosine, double looked) {
  const double strata = static_cast<double>(h.direction.size()) *
                        (h.even ? 1 / (2 * kPi) : std::max(cosine, 0.0) / kPi);
  return strata / (strata + kLooks * looked);
}

Vec3 in_plane(double phi) { return {std::cos(phi), std::sin(phi), 0}; }

}  // namespace

Hemisphere::Coordinates Hemisphere::coordinates_of(const Vec3& d) const {
  const double up = std::min(even ? 1 - std::max(d.z, 0.0) : d.x * d.x + d.y * d.y, 1.0);
  double turn = std::atan2(d.y, d.x) / (2 * kPi);
  if (turn < 0) turn += 1;
  return {up * rings, turn * sectors};
}

std::size_t Hemisphere::stratum_of(const Vec3& d) const {
  const Coordinates at = coordinates_of(d);
  return number(std::min(static_cast<int>(at.ring), rings - 1),
                std::min(static_cast<int>(at.sector), sectors - 1));
}

Hemisphere stratified_hemisphere(int samples, std::uint64_t key, bool even) {
  Hemisphere h;
  h.even = even;
  // Strata about as wide as high: sectors = pi rings (Ward and Heckbert 1992).
  h.rings = std::max(static_cast<int>(std::lround(std::sqrt(samples / kPi))), 1);
  h.sectors = std::max(static_cast<int>(std::lround(kPi * h.rings)), 3);
  const std::size_t count = h.number(h.rings, 0);
  h.direction.resize(count), h.radiance.resize(count), h.distance.assign(count, kInfinite);
  for (int j = 0; j < h.rings; ++j) {
    for (int k = 0; k < h.sectors; ++k) {
      PathRandom random(mix_bits(key, h.number(j, k)));
      const double up = (j + random.next()) / h.rings;
      const double sine2 = even ? up * (2 - up) : up;
      const double phi = 2 * kPi * (k + random.next()) / h.sectors;
      const double sine = std::sqrt(sine2);
      h.direction[h.number(j, k)] = {sine * std::cos(phi), sine * std::sin(phi),
                                     std::sqrt(std::max(1 - sine2, 0.0))};
    }
  }
  return h;
}

RgbD background_by_strata(const AnimatedFrame& frame, const Hemisphere& h, double cosine,
                          const Vec3& direction) {
  if (!frame.environment) return frame.background;
  const Vec3 in_picture = frame.environment_turn.transposed() * direction;
  return frame.background + frame.environment->radiance(in_picture) *
                                share_of_strata(h, cosine, frame.environment->pdf(in_picture));
}

void gather_hemisphere(const FrameTracer& tracer, const PlaceFrame& at, std::uint64_t key,
                       Hemisphere& h, std::vector<SeenPlace>* seen) {
  const Visibility& visibility = tracer.visibility();
  const Vec3 place = visibility.to_local(at.position);
  if (seen) seen->assign(h.direction.size(), {});
  for (std::size_t i = 0; i < h.direction.size(); ++i) {
    const Vec3 direction = normalize(at.to_world(h.direction[i]));
    SeenPlace what;
    h.radiance[i] = {}, h.distance[i] = kInfinite;
    if (!(dot(direction, at.geometric_normal) > 0)) {
      what.place.triangle = SeenPlace::kBelow;
    } else {
      const Vec3 from = FrameTracer::off_surface(place, at.geometric_normal, direction);
      const auto hit = visibility.first_hit(from, direction);
      PathRandom random(mix_bits(~key, i));
      h.radiance[i] = tracer.radiance(hit, from, direction, random, false, &what.by_lamps);
      what.place.triangle = SeenPlace::kBackground;
      if (!hit) {
        h.radiance[i] = background_by_strata(tracer.frame(), h, h.direction[i].z, direction);
      } else {
        h.distance[i] = visibility.to_world_length(hit->distance);
        const auto [a, b, c] = visibility.corners(hit->triangle);
        what.place = {hit->triangle, hit->b1, hit->b2, dot(cross(b - a, c - a), direction) <= 0};
        const double looked = tracer.chance_of_bright(hit->triangle, direction, hit->distance);
        if (looked > 0) {
          const RgbD all = what.by_lamps.radiance;
          what.by_lamps.radiance *= share_of_strata(h, h.direction[i].z, looked);
          h.radiance[i] += what.by_lamps.radiance - all;
        }
      }
      what.rest = h.radiance[i] - what.by_lamps.radiance;
    }
    if (seen) (*seen)[i] = what;
  }
  if (tracer.frame().environment) {
    const AnimatedFrame& frame = tracer.frame();
    for (int n = 0; n < kLooks; ++n) {
      PathRandom random(mix_bits(key ^ 0x50a7, static_cast<std::uint64_t>(n)));
      const double u = (n + random.next()) / kLooks, v = random.next();
      const EnvironmentLight::Sample sample = frame.environment->sample(u, v);
      const Vec3 way = frame.environment_turn * sample.from;
      const Vec3 d = at.to_local(way);
      if (!(d.z > 0) || !(dot(way, at.geometric_normal) > 0)) continue;
      const Vec3 from = FrameTracer::off_surface(place, at.geometric_normal, way);
      if (visibility.first_hit(from, way)) continue;
      SeenPlace what;
      what.place.triangle = SeenPlace::kBackground;
      what.stratum = h.stratum_of(d), what.in_picture = sample.from;
      what.by_lamps.radiance =
          frame.environment->radiance(sample.from) * share_of_strata(h, d.z, sample.pdf);
      h.radiance[what.stratum] += what.by_lamps.radiance;
      if (seen) seen->push_back(what);
    }
  }
  if (tracer.bright().empty()) return;
  for (int n = 0; n < kLooks; ++n) {
    PathRandom random(mix_bits(key ^ 0xb1196, static_cast<std::uint64_t>(n)));
    const auto look = tracer.look_at_bright(place, at.geometric_normal, random);
    if (!(look.pdf > 0)) continue;
    const Vec3 d = at.to_local(look.direction);
    if (!(d.z > 0)) continue;
    SeenPlace what;
    what.place = look.place, what.by_lamps = look.by_lamps, what.stratum = h.stratum_of(d);
    what.by_lamps.radiance *= share_of_strata(h, d.z, look.pdf);
    h.radiance[what.stratum] += what.by_lamps.radiance;
    if (seen) seen->push_back(what);
  }
}

RecordValue record_value(const Hemisphere& h) {
  const double share = kPi / (h.rings * h.sectors);
  RecordValue out;
  const auto add = [](RgbD& x, RgbD& y, const Vec3& along, const RgbD& c) {
    x += c * along.x, y += c * along.y;
  };
  for (int k = 0; k < h.sectors; ++k) {
    const Vec3 middle = in_plane(2 * kPi * (k + 0.5) / h.sectors);
    const Vec3 across = in_plane(2 * kPi * k / h.sectors + kPi / 2);  // at the sector's beginning
    const int before = (k + h.sectors - 1) % h.sectors;
    for (int j = 0; j < h.rings; ++j) {
      const std::size_t i = h.number(j, k);
      const Vec3& d = h.direction[i];
      const RgbD& light = h.radiance[i];
      out.irradiance += light * share;
      // tan(theta) along phi + pi / 2, so that its product with n_K x n is what n gains. Directions
      // at the very horizon have no say of their own.
      const double cosine = std::max(d.z, 1e-3);
      add(out.rotation_x, out.rotation_y, Vec3{-d.y, d.x, 0} * (1 / cosine), light * share);

      // A border moves against the place, as fast as the nearer of its two sides is near.
      const double low2 = static_cast<double>(j) / h.rings, high2 = (j + 1.0) / h.rings;
      const double low = std::sqrt(low2), high = std::sqrt(high2);
      if (j > 0) {
        const std::size_t inner = h.number(j - 1, k);
        const double near = nearer_distance(h.distance[i], h.distance[inner]);
        add(out.translation_x, out.translation_y, middle,
            (light - h.radiance[inner]) * (2 * kPi / h.sectors * low * (1 - low2) / near));
      }
      const std::size_t side = h.number(j, before);
      const double near = nearer_distance(h.distance[i], h.distance[side]);
      add(out.translation_x, out.translation_y, across,
          (light - h.radiance[side]) * ((high - low) / near));
    }
  }
  return out;
}

double harmonic_mean_distance(const Hemisphere& h) {
  double sum = 0;
  for (const double r : h.distance) sum += 1 / r;
  return sum > 0 ? static_cast<double>(h.distance.size()) / sum : kInfinite;
}

}  // namespace haarlight
