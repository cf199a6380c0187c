// SPDX-License-Identifier: Apache-2.0
// Three full forms of the filter of eqs (1)-(4), the oracles and the yardsticks of the module's three axis filters.
#pragma once

#include "tests/reference/base_filter/full_model.hpp"

namespace polygmap::reference {

// One update of 56 rows by Cholesky, in Joseph form. Q and R may be any covariances.
class DenseFilter {
 public:
  void initialise(const BaseFilter& axes) { take_over(axes, x_, P_); }
  void predict(const Vec3& accel_mps2, double dt_s, const FullStep& step);
  void correct(const FullStep& step);
  [[nodiscard]] const FullState& state() const { return x_; }
  [[nodiscard]] const FullCovariance& covariance() const { return P_; }

 private:
  FullState x_ = FullState::Zero();
  FullCovariance P_ = FullCovariance::Zero();
};

// Row after row. Rows whose noise is correlated are whitened first (R = L L^T; L^-1 y, L^-1 H), so this is the offline
// reference wherever Q or R couples the axes or the contacts, which three axis filters cannot hold.
class SequentialFilter {
 public:
  void initialise(const BaseFilter& axes) { take_over(axes, x_, P_); }
  void predict(const Vec3& accel_mps2, double dt_s, const FullStep& step);
  void correct(const FullStep& step);
  [[nodiscard]] const FullState& state() const { return x_; }
  [[nodiscard]] const FullCovariance& covariance() const { return P_; }

 private:
  void correct_row(const FullRow& row, double measurement, double variance);
  void correct_known_rows(const FullStep& step);
  void correct_whitened(const FullStep& step);

  FullState x_ = FullState::Zero();
  FullCovariance P_ = FullCovariance::Zero();
};

// As one would write it first: matrices of any size on the heap, the innovation's covariance solved twice by LU. It
// does not know of rows that say nothing: all 56 must be known.
class DynamicFilter {
 public:
  void initialise(const BaseFilter& axes);
  void predict(const Vec3& accel_mps2, double dt_s, const FullStep& step);
  void correct(const FullStep& step);
  [[nodiscard]] const Eigen::VectorXd& state() const { return x_; }

 private:
  Eigen::VectorXd x_;
  Eigen::MatrixXd P_, H_;
};

}  // namespace polygmap::reference
