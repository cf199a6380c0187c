// SPDX-License-Identifier: Apache-2.0
// expect: a trap, where Eigen would have gone to the heap, in careless
#include <Eigen/Core>
void careless(const Eigen::MatrixXd& a, Eigen::MatrixXd& b) noexcept { b = a + a; }
