// The vectors of one cluster.

#include "cpca/cluster_basis.h"

#include <Eigen/Core>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "cpca/principal.h"

namespace haarlight {
namespace {

using Eigen::Index;
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Points =
    Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

constexpr std::size_t kDirect = 256;  // points at a time, and the most for a Gram matrix of them
constexpr Index kPanel = 512;         // dimensions at a time, in double

Points points_of(const std::vector<float>& values, std::size_t count, std::size_t size) {
  return {values.data(), static_cast<Index>(count), static_cast<Index>(size)};
}

// Calls body(first dimension, panel in double) over all dimensions.
template <typename Body>
void for_panels(const Points& points, const Body& body) {
  RowMatrix panel;
  for (Index first = 0; first < points.cols(); first += kPanel) {
    const Index count = std::min(kPanel, points.cols() - first);
    panel = points.middleCols(first, count).cast<double>();
    body(first, panel);
  }
}

Eigen::MatrixXd gram_of(const Points& points) {
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(points.rows(), points.rows());
  for_panels(points, [&](Index, const RowMatrix& panel) {
    gram.selfadjointView<Eigen::Lower>().rankUpdate(panel);
  });
  gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
  return gram;
}

Eigen::MatrixXd sketched(const Sketch& sketch, std::span<const std::uint32_t> vertices) {
  Eigen::MatrixXd y(static_cast<Index>(vertices.size()), static_cast<Index>(sketch.dims));
  for (Index i = 0; i < y.rows(); ++i) {
    const float* p = sketch.point(vertices[static_cast<std::size_t>(i)]);
    for (Index d = 0; d < y.cols(); ++d) y(i, d) = static_cast<double>(p[d]);
  }
  return y;
}

// The leading left singular vectors of the sketch, orthonormal.
RowMatrix range_of(const Sketch& sketch, std::span<const std::uint32_t> vertices, Index most) {
  const Eigen::MatrixXd y = sketched(sketch, vertices);
  const Principal right = principal_of_gram(y.transpose() * y, most);
  const Eigen::MatrixXd images = y * right.left;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(images);
  return qr.householderQ() * Eigen::MatrixXd::Identity(images.rows(), images.cols());
}

class BasisFinder {
 public:
  BasisFinder(const VertexRows& rows, std::span<const std::uint32_t> vertices,
              std::span<const std::vector<float>> lightings)
      : rows_(rows), vertices_(vertices), lightings_(lightings) {
    out_.channels = 1;
    for (const std::uint32_t v : vertices) {
      if (rows.is_rgb(v)) out_.channels = 3;
    }
    size_ = rows.point_size(out_.channels);
  }

  ClusterBasis direct(std::size_t most);
  ClusterBasis projected(const RowMatrix& range, std::size_t most);

 private:
  void light(std::size_t first, const std::vector<float>& values, std::size_t count);
  void set_vectors(const RowMatrix& vectors);

  const VertexRows& rows_;
  std::span<const std::uint32_t> vertices_;
  std::span<const std::vector<float>> lightings_;
  std::size_t size_ = 0;
  ClusterBasis out_;
};

// What points `first` and following show.
void BasisFinder::light(std::size_t first, const std::vector<float>& values, std::size_t count) {
  const auto columns = static_cast<std::size_t>(rows_.transport().layout().size());
  const std::size_t parts = size_ / columns, n = vertices_.size();
  out_.exact.resize(lightings_.size() * n * parts);
  for (std::size_t l = 0; l < lightings_.size(); ++l) {
    const Eigen::Map<const Eigen::VectorXf> light(lightings_[l].data(),
                                                  static_cast<Index>(columns));
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t p = 0; p < parts; ++p) {
        const Eigen::Map<const Eigen::VectorXf> row(values.data() + i * size_ + p * columns,
                                                    static_cast<Index>(columns));
        out_.exact[(l * n + first + i) * parts + p] = row.dot(light);
      }
    }
  }
}

ClusterBasis BasisFinder::direct(std::size_t most) {
  const std::size_t n = vertices_.size();
  std::vector<float> values;
  rows_.read(vertices_, out_.channels, values);
  light(0, values, n);
  const Points points = points_of(values, n, size_);
  const Principal principal = principal_of_gram(gram_of(points), static_cast<Index>(most));
  out_.count = static_cast<std::size_t>(principal.sigma.size());
  const double root = std::sqrt(static_cast<double>(n));
  const Eigen::MatrixXd along = principal.left.transpose() / root;
  out_.vector.resize(out_.count * size_);
  for_panels(points, [&](Index first, const RowMatrix& panel) {
    const RowMatrix part = along * panel;
    for (Index i = 0; i < part.rows(); ++i) {
      float* to = out_.vector.data() + static_cast<std::size_t>(i) * size_ + first;
      for (Index j = 0; j < part.cols(); ++j) to[j] = static_cast<float>(part(i, j));
    }
  });
  for (Index i = 0; i < principal.left.cols(); ++i) {
    for (Index v = 0; v < principal.left.rows(); ++v) {
      out_.weight.push_back(root * principal.left(v, i));
    }
  }
  return std::move(out_);
}

ClusterBasis BasisFinder::projected(const RowMatrix& range, std::size_t most) {
  const std::size_t n = vertices_.size();
  RowMatrix images = RowMatrix::Zero(range.cols(), static_cast<Index>(size_));
  std::vector<float> values;
  for (std::size_t first = 0; first < n; first += kDirect) {
    const std::size_t count = std::min(kDirect, n - first);
    rows_.read(vertices_.subspan(first, count), out_.channels, values);
    light(first, values, count);
    const Eigen::MatrixXd along =
        range.middleRows(static_cast<Index>(first), static_cast<Index>(count)).transpose();
    for_panels(points_of(values, count, size_), [&](Index at, const RowMatrix& panel) {
      images.middleCols(at, panel.cols()) += along * panel;
    });
  }
  Eigen::MatrixXd gram = images * images.transpose();
  const Principal principal = principal_of_gram(gram, static_cast<Index>(most));
  out_.count = static_cast<std::size_t>(principal.sigma.size());
  const double root = std::sqrt(static_cast<double>(n));
  const RowMatrix vectors = principal.left.transpose() / root * images;
  out_.vector.resize(out_.count * size_);
  for (std::size_t i = 0; i < out_.vector.size(); ++i) {
    out_.vector[i] = static_cast<float>(vectors.data()[i]);
  }
  const RowMatrix weights = root * (range * principal.left).transpose();
  out_.weight.assign(weights.data(), weights.data() + weights.size());
  return std::move(out_);
}

}  // namespace

ClusterBasis find_basis(const VertexRows& rows, const Sketch& sketch,
                        std::span<const std::uint32_t> vertices, std::size_t most,
                        std::span<const std::vector<float>> lightings) {
  BasisFinder finder(rows, vertices, lightings);
  if (vertices.size() <= kDirect) return finder.direct(most);
  const auto wide = static_cast<Index>(std::min<std::size_t>(
      {2 * most + 16, static_cast<std::size_t>(sketch.dims), vertices.size()}));
  return finder.projected(range_of(sketch, vertices, wide), most);
}

std::vector<double> estimated_sizes(const Sketch& sketch, std::span<const std::uint32_t> vertices) {
  const Eigen::MatrixXd y = sketched(sketch, vertices);
  const bool tall = y.rows() > y.cols();
  const Principal principal = principal_of_gram(
      tall ? Eigen::MatrixXd(y.transpose() * y) : Eigen::MatrixXd(y * y.transpose()), y.cols());
  std::vector<double> sizes;
  for (const double s : principal.sigma) {
    sizes.push_back(s / std::sqrt(static_cast<double>(vertices.size())));
  }
  return sizes;
}

}  // namespace haarlight
