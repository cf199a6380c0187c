// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/force_inference.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

namespace polygmap {

void ForceInference::reset(const Params& params) noexcept {
  *this = ForceInference{};
  params_ = params;
}

std::array<double, kFootCount> ForceInference::update(const LegGeometry& geometry, const JointFeedback& joints,
                                                      const Vec3& base_up) noexcept {
  const double dt_s = stamp_ns_ < 0 ? 0.0 : seconds(joints.stamp_ns - stamp_ns_);
  const double share = stamp_ns_ < 0 ? 1.0 : dt_s / (params_.smoothing_s + dt_s);
  stamp_ns_ = joints.stamp_ns;
  std::array<double, kFootCount> upwards_n{};
  for (std::size_t i = 0; i < kFootCount; ++i) {
    const auto leg = static_cast<Foot>(i);
    const LegJacobian J = leg_jacobian(geometry, leg, leg_joints(joints.q_rad, leg));
    Eigen::Matrix<double, 6, 6> A = J * J.transpose();
    A.diagonal().array() += math::square(params_.damping_m);
    const Eigen::Matrix<double, 6, 1> wrench = -A.ldlt().solve(J * leg_joints(joints.tau_nm, leg));
    force_n_[i] += share * (wrench.head<3>().dot(base_up) - force_n_[i]);
    upwards_n[i] = force_n_[i] > params_.friction_n ? force_n_[i] : 0.0;
  }
  return upwards_n;
}

}  // namespace polygmap
