// Principal vectors of a set of points.

#include "cpca/principal.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace haarlight {

Principal principal_of_gram(const Eigen::MatrixXd& gram, Eigen::Index most) {
  Principal out;
  const Eigen::Index n = gram.rows();
  if (n == 0) return out;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram);
  const Eigen::VectorXd& value = solver.eigenvalues();  // rising
  const double largest = std::max(value[n - 1], 0.0);
  Eigen::Index count = 0;
  const double floor = static_cast<double>(n) * 0x1p-52 * largest;
  while (count < std::min(n, most) && value[n - 1 - count] > floor) ++count;
  out.sigma.resize(count);
  out.left.resize(n, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    out.sigma[i] = std::sqrt(value[n - 1 - i]);
    out.left.col(i) = solver.eigenvectors().col(n - 1 - i);
    // Signs are arbitrary: the largest entry is positive, so that bytes do not depend on the
    // solver.
    Eigen::Index at = 0;
    out.left.col(i).cwiseAbs().maxCoeff(&at);
    if (out.left(at, i) < 0) out.left.col(i) *= -1;
  }
  return out;
}

}  // namespace haarlight
