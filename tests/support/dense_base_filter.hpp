// SPDX-License-Identifier: Apache-2.0
// Eqs (1)-(4) as printed: one filter of 30 states and 56 rows, dense, in Joseph form. The oracle of the axis filters.
#pragma once

#include <Eigen/Core>

#include "algorithms/estimation/base_filter.hpp"

namespace polygmap::test {

class DenseBaseFilter {
 public:
  static constexpr int kStates = 30, kRows = 56;

  void initialise(const BaseFilter& other);
  void predict(const Vec3& u, double dt, const Vec2& base_process, const ContactRows& rows);
  void correct(const ContactRows& rows);

  [[nodiscard]] Vec3 position_m() const;
  [[nodiscard]] Vec3 velocity_mps() const;
  [[nodiscard]] Vec3 contact_m(std::size_t c) const;
  [[nodiscard]] const Eigen::MatrixXd& covariance() const { return P_; }

 private:
  Eigen::VectorXd x_;
  Eigen::MatrixXd P_;
};

}  // namespace polygmap::test
