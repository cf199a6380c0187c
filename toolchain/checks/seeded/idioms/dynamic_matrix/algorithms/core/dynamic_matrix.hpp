// SPDX-License-Identifier: Apache-2.0
// expect: 'MatrixXd'
#pragma once
inline int f(const Eigen::MatrixXd& m) noexcept { return int(m.rows()); }
