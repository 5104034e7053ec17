// Rows of vertices, their sketch, and the best vectors of a cluster.

#include "cpca/cluster_basis.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <numeric>
#include <random>

#include "core/error.h"
#include "core/parallel.h"
#include "prt/prior_lighting.h"
#include "tests/cpca/inputs.h"

namespace haarlight {
namespace {

using fixtures::SmallTransport;

Transport build(const SmallTransport& small) {
  return build_transport(small.info, small.tiles, small.thresholds);
}

std::vector<std::uint32_t> first_vertices(std::size_t count) {
  std::vector<std::uint32_t> v(count);
  std::iota(v.begin(), v.end(), 0u);
  return v;
}

Eigen::MatrixXd matrix_of(const VertexRows& rows, std::span<const std::uint32_t> vertices,
                          int channels) {
  std::vector<float> values;
  rows.read(vertices, channels, values);
  return Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
             values.data(), static_cast<Eigen::Index>(vertices.size()),
             static_cast<Eigen::Index>(rows.point_size(channels)))
      .cast<double>();
}

// || X - W B ||, Frobenius.
double left_by(const Eigen::MatrixXd& x, const ClusterBasis& basis) {
  Eigen::MatrixXd rest = x;
  for (std::size_t i = 0; i < basis.count; ++i) {
    const Eigen::Map<const Eigen::VectorXd> w(
        basis.weight.data() + i * static_cast<std::size_t>(x.rows()), x.rows());
    const Eigen::Map<const Eigen::RowVectorXf> b(
        basis.vector.data() + i * static_cast<std::size_t>(x.cols()), x.cols());
    rest -= w * b.cast<double>();
  }
  return rest.norm();
}

TEST(VertexRows, AreTheTransportsRows) {
  for (const int terms : {1, 3}) {
    const Transport transport =
        build(fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(1500, 1), 1, terms));
    const std::vector<double> dense = fixtures::dense_rows(transport);
    const VertexRows rows(transport);
    std::vector<std::uint32_t> vertices{1400, 3, 77, 4, 900};
    std::vector<float> values;
    rows.read(vertices, 3, values);
    const auto count = static_cast<std::size_t>(terms);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      for (std::size_t k = 0; k < count; ++k) {
        for (std::size_t at = 0; at < 3 * 96; ++at) {
          const double right = dense[(vertices[i] * count + k) * 3 * 96 + at];
          EXPECT_NEAR(values[(i * count + k) * 3 * 96 + at], right, 0x1p-22 * std::abs(right));
        }
      }
    }
  }
}

TEST(VertexRows, GreyRowsTimesTheirTintAreTheTransportsRows) {
  const Transport transport = build(fixtures::smooth_transport(4, 200, 2, true));
  const std::vector<double> dense = fixtures::dense_rows(transport);
  const VertexRows rows(transport);
  EXPECT_FALSE(rows.any_rgb());
  const std::vector<std::uint32_t> vertices{0, 11, 100};
  std::vector<float> values;
  rows.read(vertices, 1, values);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 2; ++k) {
      const Rgb t = rows.tint(vertices[i], static_cast<int>(k));
      EXPECT_NEAR(t.r * t.r + t.g * t.g + t.b * t.b, 3, 1e-5);
      for (std::size_t ch = 0; ch < 3; ++ch) {
        for (std::size_t j = 0; j < 96; ++j) {
          const double right = dense[((vertices[i] * 2 + k) * 3 + ch) * 96 + j];
          EXPECT_NEAR((ch == 0   ? t.r
                       : ch == 1 ? t.g
                                 : t.b) *
                          values[(i * 2 + k) * 96 + j],
                      right, 0x1p-21 * std::abs(right));
        }
      }
    }
  }
  EXPECT_THROW(VertexRows(build(fixtures::small_transport(4, 8, 8, 1))), Error);
}

TEST(Sketch, KeepsDistances) {
  const Transport transport =
      build(fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(150, 2), 2, 2));
  const VertexRows rows(transport);
  constexpr int kDims = 256;
  const Sketch sketch = sketch_rows(rows, kDims, 1, {});
  const auto vertices = first_vertices(40);
  // Grey rows count as white ones of the same size do: compare against those.
  Eigen::MatrixXd x = matrix_of(rows, vertices, 3);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    for (int k = 0; k < 2; ++k) {
      const auto tint = rows.tint(static_cast<std::size_t>(i), k);
      if (tint == Rgb{1, 1, 1}) continue;
      const Eigen::RowVectorXd grey = x.block(i, k * 3 * 96, 1, 96) / static_cast<double>(tint.r);
      for (int ch = 0; ch < 3; ++ch) x.block(i, (k * 3 + ch) * 96, 1, 96) = grey;
    }
  }
  // A squared distance has a standard deviation of at most sqrt(2 / dims) of it: the mean of the
  // relative deviations of 40 points from each other stays within 4 of its own (pairs of 40 points
  // are worth at least 20 independent ones), single ones within 6.
  double mean = 0;
  int pairs = 0;
  const double sd = std::sqrt(2.0 / kDims);
  for (Eigen::Index a = 0; a < 40; ++a) {
    for (Eigen::Index b = 0; b < a; ++b) {
      double d = 0;
      for (int i = 0; i < kDims; ++i) {
        const double e = static_cast<double>(sketch.point(static_cast<std::size_t>(a))[i]) -
                         static_cast<double>(sketch.point(static_cast<std::size_t>(b))[i]);
        d += e * e;
      }
      const double ratio = d / (x.row(a) - x.row(b)).squaredNorm() - 1;
      EXPECT_LT(std::abs(ratio), 6 * sd);
      mean += ratio;
      ++pairs;
    }
  }
  EXPECT_LT(std::abs(mean / pairs), 4 * sd / std::sqrt(20.0));

  const int threads = thread_count();
  set_thread_count(5);
  EXPECT_EQ(sketch_rows(rows, kDims, 1, {}).value, sketch.value);
  set_thread_count(threads);
}

// Vertices of so many terms lie in more than one chunk: their points have one owner at a time, and
// are sums over all of their rows.
TEST(Sketch, OfVerticesWithManyTermsIsTheSumOverTheirRows) {
  constexpr int kTerms = 200, kDims = 64;
  const Transport transport =
      build(fixtures::small_mesh_transport(2, fixtures::bumpy_sphere(120, 3), 3, kTerms));
  ASSERT_GT(transport.chunk_count(), 4);
  const VertexRows rows(transport);
  const int threads = thread_count();
  set_thread_count(1);
  const Sketch one = sketch_rows(rows, kDims, 1, {});
  set_thread_count(7);
  for (int run = 0; run < 5; ++run) {
    EXPECT_EQ(sketch_rows(rows, kDims, 1, {}).value, one.value) << "run " << run;
  }
  set_thread_count(threads);
  // |p|^2 is |x|^2 in the mean; over 100 vertices whose rows differ, within 4 standard deviations.
  const auto vertices = first_vertices(100);
  const Eigen::MatrixXd x = matrix_of(rows, vertices, 3);
  double mean = 0;
  for (std::size_t v = 0; v < 100; ++v) {
    double size = 0;
    for (int i = 0; i < kDims; ++i) {
      size += static_cast<double>(one.point(v)[i]) * static_cast<double>(one.point(v)[i]);
    }
    double right = 0;
    for (int k = 0; k < kTerms; ++k) {
      const auto tint = rows.tint(v, k);
      const auto part = x.row(static_cast<Eigen::Index>(v)).segment(k * 3 * 24, 3 * 24);
      right += tint == Rgb{1, 1, 1}
                   ? part.squaredNorm()
                   : 3 * part.head(24).squaredNorm() /
                         (static_cast<double>(tint.r) * static_cast<double>(tint.r));
    }
    mean += size / right / 100;
  }
  EXPECT_NEAR(mean, 1, 4 * std::sqrt(2.0 / kDims / 100));
}

TEST(ClusterBasis, IsTheBestOfItsLength) {
  const Transport transport = build(fixtures::smooth_transport(8, 150, 2, false));
  const VertexRows rows(transport);
  const Sketch sketch = sketch_rows(rows, 128, 1, {});
  const auto vertices = first_vertices(60);
  const Eigen::MatrixXd x = matrix_of(rows, vertices, 1);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(x);
  for (const std::size_t count : {1u, 5u, 20u}) {
    const ClusterBasis basis = find_basis(rows, sketch, vertices, count, {});
    ASSERT_EQ(basis.count, count);
    EXPECT_EQ(basis.channels, 1);
    const double tail = svd.singularValues().tail(60 - static_cast<Eigen::Index>(count)).norm();
    // Vectors are kept in float.
    EXPECT_NEAR(left_by(x, basis), tail, 1e-6 * x.norm());
    for (std::size_t i = 0; i < count; ++i) {
      double sum = 0;
      for (std::size_t v = 0; v < 60; ++v)
        sum += basis.weight[i * 60 + v] * basis.weight[i * 60 + v];
      EXPECT_NEAR(sum / 60, 1, 1e-12);
    }
    // The mean and the best vectors about it, as many in all, leave no less.
    const Eigen::MatrixXd centred = x.rowwise() - x.colwise().mean();
    const Eigen::JacobiSVD<Eigen::MatrixXd> affine(centred);
    EXPECT_LE(tail, affine.singularValues().tail(61 - static_cast<Eigen::Index>(count)).norm() *
                        (1 + 1e-12));
  }
}

TEST(ClusterBasis, OfAsManyVectorsAsVerticesLeavesNothing) {
  const Transport transport =
      build(fixtures::small_mesh_transport(4, fixtures::bumpy_sphere(90, 3), 3, 2));
  const VertexRows rows(transport);
  const Sketch sketch = sketch_rows(rows, 128, 1, {});
  for (const std::size_t n : {1u, 2u, 17u}) {
    const auto vertices = first_vertices(n);
    const ClusterBasis basis =
        find_basis(rows, sketch, vertices, 40, prior_lightings(transport.layout()));
    EXPECT_LE(basis.count, n);
    const Eigen::MatrixXd x = matrix_of(rows, vertices, basis.channels);
    // n vectors in float, each rounded by 2^-24 of itself.
    EXPECT_LE(left_by(x, basis), static_cast<double>(n) * 0x1p-23 * x.norm());
    // What they show is X times the light.
    const auto& lightings = prior_lightings(transport.layout());
    const std::size_t parts = rows.point_size(basis.channels) / 96;
    ASSERT_EQ(basis.exact.size(), lightings.size() * n * parts);
    for (std::size_t l = 0; l < lightings.size(); ++l) {
      for (std::size_t v = 0; v < n; ++v) {
        for (std::size_t p = 0; p < parts; ++p) {
          double right = 0, size = 0;
          for (std::size_t j = 0; j < 96; ++j) {
            const double part =
                x(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(p * 96 + j)) *
                static_cast<double>(lightings[l][j]);
            right += part;
            size += std::abs(part);
          }
          EXPECT_NEAR(basis.exact[(l * n + v) * parts + p], right, 100 * 0x1p-24 * size);
        }
      }
    }
  }
}

TEST(ClusterBasis, OfManyVerticesIsNearlyTheBest) {
  // More than 256 vertices: by way of the sketch.
  const Transport transport = build(fixtures::smooth_transport(8, 700, 1, false));
  const VertexRows rows(transport);
  const Sketch sketch = sketch_rows(rows, 128, 1, {});
  const auto vertices = first_vertices(600);
  const Eigen::MatrixXd x = matrix_of(rows, vertices, 1);
  const Eigen::BDCSVD<Eigen::MatrixXd> svd(x);
  for (const std::size_t count : {4u, 12u}) {
    const ClusterBasis basis = find_basis(rows, sketch, vertices, count, {});
    ASSERT_EQ(basis.count, count);
    const double tail = svd.singularValues()
                            .tail(svd.singularValues().size() - static_cast<Eigen::Index>(count))
                            .norm();
    // Halko and others 2011, theorem 10.5: with 16 + count more samples than vectors the expected
    // excess is sqrt(1 + count / (15 + count)) - 1 before the best vectors in the range are taken;
    // what falls as fast as this does is far better.
    EXPECT_GE(left_by(x, basis), tail * (1 - 1e-6));
    EXPECT_LE(left_by(x, basis), 1.05 * tail);
  }
}

}  // namespace
}  // namespace haarlight
