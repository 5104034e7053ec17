// Hard cases of caches: weights over time, distances, gradients, places that coincide.

#include <cmath>
#include <limits>

#include "caching/hemisphere.h"
#include "caching/record_cache.h"
#include "caching/temporal_weight.h"
#include "precompute/random.h"
#include "tests/hard/hard_case.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(HardCases, Row36_TemporalRatiosOfAnyKind) {
  hard::property(
      "tau of 1, below 1, 0, infinite and of black: weights in [0, 1e6], lives in [1, longest]");
  const RgbD black, grey{1, 1, 1}, tiny{5e-324, 0, 0}, huge{1e308, 1e308, 1e308};
  const RgbD odd[] = {black,        grey,       tiny,     huge, {kInfinite, 0, 0},
                      {kNaN, 1, 1}, {-1, 1, 1}, {0, 1, 0}};
  const TemporalAccuracy accuracy{0.05, 20};
  int wrong = 0, tried = 0;
  for (const RgbD& a : odd) {
    for (const RgbD& b : odd) {
      const double ratio = temporal_ratio(a, b);
      if (!(ratio >= 1 && ratio <= kMostRatio)) ++wrong;
      for (const int age : {0, 1, 19, 1'000'000'000}) {
        const double weight = temporal_weight(ratio, age);
        if (!(weight >= 0 && weight <= kMostWeight)) ++wrong;
        if (age == 0 && weight != kMostWeight) ++wrong;
        ++tried;
      }
      const int life = lifespan(ratio, accuracy);
      if (!(life >= 1 && life <= accuracy.longest)) ++wrong;
      // What is not the same, and not below the noise of what is, does not live for ever.
      if (is_finite(a) && is_finite(b) && a == b && life != accuracy.longest) ++wrong;
    }
  }
  // Light that doubles or halves, comes or goes: a new record at once, whichever way.
  for (const auto& [a, b] :
       {std::pair{grey, grey * 2.0}, {grey * 2.0, grey}, {black, grey}, {grey, black}}) {
    if (lifespan(temporal_ratio(a, b), accuracy) != 1) ++wrong;
    if (temporal_ratio(a, b) != temporal_ratio(b, a)) ++wrong;
  }
  hard::at_most("wrong", wrong, 0);
  hard::at_least("tried", tried, 200);
}

Scene floor_scene() {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  return scene;
}

TEST(HardCases, Row37_FramesFarFromZero) {
  hard::property("a thousand million frames later records weigh and last the same, bit by bit");
  const Scene scene = floor_scene();
  int different = 0;
  std::size_t alive = 0;
  constexpr int kShift = 1'000'000'000;
  RecordCache<RecordValue> near(0.3), far(0.3);
  PathRandom random(1);
  for (int frame = 0; frame < 8; ++frame) {
    near.begin(frame, scene), far.begin(kShift + frame, scene);
    for (int i = 0; i < 20; ++i) {
      CacheRecord<RecordValue> r;
      r.place = {static_cast<std::uint32_t>(i % 2), 0.5 * random.next(), 0.5 * random.next(), true};
      r.life = 1 + i % 5, r.radius = 0.5 * random.next();
      r.value.irradiance = {random.next(), 1, 1}, r.change.irradiance = {0.1, 0, -0.01};
      r.born = frame;
      near.add(r, 0.01);
      r.born = kShift + frame;
      far.add(r, 0.01);
    }
    if (near.alive_count() != far.alive_count()) ++different;
    alive += near.alive_count();
    for (int i = 0; i < 100; ++i) {
      const Vec3 p{2 * random.next() - 1, 2 * random.next() - 1, 0};
      const auto a = irradiance_at(near, p, {0, 0, 1}, {0, 0, 1});
      const auto b = irradiance_at(far, p, {0, 0, 1}, {0, 0, 1});
      if (!(a.left >= 1) || !(a.irradiance == b.irradiance) || a.left != b.left) ++different;
    }
  }
  hard::at_most("differences", different, 0);
  hard::at_least("records in use", static_cast<double>(alive), 300);
}

TEST(HardCases, Row38_DistancesOfNothing) {
  hard::property(
      "seen at no distance, or nothing seen: the radius is in [least, most], gradients finite");
  int wrong = 0;
  for (const double distance : {0.0, 1e-300, 1e300, kInfinite}) {
    for (const double light : {0.0, 1.0, 1e6}) {
      Hemisphere h = stratified_hemisphere(100, 3);
      for (std::size_t i = 0; i < h.direction.size(); ++i) {
        h.distance[i] = i % 2 ? distance : kInfinite;
        h.radiance[i] = RgbD{1, 1, 1} * (i % 3 ? light : 0);
      }
      const RecordValue v = record_value(h);
      const double mean = harmonic_mean_distance(h);
      const double radius = record_radius(v, mean, 0.01, 2);
      if (!(radius >= 0.01 && radius <= 2)) ++wrong;
      if (!is_finite(v.translation_x) || !is_finite(v.translation_y)) ++wrong;
      if (!is_finite(limited(v, radius).translation_x)) ++wrong;
      if (!(mean >= 0)) ++wrong;
    }
  }
  if (record_radius({}, kNaN, 0.01, 2) != 0.01) ++wrong;
  hard::at_most("wrong", wrong, 0);
}

TEST(HardCases, Row39_GradientsThatOvershoot) {
  hard::property(
      "whatever gradients say, light stays within 1/20 and 20 times the record's, never below 0");
  const Scene scene = floor_scene();
  PathRandom random(2);
  int wrong = 0, clamped = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto any = [&] {
      return std::exp(20 * random.next() - 10) * (random.next() < 0.5 ? -1 : 1);
    };
    const auto colour = [&] { return RgbD{any(), any(), any()}; };
    RecordValue v{{std::abs(any()), std::abs(any()), 0}, colour(), colour(), colour(), colour()};
    if (i % 10 == 0) v.irradiance.r = -v.irradiance.r;  // by a temporal gradient
    const PlaceFrame at = place_in(scene, {0, 0.3, 0.3, true});
    const Vec3 p = at.position + Vec3{random.next() - 0.5, random.next() - 0.5, 0};
    const RgbD e = extrapolated(at, v, p, normalize(Vec3{random.next(), random.next(), 1}));
    const auto inside = [&](double x, double own) {
      own = std::max(own, 0.0);
      if (x == own * 20 || x == own / 20) ++clamped;
      return x >= own / 20 && x <= own * 20;
    };
    if (!inside(e.r, v.irradiance.r) || !inside(e.g, v.irradiance.g) || e.b != 0) ++wrong;
  }
  hard::at_most("wrong", wrong, 0);
  hard::at_least("clamped", clamped, 500);
}

TEST(HardCases, Row42_CoincidentRecords) {
  hard::property(
      "a million records in one place, of any size: the octree is at most 24 deep and finds them "
      "all");
  RecordOctree tree({0, 0, 0}, 1);
  const Vec3 place{0.1, 0.2, -0.3};
  constexpr std::uint32_t kCount = 1'000'000;
  const double sizes[] = {0, 1e-300, 1e-12, 1e-3, 0.1, 3};
  for (std::uint32_t i = 0; i < kCount; ++i) tree.insert(i, place, sizes[i % 6]);
  std::uint32_t found = 0;
  tree.visit(place, [&](std::uint32_t) { ++found; });
  hard::at_most("depth", tree.depth(), RecordOctree::kDeepest);
  hard::at_most("not found", kCount - found, 0);
  hard::at_most("cells", static_cast<double>(tree.cells()), 6 * 8 * 24);
}

}  // namespace
}  // namespace haarlight
