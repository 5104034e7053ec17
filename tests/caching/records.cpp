// Records of irradiance: closed forms of values and gradients, weights, the octree, reprojection.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <vector>

#include "caching/hemisphere.h"
#include "caching/record_cache.h"
#include "caching/reprojection.h"
#include "caching/temporal_weight.h"
#include "core/hash_bits.h"
#include "tests/caching/estimate.h"
#include "tests/precompute/shapes.h"

namespace haarlight {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// A hemisphere lit by light(direction), at distance(direction).
template <typename Light, typename Distance>
Hemisphere lit(int samples, const Light& light, const Distance& distance) {
  Hemisphere h = stratified_hemisphere(samples, 5);
  for (std::size_t i = 0; i < h.direction.size(); ++i) {
    const double x = light(h.direction[i]);
    h.radiance[i] = {x, 2 * x, 3 * x};
    h.distance[i] = distance(h.direction[i]);
  }
  return h;
}
double far_off(const Vec3&) { return kInfinite; }

TEST(Hemisphere, DirectionsLieInTheirStrata) {
  const Hemisphere h = stratified_hemisphere(300, 9);
  EXPECT_NEAR(static_cast<double>(h.direction.size()), 300, 40);
  for (std::size_t i = 0; i < h.direction.size(); ++i) {
    EXPECT_EQ(h.stratum_of(h.direction[i]), i);
    EXPECT_NEAR(length(h.direction[i]), 1, 1e-12);
  }
}

TEST(Hemisphere, LinearLightHasItsIrradianceAndRotationGradient) {
  // L = a + b . w: E(n) = pi a + 2 pi / 3 (b . n), so that (n_K x n) . grad changes E by
  // 2 pi / 3 (b . n) for n about n_K: grad = 2 pi / 3 (n_K x b).
  const double a = 2;
  const Vec3 b{0.5, -0.3, 0.8};
  const RecordValue v = record_value(lit(
      20000, [&](const Vec3& w) { return a + dot(b, w); }, far_off));
  // Strata of 1/80 by 1/250 of a turn: midpoint sums are wrong by their squares, jitter by less;
  // rotation has tan(theta), infinite at the horizon: the outermost ring, 1/80 of the light,
  // decides.
  EXPECT_NEAR(v.irradiance.r, kPi * a + 2 * kPi / 3 * b.z, 2e-3);
  EXPECT_NEAR(v.irradiance.b, 3 * v.irradiance.r, 1e-12);
  EXPECT_NEAR(v.rotation_x.r, 2 * kPi / 3 * -b.y, 0.04);
  EXPECT_NEAR(v.rotation_y.r, 2 * kPi / 3 * b.x, 0.04);
  EXPECT_EQ(v.translation_x.r, 0);
}

TEST(Hemisphere, EdgeOverheadHasItsTranslationGradient) {
  // A ceiling at height h, bright (1) where x > 0: E(x) = pi (1 + x / sqrt(x^2 + h^2)) / 2 at x
  // from below the edge, whose slope at 0 is pi / (2 h). y has none.
  for (const double h : {0.5, 2.0}) {
    const RecordValue v = record_value(lit(
        5000, [&](const Vec3& w) { return w.x > 0 ? 1.0 : 0.0; },
        [&](const Vec3& w) { return h / w.z; }));
    EXPECT_NEAR(v.irradiance.r, kPi / 2, 0.02);
    // The edge lies along borders of strata: what is left is a sum over 40 rings, of distances
    // jittered in them, of terms ~ sqrt at the zenith: 3 % of room.
    EXPECT_NEAR(v.translation_x.r * h, kPi / 2, 0.03 * kPi / 2) << h;
    EXPECT_NEAR(v.translation_y.r * h, 0, 0.03 * kPi / 2) << h;
  }
}

TEST(Hemisphere, RingOverheadMovesAsItsCenterDoes) {
  // A ceiling whose brightness is x^2 - 1 inside |p| < 1 would change as its derivative; here a
  // bright disc of radius 1 at height h moved by c: E = disc's form factor. By symmetry the slope
  // is 0 below its middle; off it, by e, it is the closed form's numerical derivative.
  const double h = 1, e = 0.6;
  // Irradiance from a disc parallel to the place, at lateral offset x (Nusselt; radius 1).
  const auto form = [&](double x) {
    const double s = 1 + h * h + x * x;
    return kPi / 2 * (1 - (s - 2) / std::sqrt(s * s - 4 * x * x));
  };
  const RecordValue v = record_value(lit(
      20000,
      [&](const Vec3& w) {
        const double x = w.x / w.z * h + e, y = w.y / w.z * h;
        return x * x + y * y < 1 ? 1.0 : 0.0;
      },
      [&](const Vec3& w) { return h / w.z; }));
  const double slope = (form(e + 1e-4) - form(e - 1e-4)) / 2e-4;
  EXPECT_NEAR(v.irradiance.r, form(e), 0.02);
  EXPECT_NEAR(v.translation_x.r, slope, 0.05 * std::abs(slope));
}

TEST(Hemisphere, ClosedBoxThatShinesIsAFurnace) {
  // Walls of albedo a that send e: all light is e / (1 - a), that which has been reflected e less.
  Scene scene = shapes::empty_scene();
  shapes::add_box(scene, {-1, -1, -1}, {1, 1, 1});
  scene.material[0].albedo = {0.5f, 0.5f, 0.5f};
  AnimatedFrame frame;
  frame.emission.resize(1);
  frame.emission[0] = {{0.3, 0.3, 0.3}, true};
  frame.scene = std::move(scene);
  const FrameTracer tracer(frame);
  double sum = 0, squares = 0;
  constexpr int kRecords = 40;
  for (int i = 0; i < kRecords; ++i) {
    const auto key = static_cast<std::uint64_t>(i);
    const BodyPlace place{static_cast<std::uint32_t>(i % 12), 0.3, 0.3, false};
    Hemisphere h = stratified_hemisphere(200, key);
    gather_hemisphere(tracer, place_in(frame.scene, place), key, h, nullptr);
    const double e = record_value(h).irradiance.g;
    sum += e, squares += e * e;
  }
  const double mean = sum / kRecords;
  const double error = std::sqrt((squares / kRecords - mean * mean) / (kRecords - 1));
  EXPECT_NEAR(mean, kPi * 0.3, 5 * error);  // a chance of 6e-7
  EXPECT_LT(error, 0.02);
}

PlaceFrame flat_place(const Vec3& position) {
  PlaceFrame at;
  at.position = position;
  at.normal = at.geometric_normal = {0, 0, 1};
  at.tangent = {1, 0, 0}, at.bitangent = {0, 1, 0};
  return at;
}

TEST(IrradianceRecord, ErrorIsWards) {
  const PlaceFrame at = flat_place({1, 2, 3});
  EXPECT_EQ(record_error(at, 0.5, at.position, at.normal), 0);
  EXPECT_NEAR(record_error(at, 0.5, {1, 2.1, 3}, at.normal), 0.2, 1e-12);
  const Vec3 turned{std::sin(0.3), 0, std::cos(0.3)};
  EXPECT_NEAR(record_error(at, 0.5, at.position, turned), std::sqrt(1 - std::cos(0.3)), 1e-12);
  // In front of the record, and behind it.
  EXPECT_EQ(record_error(at, 0.5, {1, 2, 2.9}, at.normal), kInfinite);
  EXPECT_NEAR(record_error(at, 0.5, {1, 2, 3.1}, at.normal), 0.2, 1e-12);
  EXPECT_EQ(record_weight(0.2, 0.2), 0);
  EXPECT_NEAR(record_weight(0.1, 0.2), 5, 1e-12);
  EXPECT_TRUE(std::isfinite(record_weight(0, 0.2)));
}

TEST(IrradianceRecord, ExtrapolatesAlongItsGradients) {
  const PlaceFrame at = flat_place({0, 0, 0});
  RecordValue v;
  v.irradiance = {1, 1, 1};
  v.translation_x = {0.5, 0, 0}, v.translation_y = {0, -0.5, 0}, v.rotation_y = {0, 0, 0.7};
  const Vec3 turned = normalize(Vec3{0.2, 0, 1});  // n_K x n = (0, sin, 0)
  const RgbD e = extrapolated(at, v, {0.1, 0.2, 0}, turned);
  EXPECT_NEAR(e.r, 1.05, 1e-12);
  EXPECT_NEAR(e.g, 0.9, 1e-12);
  EXPECT_NEAR(e.b, 1 + 0.7 * turned.x, 1e-12);
}

TEST(RecordCache, MeansWeighAsEquationOneAndNeighboursAreClamped) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  RecordCache<RecordValue> cache(0.5);
  cache.begin(0, scene);
  CacheRecord<RecordValue> r;
  r.place = {0, 0.5, 0, true};  // the middle of the lower edge: (0, -1, 0)
  r.radius = 1, r.value.irradiance = {1, 2, 3}, r.life = 3;
  cache.add(r, 0.01);
  EXPECT_TRUE(cache.covers({0.4, -1, 0}, {0, 0, 1}));
  EXPECT_FALSE(cache.covers({0.6, -1, 0}, {0, 0, 1}));
  EXPECT_FALSE(cache.covers({0, -1, 0}, {1, 0, 0}));
  const auto alone = irradiance_at(cache, {0.3, -1, 0}, {0, 0, 1}, {0, 0, 1});
  EXPECT_NEAR(alone.left, 3, 1e-12);
  EXPECT_NEAR(alone.irradiance.g, 2, 1e-12);
  // A second one at (0.4, -1, 0), of radius 0.1: the first may not reach beyond 0.5.
  r.place.b1 = 0.7, r.radius = 0.1, r.value.irradiance = {3, 3, 3};
  cache.add(r, 0.01);
  EXPECT_NEAR(cache.records()[0].radius, 0.5, 1e-12);
  const Vec3 p{0.38, -1, 0};  // errors: first 0.76 (not at all), second 0.2
  const auto near = irradiance_at(cache, p, {0, 0, 1}, {0, 0, 1});
  EXPECT_NEAR(near.irradiance.r, 3, 1e-12);
  cache.note_use();
  EXPECT_EQ(cache.records()[0].last_used, 0);
  // By frame 3 their life is over.
  cache.begin(2, scene);
  EXPECT_EQ(cache.alive_count(), 2u);
  cache.begin(3, scene);
  EXPECT_EQ(cache.alive_count(), 0u);
}

TEST(RecordOctree, FindsEverySphereAboutAPlace) {
  RecordOctree tree({0.5, 0.5, 0.5}, 0.5);
  std::vector<Vec3> center;
  std::vector<double> radius;
  PathRandom random(3);
  for (std::uint32_t i = 0; i < 400; ++i) {
    // A few lie outside the root.
    center.push_back({random.next() * 1.2 - 0.1, random.next(), random.next()});
    radius.push_back(std::exp2(-8 * random.next()) * 0.5);
    tree.insert(i, center[i], radius[i]);
  }
  for (int n = 0; n < 400; ++n) {
    const Vec3 p{random.next() * 1.2 - 0.1, random.next(), random.next()};
    std::set<std::uint32_t> found;
    tree.visit(p, [&](std::uint32_t i) { EXPECT_TRUE(found.insert(i).second) << "twice"; });
    for (std::uint32_t i = 0; i < 400; ++i) {
      EXPECT_TRUE(length(p - center[i]) > radius[i] || found.count(i)) << i;
    }
    EXPECT_LT(found.size(), 300u);
  }
}

TEST(TemporalWeight, LivesAsLongAsItsChangeAllows) {
  // (tau - 1) (t - t0) <= a^t: 1 % a frame and 5 % allowed are ages 0 to 5; 1.0 / 0.99 is a little
  // more than 1 %, so that 5 frames of it are beyond 5 %.
  const TemporalAccuracy accuracy{0.05, 20};
  EXPECT_EQ(lifespan(temporal_ratio(RgbD{1, 1, 1}, RgbD{1.00999, 1, 1}), accuracy), 6);
  EXPECT_EQ(lifespan(temporal_ratio(RgbD{1, 1, 1}, RgbD{1, 0.99, 1}), accuracy), 5);
  EXPECT_EQ(lifespan(temporal_ratio(RgbD{1, 1, 1}, RgbD{1, 1, 1}), accuracy), 20);
  EXPECT_EQ(lifespan(temporal_ratio(RgbD{1, 1, 1}, RgbD{1, 1, 2}), accuracy), 1);
  EXPECT_NEAR(temporal_ratio(RgbD{1, 1, 1}, RgbD{1, 1, 0.5}), 2, 1e-12);
  EXPECT_NEAR(temporal_weight(1.25, 2), 2, 1e-12);
}

// A floor and a wall of next to no albedo under a lamp: what a place on the floor gets is the
// lamp's light off the wall, in closed form at every direction.
AnimatedFrame wall_frame(const Vec3& lamp, double wall_x) {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-3, 0, 3}, {6, 0, 0}, {0, 0, -6});
  scene.material[0].albedo = {0.001f, 0.001f, 0.001f};
  scene.material.push_back(scene.material[0]);
  scene.material[1].albedo = {0.5f, 0.4f, 0.3f};
  shapes::add_quad(scene, {wall_x, 0, -1}, {0, 0, 2}, {0, 2, 0}, 1);  // faces -x
  AnimatedFrame frame;
  frame.emission.resize(2);
  frame.scene = std::move(scene);
  SceneLight light;
  light.position = lamp, light.intensity = {5, 5, 5};
  frame.light.push_back(light);
  return frame;
}

RgbD irradiance_in(const AnimatedFrame& frame, const BodyPlace& place, Hemisphere& h,
                   std::vector<SeenPlace>* seen) {
  const FrameTracer tracer(frame);
  gather_hemisphere(tracer, place_in(frame.scene, place), 1, h, seen);
  return record_value(h).irradiance;
}

TEST(Reprojection, IsTheSameBitsWhereNothingChanges) {
  const AnimatedFrame frame = wall_frame({-1, 1.5, 0.2}, 1);
  const FrameChange change(frame, frame);
  const BodyPlace place{0, 0.2, 0.4, true};
  Hemisphere h = stratified_hemisphere(400, 1);
  std::vector<SeenPlace> seen;
  irradiance_in(frame, place, h, &seen);
  ReprojectionReport report;
  const Hemisphere next = reprojected(h, seen, place, change, &report);
  EXPECT_EQ(next.radiance, h.radiance);
  EXPECT_EQ(next.distance, h.distance);
  EXPECT_EQ(report.moved + report.covered + report.holes, 0);
}

TEST(Reprojection, MovedLampIsExactOnSurfacesThatSeeIt) {
  const AnimatedFrame now = wall_frame({-1, 1.5, 0.2}, 1), next = wall_frame({-0.7, 1.2, 0}, 1);
  const BodyPlace place{0, 0.2, 0.4, true};
  Hemisphere h = stratified_hemisphere(400, 1), then = h;
  std::vector<SeenPlace> seen;
  irradiance_in(now, place, h, &seen);
  const RgbD wanted = irradiance_in(next, place, then, nullptr);
  const RgbD found = record_value(reprojected(h, seen, place, FrameChange(now, next))).irradiance;
  // What is not looked at anew is light off the black floor and from there off the wall: 0.1 %.
  EXPECT_NEAR(found.g, wanted.g, 2e-3 * wanted.g);
  EXPECT_GT(std::abs(record_value(h).irradiance.g - wanted.g), 0.1 * wanted.g);
}

TEST(Reprojection, MovedWallIsSeenWhereItWillBe) {
  // A step of a tenth of its distance: what is found has to be nearer to the truth than what is,
  // by far, and within the noise of strata on the wall's outline.
  const AnimatedFrame now = wall_frame({-1, 1.5, 0.2}, 1.0), next = wall_frame({-1, 1.5, 0.2}, 0.9);
  const BodyPlace place{0, 0.2, 0.4, true};
  Hemisphere h = stratified_hemisphere(4000, 1), then = h;
  std::vector<SeenPlace> seen;
  const double before = irradiance_in(now, place, h, &seen).g;
  const double wanted = irradiance_in(next, place, then, nullptr).g;
  ReprojectionReport report;
  const double found =
      record_value(reprojected(h, seen, place, FrameChange(now, next), &report)).irradiance.g;
  EXPECT_GT(std::abs(before - wanted), 0.05 * wanted);
  EXPECT_LT(std::abs(found - wanted), 0.25 * std::abs(before - wanted));
  EXPECT_GT(report.moved, 0);
}

// What a horizontal rectangle at `height` over a place takes of an irradiance of pi (Lambert's
// formula): half the sum over its edges of the angle they are seen at times the cosine between the
// normal and that of the plane through the place.
double covered_by(double x0, double x1, double z0, double z1, double height) {
  const Vec3 corner[] = {{x0, height, z0}, {x0, height, z1}, {x1, height, z1}, {x1, height, z0}};
  double sum = 0;
  for (int i = 0; i < 4; ++i) {
    const Vec3 a = normalize(corner[i]), b = normalize(corner[(i + 1) % 4]);
    sum += std::acos(dot(a, b)) * normalize(cross(a, b)).y / 2;
  }
  return std::abs(sum);
}

TEST(Reprojection, SmallStepsChangeLightByTheirShare) {
  // A black board under a sky of 1, far off the zenith, so that its step changes what it hides: a
  // step of some 2 degrees, a quarter of a stratum.
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-3, 0, 3}, {6, 0, 0}, {0, 0, -6});
  scene.material[0].albedo = {0, 0, 0};
  AnimatedFrame now;
  now.emission.resize(1), now.background = {1, 1, 1};
  const double step = 0.06;
  shapes::add_quad(scene, {0.5, 1, -0.7}, {1, 0, 0}, {0, 0, 1.4});
  now.scene = scene;
  AnimatedFrame next = now;
  for (std::size_t v = 4; v < 8; ++v) next.scene.position[v].x -= step;
  const BodyPlace place{0, 0, 0.5, true};  // the middle
  const Vec3 at = place_in(now.scene, place).position;
  const auto hidden = [&](double moved) {
    return covered_by(0.5 - moved - at.x, 1.5 - moved - at.x, -0.7 - at.z, 0.7 - at.z, 1);
  };
  const double wanted = hidden(0) - hidden(step);
  ASSERT_GT(std::abs(wanted), 0.02);
  const FrameChange change(now, next);
  const FrameTracer tracer(now);
  constexpr int kRecords = 100;
  double sum = 0, squares = 0;
  for (std::uint64_t key = 0; key < kRecords; ++key) {
    Hemisphere h = stratified_hemisphere(400, key);
    std::vector<SeenPlace> seen;
    gather_hemisphere(tracer, place_in(now.scene, place), key, h, &seen);
    const double found = record_value(reprojected(h, seen, place, change)).irradiance.g -
                         record_value(h).irradiance.g;
    sum += found, squares += found * found;
  }
  const double mean = sum / kRecords;
  const double spread = std::sqrt(squares / kRecords - mean * mean);
  // Strata move whole: an edge is where its strata are, half a stratum's width of them not known,
  // and they do not shrink as the board does by perspective: 10 % of the step's change.
  EXPECT_NEAR(mean, wanted, 0.1 * std::abs(wanted) + 4 * spread / std::sqrt(kRecords));
  // Whether a stratum at the edge is the board's is chance, but how far it moves is not: about 24
  // strata along two edges, of which each is there or not, spread by some 1/sqrt(24). Samples that
  // hop whole strata would spread by twice the change.
  EXPECT_LT(spread, 0.5 * std::abs(wanted));
}

TEST(Reprojection, HolesGetTheLightOfTheirDeepestNeighbour) {
  // Under a sky of 1 a black board leaves, from beside another one: where it was, the sky is what
  // is seen next to it wherever sky is next to it, and not the board that stays.
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-3, 0, 3}, {6, 0, 0}, {0, 0, -6});
  scene.material[0].albedo = {0, 0, 0};
  AnimatedFrame now;
  now.emission.resize(1), now.background = {1, 1, 1};
  shapes::add_quad(scene, {0, 1, -0.5}, {0.6, 0, 0}, {0, 0, 1});
  shapes::add_quad(scene, {-0.6, 1, -0.5}, {0.6, 0, 0}, {0, 0, 1});
  now.scene = scene;
  AnimatedFrame next = now;
  for (std::size_t v = 4; v < 8; ++v) next.scene.position[v].y = -5;
  const BodyPlace place{0, 0.25, 0.25, true};
  Hemisphere h = stratified_hemisphere(1000, 1);
  std::vector<SeenPlace> seen;
  irradiance_in(now, place, h, &seen);
  ReprojectionReport report;
  const Hemisphere found = reprojected(h, seen, place, FrameChange(now, next), &report);
  int holes = 0, torn = 0;
  for (int j = 0; j < h.rings; ++j) {
    for (int k = 0; k < h.sectors; ++k) {
      const auto triangle_at = [&](int ring, int sector) {
        return seen[h.number(ring, (sector + h.sectors) % h.sectors)].place.triangle;
      };
      if (const auto t = triangle_at(j, k); t != 2 && t != 3) continue;
      ++holes;
      bool sky = false, board = false;
      for (int a = std::max(j - 1, 0); a <= std::min(j + 1, h.rings - 1); ++a) {
        for (int b = k - 1; b <= k + 1; ++b) {
          sky = sky || triangle_at(a, b) == SeenPlace::kBackground;
          board = board || triangle_at(a, b) == 4 || triangle_at(a, b) == 5;
        }
      }
      EXPECT_TRUE(!sky || found.radiance[h.number(j, k)].g == 1) << j << ", " << k;
      torn += sky && board;
    }
  }
  EXPECT_EQ(report.holes, holes);
  EXPECT_GT(torn, 0);
}

TEST(Reprojection, PlaceOnABodyThatTurnsWithAllElseSeesTheSame) {
  // Everything turned by one rotation: directions of the place are as they were, and so is light.
  AnimatedFrame now = wall_frame({-1, 1.5, 0.2}, 1), next = now;
  const Rotation turn = rotation_y(0.7) * rotation_x(0.4);
  for (Vec3& p : next.scene.position) p = turn * p;
  for (Vec3& n : next.scene.normal) n = turn * n;
  next.light[0].position = turn * next.light[0].position;
  const BodyPlace place{0, 0.2, 0.4, true};
  Hemisphere h = stratified_hemisphere(400, 1);
  std::vector<SeenPlace> seen;
  irradiance_in(now, place, h, &seen);
  const RecordValue a = record_value(h);
  const RecordValue b = record_value(reprojected(h, seen, place, FrameChange(now, next)));
  // A direction on a border may fall into the next stratum by rounding: none of 400 does here.
  EXPECT_NEAR(b.irradiance.g, a.irradiance.g, 1e-6 * a.irradiance.g);
  EXPECT_NEAR(b.translation_x.g, a.translation_x.g, 1e-4 * a.irradiance.g);
}

// A small board with a lamp close under it, over a wide floor of little albedo that sees neither
// the lamp's light on itself nor anything else: all light after a reflection is the board's.
AnimatedFrame lit_board() {
  Scene scene = shapes::empty_scene();
  shapes::add_quad(scene, {-20, 0, 20}, {40, 0, 0}, {0, 0, -40});
  scene.material[0].albedo = {0, 0, 0};
  scene.material.push_back(scene.material[0]);
  scene.material[1].albedo = {0.5f, 0.5f, 0.5f};
  shapes::add_quad(scene, {0.9, 2, 0}, {0.1, 0, 0}, {0, 0, 0.1}, 1);  // faces down
  AnimatedFrame frame;
  frame.emission.resize(2);
  frame.scene = std::move(scene);
  SceneLight light;
  light.position = {0.95, 1.9, 0.05}, light.intensity = {1, 1, 1};
  frame.light.push_back(light);
  return frame;
}

// The irradiance of a place on the floor, or its integral over solid angle, by midpoints.
double from_board(const Vec3& at, bool irradiance = true) {
  constexpr int kSteps = 40;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const Vec3 p{0.9 + 0.1 * (i + 0.5) / kSteps, 2, 0.1 * (j + 0.5) / kSteps};
      const Vec3 lamp = Vec3{0.95, 1.9, 0.05} - p, way = at - p;
      const double arrives = 0.1 / std::pow(dot(lamp, lamp), 1.5);
      const double square = dot(way, way);
      const double cosine = 2 / std::sqrt(square);
      sum += 0.5 / kPi * arrives * (irradiance ? cosine : 1) * cosine / square * 0.01 /
             (kSteps * kSteps);
    }
  }
  return sum;
}

TEST(BrightSurfaces, AreFoundByRecordsThatWouldMissThem) {
  const AnimatedFrame frame = lit_board();
  const FrameTracer tracer(frame);
  ASSERT_FALSE(tracer.bright().empty());
  EXPECT_EQ(tracer.bright().chance(0), 0);
  const BodyPlace place{0, 0, 0.5, true};
  const PlaceFrame at = place_in(frame.scene, place);
  for (const bool even : {false, true}) {
    constexpr int kRecords = 200;
    const double wanted = from_board(at.position, !even);
    const Estimate found = estimate(7, kRecords, [&](PathRandom& random) {
      const auto key = static_cast<std::uint64_t>(random.next() * 1e15);
      Hemisphere h = stratified_hemisphere(400, key, even);
      std::vector<SeenPlace> seen;
      gather_hemisphere(tracer, at, key, h, &seen);
      double sum = 0;
      for (const RgbD& light : h.radiance) sum += light.g;
      return sum * (even ? 2 : 1) * kPi / static_cast<double>(h.direction.size());
    });
    EXPECT_NEAR(found.mean, wanted, 4 * found.error) << even;
    // The board is 6e-4 of the hemisphere: 400 strata alone would spread by 200 %. 256 looks at
    // light that varies by a factor of 5 spread by 4 %.
    EXPECT_LT(found.error * std::sqrt(kRecords), 0.15 * wanted) << even;
  }
}

TEST(BrightSurfaces, PathsWeighBothWaysToThem) {
  // A floor of albedo 1 at another place: what it sends up is its irradiance over pi. Paths that
  // come from it by chance and looks at the board must add up to one.
  AnimatedFrame frame = lit_board();
  frame.scene.material[0].albedo = {0.999f, 0.999f, 0.999f};
  frame.light[0].kind = SceneLight::Kind::spot;  // up, so that the floor has no light of the lamp
  frame.light[0].direction = {0, 1, 0};
  frame.light[0].inner = 1.3, frame.light[0].outer = 1.4;
  const FrameTracer tracer(frame);
  ASSERT_FALSE(tracer.bright().empty());
  const Vec3 there{0.7, 0, 0.3};
  const Vec3 from = tracer.visibility().to_local({0.6, 0.5, 0.3});
  const Vec3 way = normalize(tracer.visibility().to_local(there) - from);
  const Estimate found =
      estimate(3, 4000, [&](PathRandom& random) { return tracer.radiance(from, way, random).g; });
  // Nearly all of the light: what goes up from the floor and comes back off the board is 1e-4 of
  // it.
  const double wanted = 0.999 * from_board(there) / kPi;
  EXPECT_NEAR(found.mean, wanted, 4 * found.error + 1e-3 * wanted);
  EXPECT_LT(found.error, 0.02 * wanted);  // by chance alone 4000 paths would leave 60 %
}

TEST(Reprojection, LooksAtBrightSurfacesMoveWithThem) {
  const AnimatedFrame now = lit_board();
  AnimatedFrame next = now;
  // Board and lamp go to the side together.
  for (std::size_t v = 4; v < 8; ++v) next.scene.position[v].x += 0.3;
  next.light[0].position.x += 0.3;
  const FrameTracer tracer(now);
  const BodyPlace place{0, 0, 0.5, true};
  const PlaceFrame at = place_in(now.scene, place);
  const FrameChange change(now, next);
  const Estimate found = estimate(5, 50, [&](PathRandom& random) {
    const auto key = static_cast<std::uint64_t>(random.next() * 1e15);
    Hemisphere h = stratified_hemisphere(400, key);
    std::vector<SeenPlace> seen;
    gather_hemisphere(tracer, at, key, h, &seen);
    return record_value(reprojected(h, seen, place, change)).irradiance.g;
  });
  const double wanted = from_board(at.position - Vec3{0.3, 0, 0});
  EXPECT_GT(from_board(at.position) - wanted, 0.15 * wanted);
  EXPECT_NEAR(found.mean, wanted, 4 * found.error);
}

}  // namespace
}  // namespace haarlight
