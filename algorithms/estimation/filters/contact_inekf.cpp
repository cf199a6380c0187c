// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/filters/contact_inekf.hpp"

#include <algorithm>
#include <utility>

#include "algorithms/geometry/so3.hpp"

namespace polygmap {
namespace {

void symmetrise(auto&& P) noexcept {
  for (int j = 0; j < P.cols(); ++j) {
    for (int i = 0; i < j; ++i) P(i, j) = P(j, i) = 0.5 * (P(i, j) + P(j, i));
  }
}

int of_foot(int first, std::size_t foot) noexcept { return first + 3 * static_cast<int>(foot); }

}  // namespace

void ContactInEkf::reset(const Params& params) noexcept {
  // One by one: a whole one to copy from would not fit the stack.
  params_ = params;
  odom_R_base_.setIdentity();
  for (Vec3* const zero :
       {&odom_v_base_mps_, &odom_p_base_m_, &gyro_bias_radps_, &accel_bias_mps2_, &odom_a_base_mps2_}) {
    zero->setZero();
  }
  odom_p_contact_m_.fill(Vec3::Zero());
  innovation_m_.fill(Vec3::Zero());
  odom_R_foot_.fill(Mat3::Identity());
  odom_T_lidar_ = {};
  stance_ = {};
  P_.setZero();
  mean_innovation_ratio_ = -1.0;
  motion_ = {};
  imu_delay_s_ = 0.0;
  gravity_mps2_ = kGravity_mps2;
  rows_ = {};
  outliers_ = 0;
}

void ContactInEkf::initialise(const Start& start, const std::array<LegMeasurement, kFootCount>& legs,
                              const Vec3& gyro_radps, const Vec3& accel_mps2) noexcept {
  stance_.reset(params_.stance);
  innovation_m_.fill(Vec3::Zero());
  mean_innovation_ratio_ = -1.0;
  motion_ = {.accel_mps2 = accel_mps2};
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
  imu_delay_s_ = 0.0;
  odom_a_base_mps2_.setZero();
  // The start is true at its time, not at the time that the IMU tells of.
  const Vec3 turn_radps = -(odom_R_base_ * (gyro_radps - gyro_bias_radps_));
  Vector late = Vector::Zero();
  late.segment<3>(kAttitude) = turn_radps;
  late.segment<3>(kVelocity) =
      Vec3{0, 0, gravity_mps2_} - odom_R_base_ * (accel_mps2 - accel_bias_mps2_) + odom_v_base_mps_.cross(turn_radps);
  late.segment<3>(kPosition) = -odom_v_base_mps_;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    late.segment<3>(of_foot(kContact, foot)) = odom_p_contact_m_[foot].cross(turn_radps);
  }
  late[kImuDelay] = 1.0;
  late *= params_.imu_delay_start_sigma_s;
  for (int j = 0; j < kStates; ++j) P_.col(j) += late[j] * late;
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
  copy(of_foot(kContact, foot), kPosition, math::square(params_.foot_sigma_m));
  if (leg.sole_known) copy(of_foot(kSoleRotation, foot), kAttitude, math::square(params_.sole_sigma_rad));
}

void ContactInEkf::predict(const Vec3& gyro_radps, const Vec3& accel_mps2, double dt_s, Motion motion) noexcept {
  const Vec3 turn_rad = (gyro_radps - gyro_bias_radps_) * dt_s;
  const Vec3 force_mps2 = odom_R_base_ * so3_exp(0.5 * turn_rad) * (accel_mps2 - accel_bias_mps2_);
  const Vec3 odom_a_mps2 = force_mps2 - Vec3{0, 0, gravity_mps2_};
  const double share = dt_s / (params_.motion_s + dt_s);
  motion_.turn_rad2ps2 += share * ((turn_rad / dt_s).squaredNorm() - motion_.turn_rad2ps2);
  motion_.accel_m2ps4 += share * (odom_a_mps2.squaredNorm() - motion_.accel_m2ps4);
  odom_a_base_mps2_ += dt_s / (0.5 * params_.motion_s + dt_s) * (odom_a_mps2 - odom_a_base_mps2_);
  const double kept = math::exp(-dt_s / params_.imu_delay_memory_s);
  imu_delay_s_ *= kept;
  P_.row(kImuDelay) *= kept;
  P_.col(kImuDelay) *= kept;
  P_(kImuDelay, kImuDelay) += math::square(params_.imu_delay_sigma_s) * (1.0 - kept * kept);
  const double gyro_rad2ps = math::square(params_.gyro_noise_radprs) +
                             (motion == Motion::kUnfelt ? math::square(params_.lost_gyro_noise_radprs) : 0.0);
  motion_.accel_step_mps2 = accel_mps2 - std::exchange(motion_.accel_mps2, accel_mps2);
  const double accel_m2ps3 =
      math::square(params_.accel_noise_mpsrs) + math::square(params_.accel_noise_rs) * motion_.accel_m2ps4 +
      math::square(params_.accel_step_share) * motion_.accel_step_mps2.squaredNorm() / 3.0 * dt_s +
      (motion == Motion::kFelt ? 0.0 : math::square(params_.lost_accel_noise_mpsrs));
  predict_covariance(gyro_rad2ps, accel_m2ps3, dt_s);
  odom_p_base_m_ += dt_s * (odom_v_base_mps_ + 0.5 * dt_s * odom_a_mps2);
  odom_v_base_mps_ += dt_s * odom_a_mps2;
  odom_R_base_ = so3_renormalised(odom_R_base_ * so3_exp(turn_rad));
}

// F P F' and the noise. What F changes stands first: the rest of P changes only where it meets that.
void ContactInEkf::predict_covariance(double gyro_rad2ps, double accel_m2ps3, double dt_s) noexcept {
  constexpr int kRest = kStates - kMoving;
  const Mat3 R = odom_R_base_ * dt_s;
  const Mat3 gravity = skew(Vec3{0, 0, -gravity_mps2_ * dt_s});
  // By what a turn about odom's axes moves each of them; the attitude itself first.
  Eigen::Matrix<double, kMoving, 3> arms;
  arms << Mat3::Identity(), skew(odom_v_base_mps_), skew(odom_p_base_m_), skew(odom_p_contact_m_[0]),
      skew(odom_p_contact_m_[1]);

  const Eigen::Matrix<double, kStates, 3> turned = P_.middleCols<3>(kGyroBias).lazyProduct(R.transpose());
  P_.middleCols<3>(kPosition) += dt_s * P_.middleCols<3>(kVelocity);
  P_.middleCols<3>(kVelocity) += P_.middleCols<3>(kAttitude).lazyProduct(gravity.transpose()) -
                                 P_.middleCols<3>(kAccelBias).lazyProduct(R.transpose());
  P_.leftCols<kMoving>() -= turned.lazyProduct(arms.transpose());

  auto moving = P_.leftCols<kMoving>();
  const Eigen::Matrix<double, 3, kMoving> turned_rows = R.lazyProduct(moving.middleRows<3>(kGyroBias));
  moving.middleRows<3>(kPosition) += dt_s * moving.middleRows<3>(kVelocity);
  moving.middleRows<3>(kVelocity) +=
      gravity.lazyProduct(moving.middleRows<3>(kAttitude)) - R.lazyProduct(moving.middleRows<3>(kAccelBias));
  // The gyro's noise turns everything that is held in odom axes.
  moving.topRows<kMoving>() += arms.lazyProduct(gyro_rad2ps * dt_s * arms.transpose() - turned_rows);
  P_.topRightCorner<kMoving, kRest>() = P_.bottomLeftCorner<kRest, kMoving>().transpose();
  P_.diagonal().segment<3>(kVelocity).array() += accel_m2ps3 * dt_s;
  P_.diagonal().segment<3>(kGyroBias).array() += math::square(params_.gyro_bias_walk_radpsrs) * dt_s;
  P_.diagonal().segment<3>(kAccelBias).array() += math::square(params_.accel_bias_walk_mps2rs) * dt_s;
  symmetrise(moving.topRows<kMoving>());  // rows and columns round differently
}

void ContactInEkf::correct_by_feet(const LegHistory::Moment& legs, double legs_delay_s,
                                   const std::array<FootContact, kFootCount>& contacts, double dt_s) noexcept {
  rows_.position = rows_.sole = {};
  std::array<bool, kFootCount> stands{};
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    stands[foot] = contacts[foot].stands && !contacts[foot].landed;
    if (!stands[foot]) anchor(foot, legs.legs[foot]);
  }
  stance_.update(stands, dt_s);
  const double speed_m2ps2 = odom_v_base_mps_.squaredNorm() + math::square(params_.turn_lever_m) * motion_.turn_rad2ps2;
  // As many samples as there are in the time for which they err alike count as one.
  const double alike = std::max(2.0 * params_.foot_correlation_s / dt_s, 1.0);
  const double position_m2 = alike * math::square(params_.foot_sigma_m);
  const double sole_rad2 = alike * math::square(params_.sole_sigma_rad);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    if (!stands[foot]) continue;
    const bool sole_known = legs.legs[foot].sole_known;
    P_.diagonal().segment<3>(of_foot(kContact, foot)) +=
        dt_s * (stance_.contact_m2ps(foot, sole_known, speed_m2ps2) + Vec3::Constant(contacts[foot].walk_m2ps));
    if (sole_known) P_.diagonal().segment<3>(of_foot(kSoleRotation, foot)) += dt_s * stance_.sole_rad2ps(speed_m2ps2);
  }
  mean_innovation_ratio_ = -1.0;
  FeetBatch batch;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    if (!stands[foot]) continue;
    const LegMeasurement& leg = legs.legs[foot];
    const Vec3 odom_v_foot_mps = odom_R_base_ * legs.base_v_foot_mps[foot];
    const Vec3 off_m = odom_R_base_ * leg.base_T_sole.p_m - odom_v_foot_mps * (imu_delay_s_ - legs_delay_s) -
                       (odom_p_contact_m_[foot] - odom_p_base_m_);
    average_innovation(
        foot, take({of_foot(kContact, foot), kPosition, odom_v_foot_mps}, off_m, position_m2, batch, rows_.position),
        dt_s);
    if (!leg.sole_known) continue;
    const Vec3 off_rad = so3_log(odom_R_base_ * leg.base_T_sole.R * odom_R_foot_[foot].transpose());
    static_cast<void>(
        take({of_foot(kSoleRotation, foot), kAttitude, Vec3::Zero()}, off_rad, sole_rad2, batch, rows_.sole));
  }
  if (batch.rows() == 0) return;
  batch.shrink(P_);
  apply(batch.error());
}

void ContactInEkf::average_innovation(std::size_t foot, const Innovation& innovation, double dt_s) noexcept {
  constexpr double kWindow_s = 0.02;
  const double share = dt_s / (std::min(kWindow_s, stance_.age_s(foot) - dt_s) + dt_s);
  innovation_m_[foot] += share * (innovation.value - innovation_m_[foot]);
  const double expected_m2 = innovation.variance + math::square(params_.foot_sigma_m);
  const double ratio = innovation_m_[foot].squaredNorm() / (3.0 * expected_m2);
  mean_innovation_ratio_ = mean_innovation_ratio_ < 0.0 ? ratio : 0.5 * (mean_innovation_ratio_ + ratio);
}

ContactInEkf::Innovation ContactInEkf::take(const Difference& difference, const Vec3& innovation, double variance,
                                            FeetBatch& batch, NormalisedRows& rows) noexcept {
  const auto row = [&](int i) {
    return [plus = difference.plus + i, minus = difference.minus + i,
            delay = difference.per_delay[i]](const Vector& x) { return x[plus] - x[minus] + delay * x[kImuDelay]; };
  };
  std::array<Vector, 3> columns;
  Innovation left{Vec3::Zero(), 0.0};
  double ratio = 0.0;
  for (int i = 0; i < 3; ++i) {
    Vector& PHt = columns[static_cast<std::size_t>(i)];
    PHt = P_.col(difference.plus + i) - P_.col(difference.minus + i) + difference.per_delay[i] * P_.col(kImuDelay);
    batch.condition(PHt, row(i));
    const double of_state = std::max(row(i)(PHt), 0.0);
    left.value[i] = innovation[i] - row(i)(batch.error());
    left.variance += of_state / 3.0;
    ratio += math::square(left.value[i]) / (3.0 * std::max(of_state + variance, 1e-18));
  }
  rows.take(3.0 * ratio, 3);
  const double sigmas = math::sqrt(ratio) / params_.outlier_sigmas;
  if (sigmas > 1.0) {
    ++outliers_;
    variance *= math::square(sigmas);
  }
  const int before = batch.rows();
  for (int i = 0; i < 3; ++i) {
    Vector& PHt = columns[static_cast<std::size_t>(i)];
    batch.condition(PHt, row(i), before);
    batch.take(PHt, row(i), innovation[i], variance);
  }
  return left;
}

void ContactInEkf::correct_by_heights(const std::array<KnownHeight, kFootCount>& heights,
                                      const std::array<FootContact, kFootCount>& contacts, double dt_s) noexcept {
  rows_.height = {};
  RowBatch<kStates, kFootCount> batch;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    const KnownHeight& height = heights[foot];
    if (!(height.sigma_m > 0.0) || !contacts[foot].stands || contacts[foot].landed) continue;
    const int z = of_foot(kContact, foot) + 2;
    const Vec3& d_m = odom_p_contact_m_[foot];
    const auto row = [&](const Vector& e) {  // d_z = e_z + (e_R x d)_z
      return e[z] + d_m.y() * e[kAttitude] - d_m.x() * e[kAttitude + 1];
    };
    Vector PHt = P_.col(z) + d_m.y() * P_.col(kAttitude) - d_m.x() * P_.col(kAttitude + 1);
    batch.condition(PHt, row);
    const double innovation_m = height.odom_z_m - d_m.z();
    const double variance_m2 = math::square(height.sigma_m) * params_.height_correlation_s / dt_s;
    rows_.height.take(math::square(innovation_m - row(batch.error())) / (row(PHt) + variance_m2), 1);
    batch.take(PHt, row, innovation_m, variance_m2);
  }
  if (batch.rows() == 0) return;
  batch.shrink(P_);
  apply(batch.error());
}

void ContactInEkf::tie_lidar(const Transform& odom_T_base, const Transform& odom_T_lidar, double age_s,
                             const LidarSigmas& sigmas) noexcept {
  odom_T_lidar_ = odom_T_lidar;
  // e_R of its world is the heading's and the noise; with it, e_p = e_p of the base + p x (e_R of its world - e_R).
  const Vec3 noise_rad2{math::square(sigmas.world_tilt_rad), math::square(sigmas.world_tilt_rad),
                        math::square(sigmas.yaw_rad)};
  const Mat3 arm = skew(odom_T_base.p_m), noise = noise_rad2.asDiagonal();
  const Mat3 heading = Vec3{0, 0, 1}.asDiagonal(), tilt_arm = arm * Vec3{1, 1, 0}.asDiagonal();
  Eigen::Matrix<double, 6, kStates> rows;
  rows.topRows<3>() = heading.lazyProduct(P_.middleRows<3>(kAttitude));
  rows.bottomRows<3>() = P_.middleRows<3>(kPosition) - age_s * P_.middleRows<3>(kVelocity) -
                         tilt_arm.lazyProduct(P_.middleRows<3>(kAttitude));
  Eigen::Matrix<double, 6, 6> own;
  own.leftCols<3>() = rows.middleCols<3>(kAttitude).lazyProduct(heading);
  own.rightCols<3>() = rows.middleCols<3>(kPosition) - age_s * rows.middleCols<3>(kVelocity) -
                       rows.middleCols<3>(kAttitude).lazyProduct(tilt_arm.transpose());
  own.topLeftCorner<3, 3>() += noise;
  own.bottomLeftCorner<3, 3>() += arm * noise;
  own.topRightCorner<3, 3>() += (arm * noise).transpose();
  own.bottomRightCorner<3, 3>() += arm * noise * arm.transpose();
  own.diagonal().tail<3>().array() += math::square(sigmas.position_m);
  symmetrise(own);
  P_.middleRows<6>(kLidarRotation) = rows;
  P_.middleCols<6>(kLidarRotation) = rows.transpose();
  P_.block<6, 6>(kLidarRotation, kLidarRotation) = own;
}

void ContactInEkf::drift_lidar(double position_m2, double rotation_rad2) noexcept {
  P_.diagonal().segment<3>(kLidarPosition).array() += position_m2;
  P_(kLidarRotation + 2, kLidarRotation + 2) += rotation_rad2;
}

// What the pose says of the state, row by row: with right-invariant errors the base's and that world's enter alike.
double ContactInEkf::LidarRow::operator()(const Vector& x) const noexcept {
  if (index == kYawRow) return x[kAttitude + 2] - x[kLidarRotation + 2];
  return x[kPosition + index] - x[kLidarPosition + index] - age_s * x[kVelocity + index] +
         lever_m[0] * (x[kAttitude + turns[0]] - x[kLidarRotation + turns[0]]) +
         lever_m[1] * (x[kAttitude + turns[1]] - x[kLidarRotation + turns[1]]);
}

ContactInEkf::Vector ContactInEkf::LidarRow::times(const Covariance& P) const noexcept {
  if (index == kYawRow) return P.col(kAttitude + 2) - P.col(kLidarRotation + 2);
  return P.col(kPosition + index) - P.col(kLidarPosition + index) - age_s * P.col(kVelocity + index) +
         lever_m[0] * (P.col(kAttitude + turns[0]) - P.col(kLidarRotation + turns[0])) +
         lever_m[1] * (P.col(kAttitude + turns[1]) - P.col(kLidarRotation + turns[1]));
}

// Of -p x e the rows: x: z e_y - y e_z, and so on round.
ContactInEkf::LidarRow ContactInEkf::lidar_row(int index, const Vec3& p_m, double age_s) noexcept {
  if (index == kYawRow) return {.index = kYawRow};
  const int next = (index + 1) % 3, last = (index + 2) % 3;
  return {index, {next, last}, {p_m[last], -p_m[next]}, age_s};
}

ContactInEkf::LidarRows ContactInEkf::lidar_rows(const Transform& odom_T_base, const Transform& lidar_T_base,
                                                 double age_s, const LidarSigmas& sigmas) const noexcept {
  const Transform seen = odom_T_lidar_ * lidar_T_base;
  LidarRows rows;
  rows.innovation.head<3>() = seen.p_m - odom_T_base.p_m;
  rows.innovation[kYawRow] = math::wrap_angle(yaw_of(seen.R) - yaw_of(odom_T_base.R));
  for (int i = 0; i < 4; ++i) {
    const LidarRow row = lidar_row(i, odom_T_base.p_m, age_s);
    const double variance = row(row.times(P_)) + math::square(i == kYawRow ? sigmas.yaw_rad : sigmas.position_m);
    rows.ratio += math::square(rows.innovation[i]) / (4.0 * variance);
  }
  return rows;
}

void ContactInEkf::correct_by_lidar(const Transform& odom_T_base, const LidarRows& rows, double age_s,
                                    const LidarSigmas& sigmas) noexcept {
  RowBatch<kStates, 4> batch;
  for (int i = 0; i < 4; ++i) {
    const LidarRow row = lidar_row(i, odom_T_base.p_m, age_s);
    Vector PHt = row.times(P_);
    batch.condition(PHt, row);
    batch.take(PHt, row, rows.innovation[i], math::square(i == kYawRow ? sigmas.yaw_rad : sigmas.position_m));
  }
  batch.shrink(P_);
  apply(batch.error());
}

void ContactInEkf::apply(const Vector& error) noexcept {
  const Mat3 turn = so3_exp(error.segment<3>(kAttitude));
  odom_R_base_ = so3_renormalised(turn * odom_R_base_);
  odom_v_base_mps_ = turn * odom_v_base_mps_ + error.segment<3>(kVelocity);
  odom_p_base_m_ = turn * odom_p_base_m_ + error.segment<3>(kPosition);
  imu_delay_s_ += error[kImuDelay];
  gyro_bias_radps_ += error.segment<3>(kGyroBias);
  accel_bias_mps2_ += error.segment<3>(kAccelBias);
  const Mat3 lidar_turn = so3_exp(error.segment<3>(kLidarRotation));
  odom_T_lidar_ = {so3_renormalised(lidar_turn * odom_T_lidar_.R),
                   lidar_turn * odom_T_lidar_.p_m + error.segment<3>(kLidarPosition)};
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    odom_p_contact_m_[foot] = turn * odom_p_contact_m_[foot] + error.segment<3>(of_foot(kContact, foot));
    odom_R_foot_[foot] = so3_renormalised(so3_exp(error.segment<3>(of_foot(kSoleRotation, foot))) * odom_R_foot_[foot]);
  }
}

Eigen::Matrix<double, 9, 9> ContactInEkf::covariance() const noexcept {
  // d_p = e_p - p x e, and so for velocity.
  using Square = Eigen::Matrix<double, 9, 9>;
  const Mat3 p_arm = skew(odom_p_base_m_), v_arm = skew(odom_v_base_mps_);
  Square rows, P;
  rows.topRows<3>() = P_.block<3, 9>(kPosition, 0) - p_arm.lazyProduct(P_.block<3, 9>(kAttitude, 0));
  rows.middleRows<3>(3) = P_.block<3, 9>(kVelocity, 0) - v_arm.lazyProduct(P_.block<3, 9>(kAttitude, 0));
  rows.bottomRows<3>() = P_.block<3, 9>(kAttitude, 0);
  P.leftCols<3>() = rows.middleCols<3>(kPosition) + rows.middleCols<3>(kAttitude).lazyProduct(p_arm);  // skew' = -skew
  P.middleCols<3>(3) = rows.middleCols<3>(kVelocity) + rows.middleCols<3>(kAttitude).lazyProduct(v_arm);
  P.rightCols<3>() = rows.middleCols<3>(kAttitude);
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
