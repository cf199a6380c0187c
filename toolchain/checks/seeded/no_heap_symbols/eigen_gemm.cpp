// SPDX-License-Identifier: Apache-2.0
// expect: '__cxa_guard_acquire'.*triangular_solve_matrix
#include <Eigen/Cholesky>
using M = Eigen::Matrix<double, 56, 56>;
void careless(const M& a, Eigen::LLT<M>& llt, M& x) noexcept {
  llt.compute(a);
  llt.solveInPlace(x);
}
