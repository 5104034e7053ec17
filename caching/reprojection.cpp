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

// The radiance that `seen` will send; `now` and `next` are where it is and will be.
RgbD next_radiance(const SeenPlace& seen, const PlaceFrame& now, const PlaceFrame& next,
                   const FrameChange& change) {
  const std::uint32_t m = change.now().scene.triangle[seen.place.triangle].material;
  const RgbD color_now(change.now().scene.material[m].albedo);
  const RgbD color_next(change.next().scene.material[m].albedo);
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

// A part of a stratum of the next frame, and what is seen there.
struct Part {
  std::size_t stratum;
  double distance, share;  // share of the stratum
  RgbD radiance;
};

// The parts of strata that lie in [low, high) rings and [left, right) sectors.
struct Patch {
  double low, high, left, right;
};
template <typename Add>
void cover(const Hemisphere& h, const Patch& p, const Add& add) {
  const auto overlap = [](double from, double to, int cell) {
    return std::min(to, cell + 1.0) - std::max(from, static_cast<double>(cell));
  };
  for (int row = static_cast<int>(std::floor(p.low)); row < p.high; ++row) {
    const double rows = overlap(p.low, p.high, row);
    // Beyond the pole there is the other side.
    const int ring = row < 0 ? -1 - row : row;
    const double turned = row < 0 ? 0.5 * h.sectors : 0;
    if (!(rows > 0) || ring >= h.rings) continue;
    const double left = p.left + turned, right = p.right + turned;
    for (int column = static_cast<int>(std::floor(left)); column < right; ++column) {
      const double columns = overlap(left, right, column);
      const int k = column % h.sectors;
      if (columns > 0) add(h.number(ring, k < 0 ? k + h.sectors : k), rows * columns);
    }
  }
}

// By how much the stratum of a surface grows on its way: projected (even strata: plain) solid
// angle.
double growth(bool even, const PlaceFrame& here, const Vec3& from, double cosine_now,
              const PlaceFrame& there, const Vec3& way, double cosine_next) {
  const auto angle = [&](const PlaceFrame& at, const Vec3& to, double cosine) {
    const double square = dot(to, to);
    return std::abs(dot(at.geometric_normal, to)) * (even ? 1 : cosine) /
           (square * std::sqrt(square));
  };
  const double before = angle(here, from, cosine_now), after = angle(there, way, cosine_next);
  // What is seen at a grazing angle grows without bounds.
  constexpr double kMost = 4;
  return before > 0 ? std::clamp(after / before, 1 / kMost, kMost) : 1;
}

// Strata of the next frame while parts fall into them.
struct Strata {
  explicit Strata(const Hemisphere& h)
      : covered(h.direction.size()), deepest(covered.size(), -1), behind(covered.size()) {}
  std::vector<double> covered;  // shares
  std::vector<double> deepest;  // distance of the farthest part that is seen; -1: none
  std::vector<RgbD> behind;     // its radiance

  // Of the strata about one and itself: where the deepest part is; all their number if there is
  // none.
  std::size_t deepest_about(const Hemisphere& h, int ring, int sector, int reach) const {
    std::size_t best = deepest.size();
    for (int j = std::max(ring - reach, 0); j <= std::min(ring + reach, h.rings - 1); ++j) {
      for (int turn = -reach; turn <= reach; ++turn) {
        const std::size_t i = h.number(j, ((sector + turn) % h.sectors + h.sectors) % h.sectors);
        if (deepest[i] < 0) continue;
        if (best == deepest.size() || deepest[i] > deepest[best]) best = i;
      }
    }
    return best;
  }
};

}  // namespace

bool FrameChange::recolors(std::uint32_t triangle) const {
  const std::uint32_t m = now_.scene.triangle[triangle].material;
  return !(now_.scene.material[m].albedo == next_.scene.material[m].albedo);
}

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
  constexpr double kRounding = 1e-9;  // of shares
  Hemisphere next = now;
  ReprojectionReport counts;
  const bool itself = change.moves(place.triangle);
  const PlaceFrame at = place_in(change.next().scene, place);
  const PlaceFrame before = place_in(change.now().scene, place);
  const std::size_t size = now.direction.size();
  // Looks at bright surfaces move by themselves.
  for (std::size_t i = size; i < seen.size(); ++i) {
    next.radiance[seen[i].stratum] += seen[i].by_lamps.radiance * -1;
  }
  const std::vector<RgbD> by_strata = next.radiance;
  std::vector<Part> moved;
  std::vector<bool> stays(size, true);
  for (std::size_t i = 0; i < size; ++i) {
    const std::uint32_t triangle = seen[i].place.triangle;
    RgbD& radiance = next.radiance[i];
    if (triangle == SeenPlace::kBelow) continue;  // the body's own ground turns with it
    if (triangle == SeenPlace::kBackground) {
      // What lies that way then: body and picture may have turned.
      radiance = background_by_strata(change.next(), now, now.direction[i].z,
                                      normalize(at.to_world(now.direction[i])));
    } else {
      const bool moves = change.moves(triangle);
      const bool relit = moves || change.lights_change() || change.recolors(triangle);
      if (!relit && !itself) continue;
      const PlaceFrame here = place_in(change.now().scene, seen[i].place);
      const PlaceFrame there = place_in(change.next().scene, seen[i].place);
      if (relit) radiance = next_radiance(seen[i], here, there, change);
      if (itself || moves) {
        stays[i] = false;
        ++counts.moved;
        const Vec3 way = there.position - at.position;
        const double distance = length(way);
        if (!(distance > 0) || dot(there.geometric_normal, way) > 0) continue;
        const Vec3 d = at.to_local(way * (1 / distance));
        if (!(d.z > 0)) continue;
        const Vec3 from_here = here.position - before.position;
        if (!(length(from_here) > 0)) continue;
        const Vec3 old = before.to_local(normalize(from_here));
        const Hemisphere::Coordinates from = now.coordinates_of(old), to = now.coordinates_of(d);
        const double scale = std::sqrt(growth(now.even, here, from_here, old.z, there, way, d.z));
        const double turn = to.sector - from.sector;
        const int ring = static_cast<int>(i) / now.sectors;
        const int sector = static_cast<int>(i) % now.sectors;
        const double row = to.ring - scale * (from.ring - ring);
        const double column = from.sector + turn - now.sectors * std::round(turn / now.sectors) -
                              scale * (from.sector - sector);
        cover(now, {row, row + scale, column, column + scale},
              [&](std::size_t stratum, double share) {
                moved.push_back({stratum, distance, share, radiance});
              });
        continue;
      }
    }
    if (!(radiance == by_strata[i])) ++counts.moved;
  }
  const auto add_looks = [&] {
    for (std::size_t i = size; i < seen.size(); ++i) {
      const SeenPlace& look = seen[i];
      const std::uint32_t triangle = look.place.triangle;
      const bool moves = triangle != SeenPlace::kBackground && change.moves(triangle);
      RgbD radiance = look.by_lamps.radiance;
      std::size_t stratum = look.stratum;
      if (triangle == SeenPlace::kBackground) {
        const Vec3 way = change.next().environment_turn * look.in_picture;
        const Vec3 d = at.to_local(way);
        if (itself || !(way == change.now().environment_turn * look.in_picture)) {
          ++counts.moved;
          if (!(d.z > 0)) continue;
          stratum = now.stratum_of(d);
          radiance = background_by_strata(change.next(), now, d.z, way) - change.next().background;
        }
        next.radiance[stratum] += radiance;
        continue;
      }
      if (itself || moves || change.lights_change() || change.recolors(triangle)) {
        const PlaceFrame here = place_in(change.now().scene, look.place);
        const PlaceFrame there = place_in(change.next().scene, look.place);
        radiance = next_radiance(look, here, there, change);
        if (itself || moves) {
          const Vec3 from = here.position - before.position, way = there.position - at.position;
          if (!(length(from) > 0) || !(length(way) > 0)) continue;
          const Vec3 old = before.to_local(normalize(from)), d = at.to_local(normalize(way));
          if (!(d.z > 0) || dot(there.geometric_normal, way) > 0) continue;
          radiance *= growth(now.even, here, from, old.z, there, way, d.z);
          stratum = now.stratum_of(d);
        }
        ++counts.moved;
      }
      next.radiance[stratum] += radiance;
    }
  };
  if (std::find(stays.begin(), stays.end(), false) == stays.end()) {
    add_looks();
    if (report) *report = counts;
    return next;
  }

  // The nearest parts of a stratum hide the others.
  for (std::size_t i = 0; i < size; ++i) {
    if (stays[i]) moved.push_back({i, now.distance[i], 1, next.radiance[i]});
  }
  std::stable_sort(moved.begin(), moved.end(), [](const Part& a, const Part& b) {
    return a.stratum != b.stratum ? a.stratum < b.stratum : a.distance < b.distance;
  });
  Strata strata(now);
  std::vector<double> nearness(size);
  std::fill(next.radiance.begin(), next.radiance.end(), RgbD{});
  for (const Part& p : moved) {
    const std::size_t i = p.stratum;
    const double share = std::min(p.share, 1 - strata.covered[i]);
    if (p.share > share + kRounding) ++counts.covered;
    if (!(share > 0)) continue;
    strata.covered[i] += share;
    next.radiance[i] += p.radiance * share, nearness[i] += share / p.distance;
    if (share > kRounding) strata.deepest[i] = p.distance, strata.behind[i] = p.radiance;
  }
  for (std::size_t i = 0; i < size; ++i) {
    // What lies below the horizon is behind nothing.
    if (seen[i].place.triangle == SeenPlace::kBelow) strata.deepest[i] = -1;
  }
  constexpr int kReach = 4;
  for (int j = 0; j < next.rings; ++j) {
    for (int k = 0; k < next.sectors; ++k) {
      const std::size_t i = next.number(j, k);
      const double hole = 1 - strata.covered[i];
      if (hole > kRounding) {
        ++counts.holes;
        // What was there has left, so that what is seen now lies behind it.
        std::size_t from = size;
        const bool torn = strata.deepest[i] >= 0;
        for (int reach = 1; reach <= (torn ? 1 : kReach); ++reach) {
          from = strata.deepest_about(now, j, k, reach);
          if (from < size && strata.deepest[from] > now.distance[i]) break;
        }
        // Nothing around it either: it stays as it was.
        next.radiance[i] += (from < size ? strata.behind[from] : by_strata[i]) * hole;
        nearness[i] += hole / (from < size ? strata.deepest[from] : now.distance[i]);
      }
      next.distance[i] = 1 / nearness[i];
    }
  }
  add_looks();
  if (report) *report = counts;
  return next;
}

}  // namespace haarlight
