// SPDX-License-Identifier: Apache-2.0
// expect: a frame of [0-9]{5} bytes
#include <Eigen/Core>
using H = Eigen::Matrix<double, 56, 30>;
using P = Eigen::Matrix<double, 30, 30>;
void careless(const H& h, const P& p, Eigen::Matrix<double, 56, 56>& s) noexcept {
  s.noalias() = (h * p) * h.transpose();
}
