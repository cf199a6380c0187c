// SPDX-License-Identifier: Apache-2.0
// expect: 'atan2': the C library's, with other bits on another target.*wanted by Eigen::internal::direct_selfadjoint_eigenvalues
#include <Eigen/Eigenvalues>
void careless(const Eigen::Matrix3d& m, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>& out) noexcept { out.computeDirect(m); }
