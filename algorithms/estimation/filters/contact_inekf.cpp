// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/filters/contact_inekf.hpp"

#include <algorithm>
#include <utility>

#include "algorithms/geometry/so3.hpp"

namespace polygmap {
namespace {

template <typename Square>
void symmetrise(Square& P) noexcept {
  for (int j = 0; j < P.cols(); ++j) {
    for (int i = 0; i < j; ++i) P(i, j) = P(j, i) = 0.5 * (P(i, j) + P(j, i));
  }
}

int of_foot(int first, std::size_t foot) noexcept { return first + 3 * static_cast<int>(foot); }

}  // namespace

void ContactInEkf::reset(const Params& params) noexcept {
  *this = ContactInEkf{};
  params_ = params;
  contact_walk_mprs_ = params.contact_walk_mprs;
}

void ContactInEkf::initialise(const Start& start, const std::array<LegMeasurement, kFootCount>& legs) noexcept {
  whiteness_ = {};
  contact_walk_mprs_ = params_.contact_walk_mprs;
  pace_ = 1.0;
  walk_time_s_ = 0.0;
  odom_R_base_ = start.odom_R_base;
  odom_p_base_m_ = start.odom_p_base_m;
  odom_v_base_mps_ = start.odom_v_base_mps;
  gyro_bias_radps_ = start.gyro_bias_radps;
  accel_bias_mps2_ = start.accel_bias_mps2;
  gravity_mps2_ = start.gravity_mps2;
  P_.setZero();
  const Vec3 attitude_rad2 = Vec3{start.tilt_sigma_rad, start.tilt_sigma_rad, start.yaw_sigma_rad}.cwiseAbs2();
  P_.diagonal().segment<3>(kAttitude) = attitude_rad2;
  P_.diagonal().segment<3>(kVelocity).setConstant(math::square(start.velocity_sigma_mps));
  P_.diagonal().segment<3>(kPosition).setConstant(math::square(start.position_sigma_m));
  P_.diagonal().segment<3>(kGyroBias).setConstant(math::square(start.gyro_bias_sigma_radps));
  P_.diagonal().segment<3>(kAccelBias).setConstant(math::square(start.accel_bias_sigma_mps2));
  // Right-invariant errors of velocity and position hold the attitude's: e_v = dv + v x e.
  for (const auto& [index, value] : {std::pair{+kVelocity, odom_v_base_mps_}, std::pair{+kPosition, odom_p_base_m_}}) {
    const Mat3 lever = skew(value);
    P_.middleRows<3>(index) += lever * P_.middleRows<3>(kAttitude);
    P_.middleCols<3>(index) += P_.middleCols<3>(kAttitude) * lever.transpose();
  }
  for (std::size_t foot = 0; foot < kFootCount; ++foot) anchor(foot, legs[foot]);
}

void ContactInEkf::anchor(std::size_t foot, const LegMeasurement& leg) noexcept {
  odom_p_contact_m_[foot] = odom_p_base_m_ + odom_R_base_ * leg.base_T_sole.p_m;
  odom_R_foot_[foot] = odom_R_base_ * leg.base_T_sole.R;
  const auto copy = [&](int to, int from, double variance) {
    P_.middleRows<3>(to) = P_.middleRows<3>(from);
    P_.middleCols<3>(to) = P_.middleCols<3>(from);
    P_.block<3, 3>(to, to) = P_.block<3, 3>(from, from);
    P_.diagonal().segment<3>(to).array() += variance;
  };
  copy(of_foot(kContact, foot), kPosition, math::square(leg.position_sigma_m));
  if (leg.sole_known) copy(of_foot(kSoleRotation, foot), kAttitude, math::square(params_.foot_sigma_rad));
}

void ContactInEkf::predict(const Vec3& gyro_radps, const Vec3& accel_mps2, double dt_s, Motion motion,
                           const ImuNoiseDensity& noise) noexcept {
  const Vec3 turn_rad = (gyro_radps - gyro_bias_radps_) * dt_s;
  const double speed_mps = odom_v_base_mps_.norm() + params_.turn_lever_m * turn_rad.norm() / dt_s;
  pace_ = std::min(speed_mps / params_.full_walk_speed_mps, 1.0);
  const Vec3 force_mps2 = odom_R_base_ * so3_exp(0.5 * turn_rad) * (accel_mps2 - accel_bias_mps2_);
  const Vec3 odom_a_mps2 = force_mps2 - Vec3{0, 0, gravity_mps2_};
  const double dynamic_mpsrs = params_.dynamic_accel_share * odom_a_mps2.norm() * math::sqrt(dt_s);
  predict_covariance(std::max(params_.gyro_noise_radprs, noise.gyro_radprs) +
                         (motion == Motion::kUnfelt ? params_.lost_gyro_noise_radprs : 0.0),
                     std::max(params_.accel_noise_mpsrs, noise.accel_mpsrs) + dynamic_mpsrs +
                         (motion == Motion::kFelt ? 0.0 : params_.lost_accel_noise_mpsrs),
                     dt_s);
  odom_p_base_m_ += dt_s * (odom_v_base_mps_ + 0.5 * dt_s * odom_a_mps2);
  odom_v_base_mps_ += dt_s * odom_a_mps2;
  odom_R_base_ = so3_renormalised(odom_R_base_ * so3_exp(turn_rad));
}

void ContactInEkf::predict_covariance(double gyro_noise_radprs, double accel_noise_mpsrs, double dt_s) noexcept {
  const Mat3 R = odom_R_base_ * dt_s;
  const Mat3 gravity = skew(Vec3{0, 0, -gravity_mps2_ * dt_s});
  struct Turned {
    int index;
    Mat3 arm;
  };
  const std::array<Turned, 4> turned{{{kVelocity, skew(odom_v_base_mps_)},
                                      {kPosition, skew(odom_p_base_m_)},
                                      {kContact, skew(odom_p_contact_m_[0])},
                                      {kContact + 3, skew(odom_p_contact_m_[1])}}};
  // F P F', rows first: what a row takes from others it takes as they were before the step.
  Eigen::Matrix<double, 3, kStates> bias = R * P_.middleRows<3>(kGyroBias);
  P_.middleRows<3>(kPosition) += dt_s * P_.middleRows<3>(kVelocity);
  P_.middleRows<3>(kVelocity) += gravity * P_.middleRows<3>(kAttitude) - R * P_.middleRows<3>(kAccelBias);
  P_.middleRows<3>(kAttitude) -= bias;
  for (const Turned& t : turned) P_.middleRows<3>(t.index).noalias() -= t.arm * bias;
  Eigen::Matrix<double, kStates, 3> bias_t = P_.middleCols<3>(kGyroBias) * R.transpose();
  P_.middleCols<3>(kPosition) += dt_s * P_.middleCols<3>(kVelocity);
  P_.middleCols<3>(kVelocity) +=
      P_.middleCols<3>(kAttitude) * gravity.transpose() - P_.middleCols<3>(kAccelBias) * R.transpose();
  P_.middleCols<3>(kAttitude) -= bias_t;
  for (const Turned& t : turned) P_.middleCols<3>(t.index).noalias() -= bias_t * t.arm.transpose();

  // The gyro's noise turns everything that is held in odom axes.
  const double turn_rad2 = math::square(gyro_noise_radprs) * dt_s;
  P_.diagonal().segment<3>(kAttitude).array() += turn_rad2;
  for (const Turned& a : turned) {
    const Mat3 with_attitude = turn_rad2 * a.arm;
    P_.block<3, 3>(a.index, kAttitude) += with_attitude;
    P_.block<3, 3>(kAttitude, a.index) += with_attitude.transpose();
    for (const Turned& b : turned) P_.block<3, 3>(a.index, b.index) += with_attitude * b.arm.transpose();
  }
  P_.diagonal().segment<3>(kVelocity).array() += math::square(accel_noise_mpsrs) * dt_s;
  P_.diagonal().segment<3>(kGyroBias).array() += math::square(params_.gyro_bias_walk_radpsrs) * dt_s;
  P_.diagonal().segment<3>(kAccelBias).array() += math::square(params_.accel_bias_walk_mps2rs) * dt_s;
  symmetrise(P_);  // rows and columns round differently
}

void ContactInEkf::correct_by_feet(const std::array<LegMeasurement, kFootCount>& legs,
                                   const std::array<FootContact, kFootCount>& contacts, double dt_s) noexcept {
  position_rows_ = sole_rows_ = {};
  const double walk_mprs = std::max(pace_ * contact_walk_mprs_, params_.min_contact_walk_mprs);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    const LegMeasurement& leg = legs[foot];
    if (!contacts[foot].stands || contacts[foot].landed) {
      anchor(foot, leg);
      whiteness_[foot] = {};
      continue;
    }
    const double share = std::max(contacts[foot].load_share * contacts[foot].probability, params_.least_load_share);
    const int contact = of_foot(kContact, foot), sole = of_foot(kSoleRotation, foot);
    P_.diagonal().segment<3>(contact).array() += dt_s * (math::square(walk_mprs) / share + contacts[foot].walk_m2ps);
    const Vec3 off_m = odom_R_base_ * leg.base_T_sole.p_m - (odom_p_contact_m_[foot] - odom_p_base_m_);
    if (contacts[foot].walk_m2ps > 0.0) {
      whiteness_[foot] = {};
    } else {
      const double s_m2 = P_(contact, contact) + P_(kPosition, kPosition) - 2.0 * P_(contact, kPosition);
      measure_walk(foot, off_m, s_m2 + math::square(leg.position_sigma_m), dt_s);
    }
    correct(contact, kPosition, off_m, math::square(leg.position_sigma_m), position_rows_);
    if (!leg.sole_known) continue;
    P_.diagonal().segment<3>(sole).array() += dt_s * math::square(params_.foot_walk_radprs) / share;
    const Vec3 off_rad = so3_log(odom_R_base_ * leg.base_T_sole.R * odom_R_foot_[foot].transpose());
    correct(sole, kAttitude, off_rad, math::square(params_.foot_sigma_rad), sole_rows_);
  }
}

void ContactInEkf::correct(int plus, int minus, const Vec3& innovation, double variance,
                           NormalisedRows& rows) noexcept {
  double ratio = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double s = P_(plus + i, plus + i) + P_(minus + i, minus + i) - 2.0 * P_(plus + i, minus + i) + variance;
    if (s > 0.0) ratio += math::square(innovation[i]) / (3.0 * s);
  }
  rows.take(3.0 * ratio, 3);
  const double sigmas = math::sqrt(ratio) / params_.outlier_sigmas;
  if (sigmas > 1.0) {
    ++outliers_;
    variance *= math::square(sigmas);
  }
  Vector error = Vector::Zero();
  for (int i = 0; i < 3; ++i) {
    Vector PHt = P_.col(plus + i) - P_.col(minus + i);
    const double s = PHt[plus + i] - PHt[minus + i] + variance;
    if (!(s > 0.0)) continue;
    const double inverse_root = 1.0 / math::sqrt(s);
    PHt *= inverse_root;
    error += PHt * (inverse_root * (innovation[i] - (error[plus + i] - error[minus + i])));
    for (int j = 0; j < kStates; ++j) P_.col(j) -= PHt[j] * PHt;  // symmetric to the last bit
  }
  apply(error);
}

void ContactInEkf::measure_walk(std::size_t foot, const Vec3& innovation_m, double variance_m2, double dt_s) noexcept {
  Whiteness& w = whiteness_[foot];
  const double share = dt_s / (params_.whiteness_window_s + dt_s);
  w.mean_m += share * (innovation_m - w.mean_m);
  w.age_s += dt_s;
  if (w.age_s < params_.whiteness_window_s) return;
  const double white_m2 = 3.0 * variance_m2 * share / (2.0 - share);
  const double ratio = std::min(w.mean_m.squaredNorm() / white_m2, params_.whiteness_most_ratio);
  walk_time_s_ += dt_s;
  const double gain_ps =
      std::max(params_.whiteness_gain_ps, params_.whiteness_start_gain / (walk_time_s_ + params_.whiteness_window_s));
  contact_walk_mprs_ *= math::exp(gain_ps * dt_s * (ratio - 1.0));
  contact_walk_mprs_ = math::clamp(contact_walk_mprs_, params_.min_contact_walk_mprs, params_.max_contact_walk_mprs);
}

void ContactInEkf::apply(const Vector& error) noexcept {
  const Mat3 turn = so3_exp(error.segment<3>(kAttitude));
  odom_R_base_ = so3_renormalised(turn * odom_R_base_);
  odom_v_base_mps_ = turn * odom_v_base_mps_ + error.segment<3>(kVelocity);
  odom_p_base_m_ = turn * odom_p_base_m_ + error.segment<3>(kPosition);
  gyro_bias_radps_ += error.segment<3>(kGyroBias);
  accel_bias_mps2_ += error.segment<3>(kAccelBias);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    odom_p_contact_m_[foot] = turn * odom_p_contact_m_[foot] + error.segment<3>(of_foot(kContact, foot));
    odom_R_foot_[foot] = so3_renormalised(so3_exp(error.segment<3>(of_foot(kSoleRotation, foot))) * odom_R_foot_[foot]);
  }
}

Eigen::Matrix<double, 9, 9> ContactInEkf::covariance() const noexcept {
  // d_p = e_p - p x e, and so for velocity.
  using Square = Eigen::Matrix<double, 9, 9>;
  Square J = Square::Zero();
  J.block<3, 3>(0, 0) = -skew(odom_p_base_m_);
  J.block<3, 3>(0, 6).setIdentity();
  J.block<3, 3>(3, 0) = -skew(odom_v_base_mps_);
  J.block<3, 3>(3, 3).setIdentity();
  J.block<3, 3>(6, 0).setIdentity();
  // Products of this size would go through Eigen's blocking and its heap.
  const Square JP = J.lazyProduct(P_.topLeftCorner<9, 9>());
  Square P = JP.lazyProduct(J.transpose());
  symmetrise(P);
  return P;
}

double ContactInEkf::velocity_sigma_mps() const noexcept {
  const Mat3 J = skew(odom_v_base_mps_);
  const Mat3 cross = J * P_.block<3, 3>(kAttitude, kVelocity);
  const Mat3 P = P_.block<3, 3>(kVelocity, kVelocity) - cross - cross.transpose() +
                 J * P_.block<3, 3>(kAttitude, kAttitude) * J.transpose();
  return math::sqrt(std::max(P.diagonal().maxCoeff(), 0.0));
}

}  // namespace polygmap
