// SPDX-License-Identifier: Apache-2.0
#include "tests/support/dense_base_filter.hpp"

#include <Eigen/Dense>

namespace polygmap::test {
namespace {

int contact(std::size_t c) { return 6 + 3 * static_cast<int>(c); }

}  // namespace

void DenseBaseFilter::initialise(const BaseFilter& other) {
  x_ = Eigen::VectorXd::Zero(kStates);
  P_ = Eigen::MatrixXd::Zero(kStates, kStates);
  x_.segment<3>(0) = other.odom_p_base_m();
  x_.segment<3>(3) = other.odom_v_base_mps();
  for (std::size_t c = 0; c < kContactCount; ++c) x_.segment<3>(contact(c)) = other.odom_p_contact_m(c);
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < AxisFilter::kStates; ++i) {
      P_(3 * i + axis, 3 * i + axis) = other.axis(static_cast<std::size_t>(axis)).covariance()(i, i);
    }
  }
}

void DenseBaseFilter::predict(const Vec3& u, double dt, const Vec2& base_process, const ContactRows& rows) {
  Eigen::MatrixXd A = Eigen::MatrixXd::Identity(kStates, kStates);
  A.block<3, 3>(0, 3) = dt * Mat3::Identity();
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(kStates, 3);
  B.block<3, 3>(0, 0) = 0.5 * dt * dt * Mat3::Identity();
  B.block<3, 3>(3, 0) = dt * Mat3::Identity();
  Eigen::VectorXd Q(kStates);
  Q.segment<3>(0).setConstant(base_process[0]);
  Q.segment<3>(3).setConstant(base_process[1]);
  for (std::size_t c = 0; c < kContactCount; ++c) Q.segment<3>(contact(c)) = rows[c].process_m2;
  x_ = A * x_ + B * u;
  P_ = A * P_ * A.transpose() + Eigen::MatrixXd(Q.asDiagonal());
}

void DenseBaseFilter::correct(const ContactRows& rows) {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(kRows, kStates);
  Eigen::VectorXd y(kRows), R(kRows);
  for (std::size_t c = 0; c < kContactCount; ++c) {
    const int p = 3 * static_cast<int>(c), v = 24 + p, h = 48 + static_cast<int>(c);
    H.block<3, 3>(p, contact(c)) = Mat3::Identity();
    H.block<3, 3>(p, 0) = -Mat3::Identity();
    y.segment<3>(p) = rows[c].odom_r_contact_m;
    R.segment<3>(p).setConstant(rows[c].position_m2);
    H.block<3, 3>(v, 3) = -Mat3::Identity();
    y.segment<3>(v) = rows[c].odom_dr_contact_mps;
    R.segment<3>(v).setConstant(rows[c].velocity_m2ps2);
    const bool known = rows[c].height_m2 >= 0.0;  // an unknown height is a row without information
    H(h, contact(c) + 2) = known ? 1.0 : 0.0;
    y[h] = known ? rows[c].height_m : 0.0;
    R[h] = known ? rows[c].height_m2 : 1.0;
  }
  const Eigen::MatrixXd S = H * P_ * H.transpose() + Eigen::MatrixXd(R.asDiagonal());
  const Eigen::MatrixXd K = S.ldlt().solve(H * P_).transpose();
  x_ += K * (y - H * x_);
  const Eigen::MatrixXd J = Eigen::MatrixXd::Identity(kStates, kStates) - K * H;
  P_ = J * P_ * J.transpose() + K * R.asDiagonal() * K.transpose();
}

Vec3 DenseBaseFilter::position_m() const { return x_.segment<3>(0); }
Vec3 DenseBaseFilter::velocity_mps() const { return x_.segment<3>(3); }
Vec3 DenseBaseFilter::contact_m(std::size_t c) const { return x_.segment<3>(contact(c)); }

}  // namespace polygmap::test
