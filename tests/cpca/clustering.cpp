// Points shared out to flats.

#include "cpca/clustering.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "core/error.h"
#include "core/parallel.h"

namespace haarlight {
namespace {

// `count` points on each of `flats` flats of `axes` dimensions through the origin, flats far apart.
Sketch points_on_flats(int flats, int axes, int count, double noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Sketch points;
  points.dims = 64;
  for (int f = 0; f < flats; ++f) {
    std::vector<std::vector<double>> axis(static_cast<std::size_t>(axes), std::vector<double>(64));
    for (auto& a : axis) {
      for (double& x : a) x = normal(random);
    }
    for (int i = 0; i < count; ++i) {
      std::vector<double> p(64);
      for (std::size_t a = 0; a < axis.size(); ++a) {
        const double along = a == 0 ? 4 + 0.2 * normal(random) : 0.7 * normal(random);
        for (std::size_t d = 0; d < 64; ++d) p[d] += along * axis[a][d];
      }
      for (double& x : p) points.value.push_back(static_cast<float>(x + noise * normal(random)));
    }
  }
  return points;
}

// |a| with room for the rounding of float points and axes: 1e-5 of the squared length of all.
void expect_falls(const Clustering& found, const Sketch& points) {
  double size = 0;
  for (const float x : points.value) size += static_cast<double>(x) * x;
  for (std::size_t i = 1; i < found.inertia.size(); ++i) {
    EXPECT_LE(found.inertia[i], found.inertia[i - 1] + 1e-10 * size) << i;
  }
}

TEST(Clustering, FindsFlatsThatAreThere) {
  // Up to eight clusters: the first six centres lie on six flats, and nothing is left to split off.
  const Sketch points = points_on_flats(6, 3, 40, 0, 1);
  const Clustering found = cluster_points(points, {.clusters = 8, .basis = 3}, {});
  ASSERT_EQ(found.clusters, 6);
  std::map<std::uint32_t, std::set<std::size_t>> flats_of;
  for (std::size_t i = 0; i < 240; ++i) flats_of[found.cluster[i]].insert(i / 40);
  for (const auto& [cluster, flats] : flats_of) EXPECT_EQ(flats.size(), 1u) << cluster;
  expect_falls(found, points);
  double size = 0;
  for (const float x : points.value) size += static_cast<double>(x) * x;
  EXPECT_LE(found.inertia.back(), 1e-10 * size);
}

TEST(Clustering, InertiaNeverRisesAndIsWhatThePointsLeave) {
  for (const std::uint64_t seed : {2u, 3u, 4u}) {
    const Sketch points = points_on_flats(9, 5, 60, 0.3, seed);
    const Clustering found =
        cluster_points(points, {.clusters = 30, .basis = 2, .iterations = 20, .seed = seed}, {});
    EXPECT_EQ(found.clusters, 30);
    ASSERT_GE(found.inertia.size(), 3u);
    expect_falls(found, points);
    EXPECT_LT(found.inertia.back(), 0.8 * found.inertia.front());
  }
}

TEST(Clustering, DuplicatesAndTooManyClustersEnd) {
  // Four different points, twenty times each: four clusters are all there can be, and nothing is
  // left to split.
  Sketch points = points_on_flats(4, 1, 1, 0, 5);
  const std::vector<float> four = points.value;
  for (int i = 1; i < 20; ++i) points.value.insert(points.value.end(), four.begin(), four.end());
  const Clustering found =
      cluster_points(points, {.clusters = 50, .basis = 1, .iterations = 1000}, {});
  EXPECT_LE(found.clusters, 80);
  EXPECT_GE(found.clusters, 4);
  EXPECT_LT(found.inertia.size(), 2100u);
  for (std::size_t i = 4; i < 80; ++i) EXPECT_EQ(found.cluster[i], found.cluster[i % 4]);
}

TEST(Clustering, PointsAtTheOriginAreApart) {
  Sketch points = points_on_flats(2, 2, 10, 0, 6);
  std::fill_n(points.value.begin() + 64 * 5, 64, 0.0f);
  std::fill_n(points.value.begin() + 64 * 15, 64, 0.0f);
  const Clustering found = cluster_points(points, {.clusters = 3, .basis = 2}, {});
  ASSERT_EQ(found.clusters, 3);
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(found.cluster[i] == 2, i == 5 || i == 15) << i;

  const Clustering one = cluster_points(points, {.clusters = 1, .basis = 2}, {});
  EXPECT_EQ(one.clusters, 1);
  EXPECT_EQ(one.cluster, std::vector<std::uint32_t>(20, 0));
  EXPECT_EQ(cluster_points(points, {.clusters = 2, .basis = 2}, {}).clusters, 2);

  const Sketch nothing{64, std::vector<float>(64 * 7, 0.0f)};
  const Clustering dark = cluster_points(nothing, {.clusters = 3}, {});
  EXPECT_EQ(dark.clusters, 1);
  EXPECT_EQ(dark.cluster, std::vector<std::uint32_t>(7, 0));
}

TEST(Clustering, SameOnAnyNumberOfThreadsAndStopsWhenAsked) {
  const Sketch points = points_on_flats(5, 4, 200, 0.2, 7);
  const ClusteringOptions options{.clusters = 20, .basis = 3};
  const int threads = thread_count();
  set_thread_count(1);
  const Clustering one = cluster_points(points, options, {});
  set_thread_count(7);
  const Clustering seven = cluster_points(points, options, {});
  set_thread_count(threads);
  EXPECT_EQ(one.cluster, seven.cluster);
  EXPECT_EQ(one.inertia, seven.inertia);
  EXPECT_THROW(cluster_points(points, options, [](double share) { return share < 0.5; }), Error);
}

}  // namespace
}  // namespace haarlight
