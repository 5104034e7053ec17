// Temporal instant caching: whatever is edited, the cache is what one from scratch would be.

#include "caching/instant_cache.h"

#include <gtest/gtest.h>

#include <cmath>

#include "caching/path_picture.h"
#include "core/parallel.h"
#include "tests/caching/edited_scene.h"

namespace haarlight {
namespace {

InstantCacheOptions options_with(bool on_demand, bool carry) {
  InstantCacheOptions options;
  options.radius = 0.4, options.unit = 0.8;
  options.on_demand = on_demand, options.carry = carry;
  options.oldest = 12;
  return options;
}

std::vector<SurfaceRow> points_of(const MovingVisibility& scene, Image& picture) {
  std::vector<SurfaceRow> rows;
  surface_points(scene, *scene.frame().scene.camera, {2, 1}, picture, rows);
  return rows;
}

struct Found {
  std::int64_t records = 0;
};

// Follows `edits` edits and compares every record, light by light, with one made anew in a scene
// that is built anew.
void follow(std::uint64_t seed, int edits, bool on_demand, bool carry, InstantCacheReport& all,
            Found& found) {
  EditedScene scene(seed);
  MovingVisibility visibility(scene.body());
  InstantCache cache(options_with(on_demand, carry));
  std::vector<std::vector<RgbD>> irradiance;
  for (int e = 0; e < edits; ++e) {
    visibility.next(scene.frame());
    cache.update(visibility, virtual_lights(visibility, {48, 3, 1}), all);
    Image picture;
    const std::vector<SurfaceRow> rows = points_of(visibility, picture);
    cache.gather(visibility, rows, irradiance, all);
    const bool every = !on_demand || e % 16 == 15;
    if (on_demand && every) cache.refresh_all(visibility, all);
    const auto records = cache.records();
    for (std::size_t r = 0; r < records.size(); ++r) {
      // A third of them each time, one after the other: what is wrong stays so until it is found.
      if (!records[r].alive || (r + static_cast<std::size_t>(e)) % 3 != 0) continue;
      // What was not used may wait, nothing else.
      if (cache.is_stale(r)) {
        ASSERT_TRUE(on_demand && !every);
        continue;
      }
      const std::vector<PackedLight> wanted = cache.from_scratch(visibility, records[r].place);
      const auto light = cache.light_of(r);
      RgbD sum;
      for (std::size_t k = 0; k < wanted.size(); ++k) {
        ASSERT_EQ(light[k], wanted[k]) << "edit " << e << " record " << r << " light " << k;
        sum += unpack_light(wanted[k]);
      }
      ASSERT_EQ(records[r].irradiance, sum) << "edit " << e << " record " << r;
      ++found.records;
    }
    scene.edit();
  }
}

TEST(InstantCache, AfterAnyEditsEqualsOneFromScratch) {
  for (const bool on_demand : {false, true}) {
    for (const bool carry : {true, false}) {
      InstantCacheReport all;
      Found found;
      for (std::uint64_t seed = 1; seed <= 3 && !HasFatalFailure(); ++seed) {
        follow(seed, 250, on_demand, carry, all, found);
      }
      if (HasFatalFailure()) return;
      // That the cases were met at all.
      EXPECT_GT(found.records, 10000);
      EXPECT_GT(all.lights_changed, 500);
      EXPECT_GT(all.records_updated, 1000);
      EXPECT_GT(all.records_dropped, 100);
      EXPECT_GT(all.rays_saved, 100000);
      EXPECT_GE(all.records_carried, carry ? 100 : 0);
    }
  }
}

TEST(InstantCache, RecordsAreNoCloserThanHalfTheSpacing) {
  // A new record is a spacing from all others; a hollow one that is filled lies within half a
  // spacing of a place that is.
  InstantCacheOptions options = options_with(true, true);
  options.radius = 0.2;
  EditedScene scene(7);
  MovingVisibility visibility(scene.body());
  InstantCache cache(options);
  InstantCacheReport all;
  std::vector<std::vector<RgbD>> irradiance;
  std::size_t pairs = 0;
  for (int e = 0; e < 80; ++e) {
    visibility.next(scene.frame());
    cache.update(visibility, virtual_lights(visibility, {16, 3, 1}), all);
    Image picture;
    cache.gather(visibility, points_of(visibility, picture), irradiance, all);
    const auto records = cache.records();
    for (std::size_t a = 0; a < records.size(); ++a) {
      if (!records[a].alive || records[a].hollow) continue;
      for (std::size_t b = 0; b < a; ++b) {
        if (!records[b].alive || records[b].hollow) continue;
        const double q = length(records[a].position - records[b].position) / options.unit +
                         std::sqrt(std::max(1 - dot(records[a].normal, records[b].normal), 0.0));
        // In single precision, where the root of what is rounded to 2^-23 is 3e-4.
        ASSERT_GT(q, 0.5 * options.spacing * options.radius - 1e-3);
        ++pairs;
      }
    }
    scene.edit();
  }
  EXPECT_GT(pairs, 10000u);
  // Both kinds were met: hollow ones that were filled, and that were in the way.
  EXPECT_GT(all.records_updated, 100);
  EXPECT_GT(all.records_dropped, 20);
}

TEST(InstantCache, PartsSeeWhatTheWholeSees) {
  // Single rays through what rests and what moves, against one Embree scene of everything in the
  // same local coordinates, and that without any motion in between.
  EditedScene scene(5);
  MovingVisibility visibility(scene.body());
  PathRandom random(3);
  for (int e = 0; e < 20; ++e) {
    visibility.next(scene.frame());
    std::vector<std::uint32_t> every(scene.body().size());
    for (std::uint32_t t = 0; t < every.size(); ++t) every[t] = t;
    const Visibility all(
        scene.frame().scene,
        {visibility.to_local({0, 0, 0}) * (-1 / visibility.scale()), visibility.scale()}, every);
    int blocked = 0;
    for (int i = 0; i < 5000; ++i) {
      const auto any = [&] { return 2 * random.next() - 1; };
      const Vec3 from = visibility.to_local({any(), 1 + any(), any()});
      const Vec3 to = visibility.to_local({any(), 1 + any(), any()});
      const Segment s = segment_between(from, {0, 1, 0}, to, {0, 1, 0});
      const bool wanted = all.occluded(s.origin, s.direction, s.length);
      blocked += wanted;
      ASSERT_EQ(visibility.occluded(s), wanted);
      const auto hit = visibility.first_hit(from, s.direction);
      const auto other = all.first_hit(from, s.direction);
      ASSERT_EQ(hit.has_value(), other.has_value());
      ASSERT_EQ(hit ? hit->distance : 0, other ? other->distance : 0);
      // No box, no difference.
      if (!visibility.may_meet_moved(s) && visibility.any_moved() && !visibility.anew()) {
        ASSERT_FALSE(visibility.occluded_by_moving(s) && !visibility.occluded_by_moving_before(s));
      }
    }
    EXPECT_GT(blocked, 100);
    scene.edit();
  }
}

TEST(InstantCache, InterpolationOfEvenLightIsExact) {
  // Under an even background a plain has the same irradiance everywhere, and so has every mean.
  AnimatedFrame frame;
  frame.scene = shapes::empty_scene();
  shapes::add_quad(frame.scene, {-1, 0, 1}, {2, 0, 0}, {0, 0, -2});
  frame.scene.camera = look_at({0, 1.5, 1}, {0, 0, 0}, 0.7, 64, 48);
  frame.emission.resize(1);
  frame.background = {1, 1, 1};
  MovingVisibility visibility(std::vector<std::uint32_t>{0, 0});
  visibility.next(frame);
  InstantCache cache(options_with(false, true));
  InstantCacheReport report;
  cache.update(visibility, virtual_lights(visibility, {4096, 1, 1}), report);
  Image picture;
  const std::vector<SurfaceRow> rows = points_of(visibility, picture);
  std::vector<std::vector<RgbD>> irradiance;
  cache.gather(visibility, rows, irradiance, report);
  std::size_t points = 0;
  const double first = irradiance[24][0].g;
  for (const auto& row : irradiance) {
    for (const RgbD& e : row) {
      // Sums of some ten floats, eight lanes at a time.
      EXPECT_NEAR(e.g, first, 1e-6 * first);
      ++points;
    }
  }
  EXPECT_GT(points, 1000u);
  // E = pi L: 2048 even directions within 2 %, mantissas of 8 bits within 1/512 of the whole.
  EXPECT_NEAR(first, kPi, 0.022 * kPi);
}

TEST(InstantCache, NothingChangesNothingIsTraced) {
  EditedScene scene(2);
  MovingVisibility visibility(scene.body());
  InstantCache cache(options_with(false, true));
  std::vector<std::vector<RgbD>> first, second;
  Image picture;
  for (auto* out : {&first, &second}) {
    visibility.next(scene.frame());
    InstantCacheReport report;
    cache.update(visibility, virtual_lights(visibility, {64, 3, 1}), report);
    cache.gather(visibility, points_of(visibility, picture), *out, report);
    if (out == &first) {
      EXPECT_GT(report.records_new, 10);
      EXPECT_GT(report.rays_whole, 300);
    } else {
      EXPECT_EQ(report.records_new + report.records_dropped + report.records_updated, 0);
      EXPECT_EQ(report.rays_whole + report.rays_moving, 0);
      EXPECT_GT(report.rays_saved, 300);
    }
  }
  EXPECT_TRUE(first == second);
}

TEST(InstantCache, TellsHowLongRecordsHaveBeenGood) {
  EditedScene scene(2);
  MovingVisibility visibility(scene.body());
  InstantCache cache(options_with(true, false));
  InstantCacheReport report;
  std::vector<std::vector<RgbD>> irradiance;
  std::vector<std::vector<float>> frames;
  for (int e = 0; e < 8; ++e) {
    visibility.next(scene.frame());
    cache.update(visibility, virtual_lights(visibility, {32, 3, 1}), report);
    Image picture;
    const std::vector<SurfaceRow> rows = points_of(visibility, picture);
    cache.gather(visibility, rows, irradiance, report);
    cache.kept_for(rows, 5, frames);
    std::size_t points = 0;
    for (const auto& row : frames) {
      for (const float f : row) {
        // All were made in the first frame, and nothing has happened since.
        ASSERT_NEAR(f, std::min(e, 5), 1e-4);
        ++points;
      }
    }
    EXPECT_GT(points, 200u);
  }
}

TEST(InstantCache, SameBitsOnAnyNumberOfThreads) {
  const int before = thread_count();
  std::vector<std::vector<RgbD>> reference;
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    EditedScene scene(9);
    MovingVisibility visibility(scene.body());
    InstantCache cache(options_with(true, true));
    std::vector<std::vector<RgbD>> irradiance;
    for (int e = 0; e < 12; ++e) {
      visibility.next(scene.frame());
      InstantCacheReport report;
      cache.update(visibility, virtual_lights(visibility, {64, 3, 1}), report);
      Image picture;
      cache.gather(visibility, points_of(visibility, picture), irradiance, report);
      scene.edit();
    }
    if (threads == 1) {
      reference = irradiance;
    } else {
      EXPECT_TRUE(irradiance == reference);
    }
  }
  set_thread_count(before);
}

TEST(PackedLight, KeepsEightBitsOfTheLargestChannel) {
  PathRandom random(4);
  for (int i = 0; i < 20000; ++i) {
    const double size = std::exp(160 * random.next() - 80);
    const RgbD c{size * random.next(), size * random.next(), size * random.next()};
    const PackedLight p = pack_light(c);
    const RgbD back = unpack_light(p);
    // Half a step of a mantissa of 128 to 255.
    const double most = std::max({c.r, c.g, c.b}), step = most / 255 * 1.01;
    EXPECT_NEAR(back.r, c.r, step);
    EXPECT_NEAR(back.g, c.g, step);
    EXPECT_NEAR(back.b, c.b, step);
    EXPECT_NE(p, kShadowed);
    EXPECT_NE(p, kUnlit);
  }
  for (const PackedLight p : {kShadowed, kUnlit, kFaint}) EXPECT_EQ(unpack_light(p), RgbD{});
  EXPECT_EQ(pack_light({1e-300, 0, 0}), kFaint);
  EXPECT_TRUE(is_finite(unpack_light(pack_light({1e300, 1, 1}))));
}

}  // namespace
}  // namespace haarlight
