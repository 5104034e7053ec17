// Reprojecting hemispheres into the next frame.

#include "caching/reprojection.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace haarlight {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

bool same(const SceneLight& a, const SceneLight& b) {
  return a.position == b.position && a.direction == b.direction && a.intensity == b.intensity;
}

RgbD ratio_of(const RgbD& next, const RgbD& now) {
  const auto one = [](double b, double a) { return a > 0 ? b / a : 1; };
  return {one(next.r, now.r), one(next.g, now.g), one(next.b, now.b)};
}

// W/sr of everything that shines, directional lamps as they are.
RgbD power_of(const AnimatedFrame& frame) {
  RgbD sum;
  for (const SceneLight& light : frame.light) sum += light.intensity;
  for (const Triangle& t : frame.scene.triangle) {
    const Emission& e = frame.emission[t.material];
    if (!(l1_norm(e.radiance) > 0)) continue;
    const Vec3& a = frame.scene.position[t.vertex[0]];
    const Vec3 across =
        cross(frame.scene.position[t.vertex[1]] - a, frame.scene.position[t.vertex[2]] - a);
    sum += e.radiance * (0.5 * length(across) / 4 * (e.both_sides ? 2 : 1));
  }
  return sum;
}

// What the lamps that are not hidden send to a place, over pi.
RgbD lamp_light(const AnimatedFrame& frame, const PlaceFrame& at, std::uint64_t hidden) {
  RgbD sum;
  for (std::size_t n = 0; n < frame.light.size(); ++n) {
    if (n < 64 && (hidden >> n & 1) != 0) continue;
    const LightArrival arrival = light_at(frame.light[n], at.position);
    if (!(l1_norm(arrival.irradiance) > 0)) continue;
    if (!(dot(at.geometric_normal, arrival.from) > 0)) continue;
    sum += arrival.irradiance * (std::max(dot(at.normal, arrival.from), 0.0) / kPi);
  }
  return sum;
}

// The radiance that `seen` will send; `now` is where it is now.
RgbD next_radiance(const SeenPlace& seen, const RgbD& radiance, const PlaceFrame& next,
                   const FrameChange& change) {
  const std::uint32_t m = change.now().scene.triangle[seen.place.triangle].material;
  const RgbD color_now(change.now().scene.material[m].albedo);
  const RgbD color_next(change.next().scene.material[m].albedo);
  if (!change.lights_change() && !change.moves(seen.place.triangle) && color_now == color_next) {
    return radiance;
  }
  const PlaceFrame now = place_in(change.now().scene, seen.place);
  const RgbD before = lamp_light(change.now(), now, seen.by_lamps.hidden);
  const RgbD after = lamp_light(change.next(), next, seen.by_lamps.hidden);
  const auto one = [](double share, double b, double a, double albedo) {
    return a > 0 ? share * (b / a) : albedo * b;
  };
  const RgbD& lamps = seen.by_lamps.radiance;
  const RgbD by_lamps{one(lamps.r, after.r, before.r, color_now.r),
                      one(lamps.g, after.g, before.g, color_now.g),
                      one(lamps.b, after.b, before.b, color_now.b)};
  return (by_lamps + seen.rest * change.power_ratio()) * ratio_of(color_next, color_now);
}

// The deepest of the neighbours that something fell into, or none.
std::size_t deepest_neighbour(const Hemisphere& h, const std::vector<bool>& filled, int ring,
                              int sector) {
  std::size_t best = h.direction.size();
  for (int j = std::max(ring - 1, 0); j <= std::min(ring + 1, h.rings - 1); ++j) {
    for (int turn = -1; turn <= 1; ++turn) {
      const std::size_t i = h.number(j, (sector + turn + h.sectors) % h.sectors);
      if (!filled[i]) continue;
      if (best == h.direction.size() || h.distance[i] > h.distance[best]) best = i;
    }
  }
  return best;
}

}  // namespace

FrameChange::FrameChange(const AnimatedFrame& now, const AnimatedFrame& next)
    : now_(now), next_(next), moves_(now.scene.triangle.size()) {
  for (std::size_t t = 0; t < moves_.size(); ++t) {
    bool moves = false;
    for (const std::uint32_t v : now.scene.triangle[t].vertex) {
      moves = moves || !(now.scene.position[v] == next.scene.position[v]) ||
              !(now.scene.normal[v] == next.scene.normal[v]);
    }
    moves_[t] = moves;
  }
  lights_change_ =
      !std::equal(now.light.begin(), now.light.end(), next.light.begin(), next.light.end(), same);
  const RgbD before = power_of(now), after = power_of(next);
  power_ratio_ = ratio_of(after, before);
  if (!(power_ratio_ == RgbD{1, 1, 1})) lights_change_ = true;
}

Hemisphere reprojected(const Hemisphere& now, const std::vector<SeenPlace>& seen,
                       const BodyPlace& place, const FrameChange& change,
                       ReprojectionReport* report) {
  Hemisphere next = now;
  ReprojectionReport counts;
  const bool itself = change.moves(place.triangle);
  const PlaceFrame at = place_in(change.next().scene, place);
  const std::size_t size = seen.size();
  std::fill(next.distance.begin(), next.distance.end(), -1);
  std::vector<bool> filled(size);
  for (std::size_t i = 0; i < size; ++i) {
    const std::uint32_t triangle = seen[i].place.triangle;
    std::size_t stratum = i;
    double distance = now.distance[i];
    RgbD radiance = now.radiance[i];
    if (triangle == SeenPlace::kBelow) {
      // The body's own ground turns with it.
    } else if (triangle == SeenPlace::kBackground) {
      // What lies that way then: body and picture may have turned.
      radiance = change.next().background_from(normalize(at.to_world(now.direction[i])));
    } else {
      const PlaceFrame there = place_in(change.next().scene, seen[i].place);
      radiance = next_radiance(seen[i], radiance, there, change);
      if (itself || change.moves(triangle)) {
        const Vec3 way = there.position - at.position;
        distance = length(way);
        if (!(distance > 0)) continue;
        const Vec3 d = at.to_local(way * (1 / distance));
        if (!(d.z > 0)) continue;
        stratum = now.stratum_of(d);
        // What turns its back now hides what it did before, and is as dark as can be told.
        if (dot(there.geometric_normal, way) > 0) radiance = {};
      }
    }
    if (stratum != i || !(radiance == now.radiance[i])) ++counts.moved;
    if (filled[stratum]) {
      ++counts.covered;
      if (!(distance < next.distance[stratum])) continue;
    }
    filled[stratum] = true;
    next.distance[stratum] = distance, next.radiance[stratum] = radiance;
  }
  for (int j = 0; j < next.rings; ++j) {
    for (int k = 0; k < next.sectors; ++k) {
      const std::size_t i = next.number(j, k);
      if (filled[i]) continue;
      ++counts.holes;
      const std::size_t from = deepest_neighbour(next, filled, j, k);
      // Nothing around it either: it stays as it was.
      next.radiance[i] = from < size ? next.radiance[from] : now.radiance[i];
      next.distance[i] = from < size ? next.distance[from] : now.distance[i];
    }
  }
  if (report) *report = counts;
  return next;
}

}  // namespace haarlight
