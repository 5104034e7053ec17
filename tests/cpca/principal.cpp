// Principal vectors from a Gram matrix against a singular value decomposition.

#include "cpca/principal.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>
#include <random>

namespace haarlight {
namespace {

Eigen::MatrixXd random_points(Eigen::Index n, Eigen::Index d, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd x(n, d);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < d; ++j) x(i, j) = normal(random);
  }
  return x;
}

TEST(Principal, ValuesAndSpacesAreThoseOfTheDecomposition) {
  // Sizes fall over four decades, past what a Gram matrix in float would keep (2.4e-4).
  Eigen::MatrixXd x = random_points(20, 60, 1);
  for (Eigen::Index j = 0; j < 60; ++j) x.col(j) *= std::pow(10, -static_cast<double>(j) / 15);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(x, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const Principal principal = principal_of_gram(x * x.transpose(), 20);
  ASSERT_EQ(principal.sigma.size(), 20);
  const double first = svd.singularValues()[0];
  for (Eigen::Index i = 0; i < 20; ++i) {
    // An eigenvalue is right to n 2^-52 sigma_0^2 and so sigma_i to that over 2 sigma_i.
    const double bound = 20 * 0x1p-52 * first * first / svd.singularValues()[i];
    EXPECT_NEAR(principal.sigma[i], svd.singularValues()[i], bound);
    Eigen::Index at = 0;
    principal.left.col(i).cwiseAbs().maxCoeff(&at);
    EXPECT_GT(principal.left(at, i), 0);
  }
  EXPECT_NEAR(
      (principal.left.transpose() * principal.left - Eigen::MatrixXd::Identity(20, 20)).norm(), 0,
      1e-13);
  // The product, never the factors: what 7 vectors leave is the tail.
  const Eigen::MatrixXd seven = principal.left.leftCols(7);
  const double left = (x - seven * (seven.transpose() * x)).norm();
  EXPECT_NEAR(left, svd.singularValues().tail(13).norm(), 1e-12 * first);
}

TEST(Principal, FewerDimensionsThanPointsLeaveNothing) {
  const Eigen::MatrixXd x = random_points(12, 3, 2) * random_points(3, 40, 3);
  const Principal principal = principal_of_gram(x * x.transpose(), 12);
  // Rank 3; eigenvalues that are rounding alone may pass the floor of n 2^-52 by a little, nothing
  // above it may be missing.
  ASSERT_GE(principal.sigma.size(), 3);
  EXPECT_LE(principal.sigma.size(), 5);
  const double left = (x - principal.left * (principal.left.transpose() * x)).norm() / x.norm();
  EXPECT_LE(left, 10 * 12 * 0x1p-53);
}

TEST(Principal, NothingHasNoVectors) {
  EXPECT_EQ(principal_of_gram(Eigen::MatrixXd::Zero(5, 5), 3).sigma.size(), 0);
  EXPECT_EQ(principal_of_gram(Eigen::MatrixXd(0, 0), 3).sigma.size(), 0);
  EXPECT_EQ(principal_of_gram(Eigen::MatrixXd::Identity(1, 1) * 4.0, 3).sigma[0], 2);
}

}  // namespace
}  // namespace haarlight
