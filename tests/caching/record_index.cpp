// Finding and weighting records: against asking all of them one by one.

#include "caching/record_index.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "caching/record_blocks.h"
#include "precompute/random.h"

namespace haarlight {
namespace {

constexpr double kUnit = 0.7;

struct Place {
  Vec3 position, normal;
};

Vec3 any(PathRandom& random) {
  return {2 * random.next() - 1, 2 * random.next() - 1, 2 * random.next() - 1};
}

// Normals within some 50 degrees of one axis.
Vec3 up(PathRandom& random) { return normalize(Vec3{0, 0, 1.5} + any(random)); }

std::vector<Place> places(PathRandom& random, int count) {
  std::vector<Place> all;
  for (int i = 0; i < count; ++i) {
    // Some in one place.
    all.push_back(i % 5 == 4 ? all.back() : Place{any(random), up(random)});
  }
  return all;
}

// 1 / w_k as equation 5 has it, in double.
double distance(const Place& a, const Place& b) {
  return length(a.position - b.position) / kUnit +
         std::sqrt(std::max(1 - dot(a.normal, b.normal), 0.0));
}

SurfaceCoordinates at(const Place& p) {
  return surface_coordinates(p.position, p.normal, 1 / kUnit);
}

RecordIndex index_of(const std::vector<Place>& records) {
  std::vector<RecordIndex::Entry> entries;
  for (std::uint32_t r = 0; r < records.size(); ++r) entries.push_back({at(records[r]), r});
  RecordIndex index;
  index.build(entries);
  index.set_light([](std::uint32_t r) { return Rgb{1.0f + static_cast<float>(r), 2, 0.5f}; });
  return index;
}

TEST(RecordIndex, FindsAllThatReachAPatch) {
  PathRandom random(1);
  for (const int count : {1, 8, 9, 17, 700}) {
    const std::vector<Place> records = places(random, count);
    const RecordIndex index = index_of(records);
    std::size_t found = 0, asked = 0;
    for (int i = 0; i < 200; ++i) {
      SurfaceBox box = SurfaceBox::nothing();
      std::vector<Place> points;
      const Place middle{any(random), up(random)};
      for (int k = 0; k < 3; ++k) {
        points.push_back(
            {middle.position + any(random) * 0.05, normalize(middle.normal + any(random) * 0.1)});
        box.add(at(points.back()));
      }
      std::vector<const RecordBlock*> near;
      index.near(box, 0.5f, near);
      std::set<std::uint32_t> numbers;
      for (const RecordBlock* block : near) {
        for (std::size_t k = 0; k < block->size; ++k) numbers.insert(block->number[k]);
      }
      asked += numbers.size();
      for (std::uint32_t r = 0; r < records.size(); ++r) {
        for (const Place& p : points) {
          if (!(distance(p, records[r]) < 0.5)) continue;
          ASSERT_TRUE(numbers.contains(r)) << count;
          ++found;
        }
      }
    }
    if (count == 700) {
      EXPECT_GT(found, 300u);
      EXPECT_LT(asked, 200u * 700 / 3);  // few others
    }
  }
}

TEST(RecordIndex, SumsAreEquationFour) {
  PathRandom random(2);
  const std::vector<Place> records = places(random, 300);
  const RecordIndex index = index_of(records);
  const RecordReach reach{0.8f, 0.3f, 1 / 0.8f};
  int near_ones = 0;
  for (int i = 0; i < 500; ++i) {
    const Place p =
        i % 10 == 0 ? records[static_cast<std::size_t>(i) / 2] : Place{any(random), up(random)};
    SurfaceBox box = SurfaceBox::nothing();
    box.add(at(p));
    std::vector<const RecordBlock*> near;
    index.near(box, reach.far, near);
    std::vector<std::uint8_t> used(near.size()), used_portable(near.size());
    RecordSum sum, portable;
    const WeightedPoint point{at(p), &sum}, same{at(p), &portable};
    add_records(near, {&point, 1}, reach, used.data());
    add_records_portable(near, {&same, 1}, reach, used_portable.data());
    ASSERT_EQ(sum.r, portable.r);
    ASSERT_EQ(sum.g, portable.g);
    ASSERT_EQ(sum.weight, portable.weight);
    ASSERT_EQ(sum.near, portable.near);
    ASSERT_EQ(used, used_portable);

    double weights = 0, red = 0;
    bool is_near = false, at_an_edge = false;
    std::set<std::uint32_t> reaching;
    for (std::uint32_t r = 0; r < records.size(); ++r) {
      const double q = distance(p, records[r]);
      at_an_edge = at_an_edge || std::abs(q - 0.8) < 1e-5 || std::abs(q - 0.3) < 1e-5;
      if (!(q < 0.8)) continue;
      reaching.insert(r);
      is_near = is_near || q < 0.3;
      const double w = std::max(1 / std::max(q, 1e-6) - 1 / 0.8, 1e-9);
      weights += w, red += w * (1 + r);
    }
    if (at_an_edge) continue;
    std::set<std::uint32_t> marked;
    for (std::size_t b = 0; b < near.size(); ++b) {
      for (std::size_t k = 0; k < 8; ++k) {
        if (used[b] >> k & 1u) marked.insert(near[b]->number[k]);
      }
    }
    ASSERT_EQ(marked, reaching);
    ASSERT_EQ(sum.near, is_near);
    near_ones += is_near;
    // Coordinates below 2 in float: q is off by a few 2^-23. At a record 1/q is what rounding
    // makes it, but then nothing else counts.
    const double mean = weights > 0 ? red / weights : 0;
    const double found =
        sum.weight > 0 ? static_cast<double>(sum.r) / static_cast<double>(sum.weight) : 0;
    EXPECT_NEAR(found, mean, 2e-3 * mean + 1e-6) << i;
  }
  EXPECT_GT(near_ones, 50);
}

}  // namespace
}  // namespace haarlight
