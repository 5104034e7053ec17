// Principal vectors of a set of points, without their mean taken off (Overbeck 2006, Eq. 8, has
// none): the best linear basis of each length, and how points are put together from it.

#pragma once

#include <Eigen/Core>

namespace haarlight {

/// n points in d dimensions as columns of an n x d matrix X = U diag(sigma) V^T.
struct Principal {
  Eigen::VectorXd sigma;  ///< falling; those that matter: > max(n, d) 2^-52 sigma_0
  Eigen::MatrixXd left;   ///< U, n x sigma.size()
};

/// From the n x n Gram matrix X X^T, in double: singular values below 2^-26 sigma_0 are noise and
/// left out, so that what a basis leaves out is at most n 2^-26 sigma_0; nothing is divided by a
/// singular value. At most `most` vectors. Zero points have no vectors.
Principal principal_of_gram(const Eigen::MatrixXd& gram, Eigen::Index most);

}  // namespace haarlight
