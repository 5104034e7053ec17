// Light in one frame of a scene that moves.

#include "caching/frame_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace haarlight {
namespace {

double power_heuristic(double a, double b) {
  const double sum = a * a + b * b;
  return sum > 0 ? a * a / sum : 0;
}

std::array<float, 3> floats(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

// With what chance a path goes on by each part of a BSDF.
struct PartChances {
  double diffuse, lobe;
  std::array<double, 2> delta{};

  explicit PartChances(const Bsdf& bsdf)
      : diffuse(luminance(bsdf.diffuse_albedo())),
        lobe(bsdf.has_lobe() ? luminance(bsdf.lobe_albedo()) : 0) {
    double sum = diffuse + lobe;
    for (int d = 0; d < bsdf.delta_count; ++d) {
      const auto i = static_cast<std::size_t>(d);
      delta[i] = luminance(bsdf.delta[i].weight);
      sum += delta[i];
    }
    if (!(sum > 0)) return;
    diffuse /= sum, lobe /= sum;
    for (double& d : delta) d /= sum;
  }
  double pdf(const Bsdf& bsdf, const Vec3& w) const {
    double p = diffuse * std::max(dot(bsdf.normal, w), 0.0) / kPi;
    if (lobe > 0) p += lobe * bsdf.lobe_pdf(w);
    return p;
  }
};

RgbD extinguished(const Rgb& extinction, double metres) {
  const RgbD e(extinction);
  return {std::exp(-e.r * metres), std::exp(-e.g * metres), std::exp(-e.b * metres)};
}

}  // namespace

RgbD reflected(const Bsdf& bsdf, const Vec3& w) {
  if (!(dot(w, bsdf.geometric_normal) > 0)) return {};
  RgbD f;
  if (bsdf.has_diffuse()) f += bsdf.diffuse_out(bsdf.to_viewer) * bsdf.diffuse_in(w);
  if (bsdf.has_lobe()) {
    const Bsdf::LobeValues lobe = bsdf.lobe_values(w);
    f += bsdf.gloss_first * lobe.first + bsdf.gloss_second * lobe.second;
  }
  return f;
}

FrameTracer::FrameTracer(const AnimatedFrame& frame)
    : frame_(frame), visibility_(frame.scene), bright_(frame, visibility_) {
  for (std::uint32_t t = 0; t < frame.scene.triangle.size(); ++t) {
    const Emission& emission = frame.emission[frame.scene.triangle[t].material];
    const double power = luminance(emission.radiance) * (emission.both_sides ? 2 : 1);
    if (!(power > 0)) continue;
    const auto [a, b, c] = visibility_.corners(t);
    const double area = 0.5 * length(cross(b - a, c - a));
    if (!(area > 0)) continue;
    if (number_.empty()) number_.assign(frame.scene.triangle.size(), -1);
    number_[t] = static_cast<std::int32_t>(shining_.size());
    shining_.push_back({t, area});
    chances_.add(power * area);
  }
}

Vec3 FrameTracer::off_surface(const Vec3& position, const Vec3& geometric_normal,
                              const Vec3& direction) {
  const double side = dot(geometric_normal, direction) < 0 ? -1 : 1;
  return position + geometric_normal * (side * Visibility::kSurfaceOffset);
}

RgbD FrameTracer::emitted(const SurfaceHit& surface) const {
  const Emission& e = frame_.emission[surface.material];
  return surface.outside || e.both_sides ? e.radiance : RgbD{};
}

bool FrameTracer::shines(std::uint32_t triangle, const Vec3& direction) const {
  if (frame_.emission[frame_.scene.triangle[triangle].material].both_sides) return true;
  const auto [a, b, c] = visibility_.corners(triangle);
  return dot(cross(b - a, c - a), direction) <= 0;
}

// The density, per solid angle, with which direct() chooses this direction.
double FrameTracer::chance_to_hit(std::uint32_t triangle, const Vec3&, const Vec3& direction,
                                  double distance) const {
  if (number_.empty() || number_[triangle] < 0) return 0;
  const auto i = static_cast<std::size_t>(number_[triangle]);
  const auto [a, b, c] = visibility_.corners(triangle);
  const double cosine = std::abs(dot(normalize(cross(b - a, c - a)), direction));
  if (!(cosine > 0)) return 0;
  return chances_.of(i) / shining_[i].area * distance * distance / cosine;
}

FrameTracer::LampShare FrameTracer::lamp_light(const SurfaceHit& surface, const Bsdf& bsdf) const {
  LampShare out;
  const Vec3 place = surface.position;
  for (std::size_t n = 0; n < frame_.light.size(); ++n) {
    const SceneLight& light = frame_.light[n];
    // Lights stand in the world; distances fall off in metres.
    SceneLight local = light;
    local.position = visibility_.to_local(light.position);
    LightArrival arrival = light_at(local, place);
    if (light.kind != SceneLight::Kind::directional) {
      const double scale = visibility_.to_world_length(1);
      arrival.irradiance *= 1 / (scale * scale);
    }
    if (!(l1_norm(arrival.irradiance) > 0)) continue;
    const RgbD f = reflected(bsdf, arrival.from);
    if (!(l1_norm(f) > 0)) continue;
    const Vec3 origin = off_surface(place, surface.geometric_normal, arrival.from);
    if (visibility_.occluded(floats(origin), arrival.from, arrival.distance)) {
      if (n < 64) out.hidden |= std::uint64_t{1} << n;
      continue;
    }
    out.radiance += f * arrival.irradiance;
  }
  return out;
}

RgbD FrameTracer::direct(const SurfaceHit& surface, const Bsdf& bsdf, PathRandom& random, bool mis,
                         LampShare* lamps) const {
  if (lamps) *lamps = {};
  if (bsdf.is_specular()) return {};
  const LampShare found = lamp_light(surface, bsdf);
  if (lamps) *lamps = found;
  RgbD sum = found.radiance;
  const Vec3 place = surface.position;
  if (shining_.empty()) return sum;

  // One place on the shining triangles.
  const std::size_t i = chances_.choose(random.next());
  const std::uint32_t t = shining_[i].triangle;
  const auto [a, b, c] = visibility_.corners(t);
  const double root = std::sqrt(random.next()), v = random.next() * root;
  const Vec3 there = a * (1 - root) + b * (root - v) + c * v;
  const Vec3 way = there - place;
  const double distance = length(way);
  if (!(distance > 4 * Visibility::kSurfaceOffset)) return sum;
  const Vec3 w = way * (1 / distance);
  const RgbD f = reflected(bsdf, w);
  if (!(l1_norm(f) > 0) || !shines(t, w)) return sum;
  const double chance = chance_to_hit(t, place, w, distance);
  if (!(chance > 0)) return sum;
  const Vec3 normal = normalize(cross(b - a, c - a));
  const Vec3 from = off_surface(place, surface.geometric_normal, w);
  const Vec3 to = off_surface(there, normal, -w);
  const Vec3 between = to - from;
  const double span = length(between);
  if (visibility_.occluded(floats(from), between * (1 / span), span)) return sum;
  const double weight = mis ? power_heuristic(chance, PartChances(bsdf).pdf(bsdf, w)) : 1;
  sum += f * frame_.emission[frame_.scene.triangle[t].material].radiance * (weight / chance);
  return sum;
}

RgbD FrameTracer::environment_light(const SurfaceHit& surface, const Bsdf& bsdf, PathRandom& random,
                                    bool mis) const {
  if (!frame_.environment || bsdf.is_specular()) return {};
  const double u = random.next(), v = random.next();
  const EnvironmentLight::Sample sample = frame_.environment->sample(u, v);
  const Vec3 w = frame_.environment_turn * sample.from;
  const RgbD f = reflected(bsdf, w);
  if (!(l1_norm(f) > 0)) return {};
  const Vec3 from = off_surface(surface.position, surface.geometric_normal, w);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (visibility_.occluded(floats(from), w, kInfinity)) return {};
  const double weight = mis ? power_heuristic(sample.pdf, PartChances(bsdf).pdf(bsdf, w)) : 1;
  return f * frame_.environment->radiance(sample.from) * (weight / sample.pdf);
}

double FrameTracer::chance_of_bright(std::uint32_t triangle, const Vec3& direction,
                                     double distance) const {
  const double chance = bright_.chance(triangle);
  if (!(chance > 0)) return 0;
  const auto [a, b, c] = visibility_.corners(triangle);
  const double cosine = std::abs(dot(normalize(cross(b - a, c - a)), direction));
  return cosine > 0 ? chance * distance * distance / cosine : 0;
}

FrameTracer::BrightLook FrameTracer::look_at_bright(const Vec3& position,
                                                    const Vec3& geometric_normal,
                                                    PathRandom& random) const {
  BrightLook look;
  const double u = random.next(), v = random.next(), w = random.next();
  const BrightSurfaces::Sample sample = bright_.choose(u, v, w);
  const Vec3 way = sample.position - position;
  look.distance = length(way);
  if (!(look.distance > 4 * Visibility::kSurfaceOffset)) return look;
  look.direction = way * (1 / look.distance);
  if (!(dot(look.direction, geometric_normal) > 0)) return look;
  const double pdf = chance_of_bright(sample.hit.triangle, look.direction, look.distance);
  if (!(pdf > 0)) return look;
  Visibility::Hit hit = sample.hit;
  hit.distance = look.distance;
  const SurfaceHit there = surface_at(frame_.scene, visibility_, hit, look.direction);
  const Bsdf bsdf = bsdf_at(frame_.scene, there);
  if (bsdf.is_specular()) return look;
  const Vec3 from = off_surface(position, geometric_normal, look.direction);
  const Vec3 between = off_surface(sample.position, there.geometric_normal, -look.direction) - from;
  const double span = length(between);
  if (visibility_.occluded(floats(from), between * (1 / span), span)) return look;
  look.by_lamps = lamp_light(there, bsdf);
  look.place = {hit.triangle, hit.b1, hit.b2, there.outside};
  look.pdf = pdf;
  return look;
}

RgbD FrameTracer::lobe_light(const SurfaceHit& surface, const Bsdf& bsdf, PathRandom& random,
                             int samples) const {
  RgbD sum;
  for (int s = 0; s < samples; ++s) {
    const double u = random.next(), v = random.next();
    const auto sample = bsdf.sample_lobe(u, v);
    if (!sample || !(dot(sample->direction, surface.geometric_normal) > 0)) continue;
    const Bsdf::LobeValues lobe = bsdf.lobe_values(sample->direction);
    const RgbD f = bsdf.gloss_first * lobe.first + bsdf.gloss_second * lobe.second;
    const Vec3 from = off_surface(surface.position, surface.geometric_normal, sample->direction);
    sum += f * radiance(from, sample->direction, random, false) * (1 / (sample->pdf * samples));
  }
  return sum;
}

RgbD FrameTracer::radiance(const Vec3& from, const Vec3& direction, PathRandom& random,
                           bool first_emission) const {
  return radiance(visibility_.first_hit(from, direction), from, direction, random, first_emission);
}

RgbD FrameTracer::radiance(const std::optional<Visibility::Hit>& first, const Vec3& begin,
                           const Vec3& begin_direction, PathRandom& random, bool first_emission,
                           LampShare* lamps) const {
  constexpr int kRoulette = 3, kMostBounces = 256;
  RgbD sum, passed{1, 1, 1};
  Rgb extinction{};
  std::optional<Visibility::Hit> hit = first;
  Vec3 from = begin, direction = begin_direction;
  double pdf = 0;  // of the last direction; 0: the only one there was
  for (int bounce = 0; bounce < kMostBounces; ++bounce) {
    if (!hit) {
      sum += passed * frame_.background;
      if (!frame_.environment) return sum;
      const Vec3 in_picture = frame_.environment_turn.transposed() * direction;
      const double other = pdf > 0 ? frame_.environment->pdf(in_picture) : 0;
      return sum + passed * frame_.environment->radiance(in_picture) *
                       (pdf > 0 ? power_heuristic(pdf, other) : 1);
    }
    const SurfaceHit surface = surface_at(frame_.scene, visibility_, *hit, direction);
    if (l1_norm(extinction) > 0) {
      passed = passed * extinguished(extinction, visibility_.to_world_length(surface.distance));
    }
    const RgbD emission = emitted(surface);
    if (l1_norm(emission) > 0 && (bounce > 0 || first_emission)) {
      const double other =
          pdf > 0 ? chance_to_hit(hit->triangle, from, direction, surface.distance) : 0;
      sum += passed * emission * (pdf > 0 ? power_heuristic(pdf, other) : 1);
    }
    const Bsdf bsdf = bsdf_at(frame_.scene, surface);
    LampShare by_lamps;
    RgbD seen = direct(surface, bsdf, random, true, &by_lamps);
    if (bounce == 0 && lamps) *lamps = by_lamps;
    if (!bright_.empty()) {
      // What lamps make bright is found by its own samples, too.
      const double other =
          pdf > 0 ? chance_of_bright(hit->triangle, direction, surface.distance) : 0;
      if (other > 0) seen += by_lamps.radiance * (power_heuristic(pdf, other) - 1);
      const BrightLook look =
          bsdf.is_specular() ? BrightLook{}
                             : look_at_bright(surface.position, surface.geometric_normal, random);
      if (look.pdf > 0) {
        const double weight =
            power_heuristic(look.pdf, PartChances(bsdf).pdf(bsdf, look.direction));
        seen += reflected(bsdf, look.direction) * look.by_lamps.radiance * (weight / look.pdf);
      }
    }
    sum += passed * seen;
    if (frame_.environment) sum += passed * environment_light(surface, bsdf, random, true);

    // One way on.
    const PartChances part(bsdf);
    const double choice = random.next(), u = random.next(), v = random.next();
    double below = part.diffuse + part.lobe;
    if (choice < below) {
      std::optional<Vec3> w;
      if (choice < part.diffuse) {
        w = cosine_direction(bsdf.normal, u, v);
      } else if (const auto sample = bsdf.sample_lobe(u, v)) {
        w = sample->direction;
      }
      if (!w || !(dot(*w, surface.geometric_normal) > 0)) return sum;
      pdf = part.pdf(bsdf, *w);
      if (!(pdf > 0)) return sum;
      passed = passed * reflected(bsdf, *w) * (1 / pdf);
      direction = *w;
    } else {
      int d = 0;
      while (d < bsdf.delta_count && choice >= below + part.delta[static_cast<std::size_t>(d)]) {
        below += part.delta[static_cast<std::size_t>(d++)];
      }
      if (d >= bsdf.delta_count) return sum;
      const auto i = static_cast<std::size_t>(d);
      const Bsdf::Delta& delta = bsdf.delta[i];
      passed = passed * delta.weight * (1 / part.delta[i]);
      direction = normalize(delta.direction);
      pdf = 0;
      if (delta.transmitted) {
        extinction = delta.enters ? frame_.scene.material[surface.material].extinction : Rgb{};
      }
    }
    if (bounce >= kRoulette) {
      const double go_on = std::clamp(std::max({passed.r, passed.g, passed.b}), 0.0, 1.0);
      if (random.next() >= go_on) return sum;
      passed *= 1 / go_on;
    }
    from = off_surface(surface.position, surface.geometric_normal, direction);
    hit = visibility_.first_hit(from, direction);
  }
  return sum;
}

}  // namespace haarlight
