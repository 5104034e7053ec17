// Rows 25 to 28: few points, equal points, points at zero, points far from the origin.

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "cpca/cluster_relighter.h"
#include "cpca/clustering.h"
#include "cpca/compress.h"
#include "cpca/principal.h"
#include "prt/lighting_tracker.h"
#include "tests/core/temporary_folder.h"
#include "tests/hard/hard_case.h"
#include "tests/prt/fixtures.h"

namespace haarlight {
namespace {

using namespace hard;

constexpr double u = 0x1p-24;

Eigen::MatrixXd matrix_of(const Sketch& points) {
  Eigen::MatrixXd x(static_cast<Eigen::Index>(points.count()), points.dims);
  for (std::size_t i = 0; i < points.count(); ++i) {
    for (int d = 0; d < points.dims; ++d) {
      x(static_cast<Eigen::Index>(i), d) = static_cast<double>(points.point(i)[d]);
    }
  }
  return x;
}

// Squared length of points, and what their clusters' flats leave, by singular values in double.
struct Left {
  double size = 0, inertia = 0;
};
Left left_by(const Sketch& points, const std::vector<std::uint32_t>& cluster, int basis) {
  Left out;
  std::map<std::uint32_t, std::vector<Eigen::Index>> members;
  for (std::size_t i = 0; i < cluster.size(); ++i) {
    members[cluster[i]].push_back(static_cast<Eigen::Index>(i));
  }
  const Eigen::MatrixXd all = matrix_of(points);
  out.size = all.squaredNorm();
  for (const auto& [c, rows] : members) {
    const Eigen::MatrixXd x = all(rows, Eigen::all);
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(x);
    const Eigen::Index rank = svd.singularValues().size();
    if (rank > basis) out.inertia += svd.singularValues().tail(rank - basis).squaredNorm();
  }
  return out;
}

// How far inertia rises beyond what rounding explains, of the points' squared length.
double largest_rise(const Clustering& found, double size) {
  double rise = 0;
  for (std::size_t i = 1; i < found.inertia.size(); ++i) {
    rise = std::max(rise, (found.inertia[i] - found.inertia[i - 1]) / std::max(size, 1e-300));
  }
  return rise;
}

TEST(HardCases, Row25_FewerPointsThanDimensions) {
  property("n points have at most n vectors: residual <= 10 n u s1; more are not made up");
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  double of_bound = 0, too_many = 0;
  for (const Eigen::Index n : {1, 2, 5, 30}) {
    Eigen::MatrixXd x(n, 400);
    for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] = normal(random);
    if (n > 2) x.row(2) = x.row(0) + 1e-5 * x.row(2);  // all but dependent
    const Principal p = principal_of_gram(x * x.transpose(), 200);
    too_many += p.sigma.size() > n || !p.left.allFinite();
    const double first = p.sigma.size() ? p.sigma[0] : 0;
    const double residual = (x - p.left * (p.left.transpose() * x)).norm();
    of_bound = std::max(of_bound, residual / (10 * static_cast<double>(n) * u * first));
  }
  at_most("of the bound", of_bound, 1);
  at_most("vectors more than points", too_many, 0);

  // From end to end: clusters of five vertices asked for 64 vectors each show the transport, within
  // what 8 bits and the weights' 16 leave.
  const auto small = fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(60, 2), 3);
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const TemporaryFolder folder;
  const CompressReport report = compress_transport(transport, folder / "a.hlt",
                                                   {.clusters = 12, .basis = 64, .error = 0.001});
  at_most("relative error of clusters of few", report.measured_error, 0.01);
}

TEST(HardCases, Row26_EmptyAndDuplicateClusters) {
  property("equal points, more clusters than points: it ends in time and inertia never rises");
  std::mt19937_64 random(4);
  std::normal_distribution<float> normal;
  double rise = 0, late = 0, bad = 0;
  for (const int different : {1, 3, 10}) {
    for (const int clusters : {1, 3, 40}) {
      Sketch points;
      points.dims = 64;
      std::vector<float> some(static_cast<std::size_t>(64 * different));
      for (float& x : some) x = normal(random);
      for (int i = 0; i < 30; ++i)
        points.value.insert(points.value.end(), some.begin(), some.end());
      points.value.resize(points.value.size() + 64 * 3, 0.0f);  // and some at the origin
      const Clustering found =
          cluster_points(points, {.clusters = clusters, .basis = 1, .iterations = 12}, {});
      const std::set<std::uint32_t> used(found.cluster.begin(), found.cluster.end());
      bad += static_cast<int>(used.size()) != found.clusters ||
             found.cluster.size() != points.count() || found.clusters < 1;
      late += found.inertia.size() > 2 * 12 + 2;
      double size = 0;
      for (const float x : points.value) size += static_cast<double>(x) * static_cast<double>(x);
      rise = std::max(rise, largest_rise(found, size));
      for (const double inertia : found.inertia) bad += !(inertia >= 0);
    }
  }
  // gamma_n of 64 products in float and the flats' own rounding.
  at_most("rise of inertia, of the points' size", rise, 64 * u * u * 1e4);
  at_most("more rounds than allowed", late, 0);
  at_most("empty clusters, points without one, inertia below 0", bad, 0);
}

TEST(HardCases, Row27_ZeroTransport) {
  property("vertices without transport: finite files and errors, and sums of exactly +0");
  auto small = fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(300, 5), 6);
  const auto order = row_order(small.info);
  std::set<std::uint32_t> dark;
  for (std::size_t t = 0; t < 2; ++t) {
    std::fill(small.tiles[t].values.begin(), small.tiles[t].values.end(), 0.0f);
    for (std::size_t r = 0; r < kTileRows; ++r) {
      if (order[t * kTileRows + r] != kNoOutput) dark.insert(order[t * kTileRows + r]);
    }
  }
  const Transport transport = build_transport(small.info, small.tiles, small.thresholds);
  const TemporaryFolder folder;
  const CompressReport report =
      compress_transport(transport, folder / "a.hlt", {.clusters = 6, .basis = 4});
  double bad = !std::isfinite(report.measured_error), lit = 0;
  for (const double e : report.of_lightings) bad += !std::isfinite(e);
  ClusterRelighter relighter(Transport::open(folder / "a.hlt"),
                             {.basis_terms = -1, .skip_unseen = false});
  LightingTracker tracker(relighter.transport().layout(), {});
  std::mt19937_64 random(7);
  for (int frame = 0; frame < 20; ++frame) {
    relighter.apply(tracker.advance(fixtures::random_lighting(tracker.layout(), random)));
    for (std::size_t v = 0; v < relighter.sums().size(); ++v) {
      const Rgb& sum = relighter.sums()[v];
      bad += !is_finite(sum);
      if (!dark.contains(static_cast<std::uint32_t>(v))) continue;
      for (const float c : {sum.r, sum.g, sum.b}) lit += std::bit_cast<std::uint32_t>(c) != 0;
    }
  }
  at_least("vertices without transport", static_cast<double>(dark.size()), 64);
  at_most("values that are not finite", bad, 0);
  at_most("sums of those vertices that are not +0", lit, 0);

  // All of it zero.
  for (TileRows& tile : small.tiles) std::fill(tile.values.begin(), tile.values.end(), 0.0f);
  const CompressReport nothing =
      compress_transport(build_transport(small.info, small.tiles, small.thresholds),
                         folder / "b.hlt", {.clusters = 6, .basis = 4});
  for (const double e : nothing.of_lightings) bad += !std::isfinite(e);
  at_most("errors that are not finite where all is zero", bad, 0);
  at_most("error where all is zero", nothing.measured_error, 0);
}

TEST(HardCases, Row28_DistancesFarFromTheOrigin) {
  property(
      "distances to flats are differences first: inertia >= 0 and that of double; near points "
      "far out are told apart");
  // Two bundles of points 1e4 long that part by 1e-2 of a radian: |x|^2 - 2xc + |c|^2 in float
  // would be wrong by 1e8 u = 6, the points' distances from their flats are 0.1.
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal;
  double off = 0, negative = 0, mixed = 0;
  for (int trial = 0; trial < 5; ++trial) {
    std::vector<double> a(64), b(64);
    for (std::size_t d = 0; d < 64; ++d) {
      a[d] = normal(random);
      b[d] = a[d] + 1e-2 * normal(random);
    }
    Sketch points;
    points.dims = 64;
    for (int i = 0; i < 80; ++i) {
      const std::vector<double>& axis = i % 2 ? a : b;
      const double along = 1250 * (1 + 0.1 * normal(random));
      for (std::size_t d = 0; d < 64; ++d) {
        points.value.push_back(static_cast<float>(along * axis[d] + 0.0125 * normal(random)));
      }
    }
    const Clustering found = cluster_points(
        points, {.clusters = 2, .basis = 1, .iterations = 30, .seed = 1 + std::uint64_t(trial)},
        {});
    for (const double inertia : found.inertia) negative += !(inertia >= 0);
    const Left exact = left_by(points, found.cluster, 1);
    off = std::max(off, std::abs(found.inertia.back() - exact.inertia) / exact.inertia);
    for (std::size_t i = 2; i < found.cluster.size(); ++i) {
      mixed += (found.cluster[i] == found.cluster[i % 2]) != true;
    }
  }
  at_most("distances below 0", negative, 0);
  at_most("inertia against double", off, 0.05);
  at_most("points in the other bundle's cluster", mixed, 0);
}

}  // namespace
}  // namespace haarlight
