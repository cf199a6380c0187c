// SPDX-License-Identifier: Apache-2.0
#include "tests/reference/base_filter/full_model.hpp"

namespace polygmap::reference {

int contact_state(std::size_t contact) noexcept { return 6 + 3 * static_cast<int>(contact); }

FullCovariance transition(double dt_s) noexcept {
  FullCovariance A = FullCovariance::Identity();
  A.block<3, 3>(0, 3) = dt_s * Mat3::Identity();
  return A;
}

Eigen::Matrix<double, kFullStates, 3> input(double dt_s) noexcept {
  Eigen::Matrix<double, kFullStates, 3> B = Eigen::Matrix<double, kFullStates, 3>::Zero();
  B.block<3, 3>(0, 0) = 0.5 * dt_s * dt_s * Mat3::Identity();
  B.block<3, 3>(3, 0) = dt_s * Mat3::Identity();
  return B;
}

FullObservation observation() noexcept {
  FullObservation H = FullObservation::Zero();
  for (std::size_t c = 0; c < kContactCount; ++c) {
    const int i = static_cast<int>(c);
    H.block<3, 3>(3 * i, contact_state(c)) = Mat3::Identity();
    H.block<3, 3>(3 * i, 0) = -Mat3::Identity();
    H.block<3, 3>(24 + 3 * i, 3) = -Mat3::Identity();  // a standing contact moves against the base
    H(48 + i, contact_state(c) + 2) = 1.0;
  }
  return H;
}

FullStep full_step(const Vec2& base_process, const ContactRows& rows) {
  FullStep step{FullCovariance::Zero(), FullMeasurements::Zero(), FullNoise::Zero(), {}};
  step.known.set();
  step.Q.diagonal().segment<3>(0).setConstant(base_process[0]);
  step.Q.diagonal().segment<3>(3).setConstant(base_process[1]);
  for (std::size_t c = 0; c < kContactCount; ++c) {
    const int p = 3 * static_cast<int>(c), v = 24 + p, h = 48 + static_cast<int>(c);
    step.Q.diagonal().segment<3>(contact_state(c)) = rows[c].process_m2;
    step.y.segment<3>(p) = rows[c].odom_r_contact_m;
    step.R.diagonal().segment<3>(p).setConstant(rows[c].position_m2);
    step.y.segment<3>(v) = rows[c].odom_dr_contact_mps;
    step.R.diagonal().segment<3>(v).setConstant(rows[c].velocity_m2ps2);
    step.y[h] = rows[c].height_m;
    step.R(h, h) = rows[c].height_m2;
    step.known[static_cast<std::size_t>(h)] = rows[c].height_m2 >= 0.0;
  }
  return step;
}

void take_over(const BaseFilter& axes, FullState& x, FullCovariance& P) {
  x.segment<3>(0) = axes.odom_p_base_m();
  x.segment<3>(3) = axes.odom_v_base_mps();
  for (std::size_t c = 0; c < kContactCount; ++c) x.segment<3>(contact_state(c)) = axes.odom_p_contact_m(c);
  P.setZero();
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < AxisFilter::kStates; ++i) {
      P(3 * i + axis, 3 * i + axis) = axes.axis(static_cast<std::size_t>(axis)).covariance()(i, i);
    }
  }
}

}  // namespace polygmap::reference
