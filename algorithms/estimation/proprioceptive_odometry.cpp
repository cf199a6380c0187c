// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/proprioceptive_odometry.hpp"

#include <algorithm>
#include <utility>

namespace polygmap {
namespace {

constexpr int kVelocity = 3, kYaw = 8;  // in the covariance

// Of x, y, z besides what the heading does, and of yaw.
LioUncertainty::Quantities fusion_variances(const Eigen::Matrix<double, 9, 9>& P) noexcept {
  LioUncertainty::Quantities v;
  v.head<3>() = P.diagonal().head<3>() - P.col(kYaw).head<3>().cwiseAbs2() / P(kYaw, kYaw);
  v[3] = P(kYaw, kYaw);
  return v;
}

}  // namespace

void ProprioceptiveOdometry::reset(const Params& params, const RobotModel& robot) noexcept {
  params_ = params;
  attitude_.reset(params.attitude);
  base_.reset(params.base, robot.sole);
  motion_.reset(params.motion);
  fusion_.reset(params.fusion, robot.mounts.base_T_lidar);
  contacts_ = {};
  odom_p_foot_m_.fill(Vec3::Zero());
  since_legs_s_ = unrested_s_ = 0.0;
  feet_lost_ = false;
  base_w_base_radps_.setZero();
  covariance_.setZero();
  innovations_ = {};
}

void ProprioceptiveOdometry::initialise(const ContactInEkf::Start& start, bool guess, const Legs& legs,
                                        double dt_s) noexcept {
  attitude_.initialise(start, legs);
  covariance_ = attitude_.covariance();
  fusion_.begin(fusion_variances(covariance_));
  base_filtered_ = !guess && legs[0].sole_known && legs[1].sole_known;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) odom_p_foot_m_[foot] = odom_p_foot_m(legs[foot]);
  motion_.reset(params_.motion);
  since_legs_s_ = unrested_s_ = 0.0;
  feet_lost_ = false;
  innovations_ = {};
  // Feet not yet standing: the contacts begin where kinematics has them.
  base_.initialise(start.odom_p_base_m, start.odom_v_base_mps,
                   base_.make_rows(start.odom_R_base, Vec3::Zero(), legs, {}, {}, {}, dt_s));
}

bool ProprioceptiveOdometry::is_valid_imu(const Vec3& gyro_radps, const Vec3& accel_mps2) const noexcept {
  return math::all_finite(gyro_radps) && math::all_finite(accel_mps2) &&
         gyro_radps.cwiseAbs().maxCoeff() <= params_.max_rate_radps &&
         accel_mps2.cwiseAbs().maxCoeff() <= params_.max_accel_mps2;
}

void ProprioceptiveOdometry::bridge(double gap_s) noexcept {
  constexpr int kParts = 4;  // enough for position to gain from velocity's growing variance
  const double part_s = gap_s / kParts;
  const double slowing_ps = (1.0 - math::exp(-part_s / params_.coast_s)) / part_s;
  for (int i = 0; i < kParts; ++i) {
    const Vec3 odom_a_mps2 = -slowing_ps * attitude_.odom_v_base_mps();
    const Vec3 felt_mps2 = attitude_.odom_R_base().transpose() * (odom_a_mps2 + Vec3{0, 0, attitude_.gravity_mps2()});
    attitude_.predict(attitude_.gyro_bias_radps(), attitude_.accel_bias_mps2() + felt_mps2, part_s,
                      ContactInEkf::Motion::kUnfelt);
    if (base_filtered_) base_.predict(-slowing_ps * base_.odom_v_base_mps(), part_s, {});
  }
  feet_lost_ = true;
}

void ProprioceptiveOdometry::step(const Step& whole, const Legs& legs, const Contacts& contacts,
                                  const Ground& ground) noexcept {
  const Vec3 before_m = odom_p_base_m();
  Step step = whole;
  if (whole.dt_s > params_.max_step_s) {  // the last of it is felt
    step.dt_s = params_.gap_end_s;
    bridge(std::min(whole.dt_s, params_.max_gap_s) - step.dt_s);
  }
  const Vec3 gyro_radps = step.felt ? step.gyro_radps : attitude_.gyro_bias_radps();
  // A silent IMU: as if it felt no acceleration.
  const Vec3 rest_mps2 =
      attitude_.accel_bias_mps2() + attitude_.odom_R_base().transpose() * Vec3{0, 0, attitude_.gravity_mps2()};
  const Vec3 accel_mps2 = step.felt ? step.accel_mps2 : rest_mps2;
  const auto motion = !step.felt                     ? ContactInEkf::Motion::kUnfelt
                      : unrested_s_ > params_.lost_s ? ContactInEkf::Motion::kVelocityLost
                                                     : ContactInEkf::Motion::kFelt;
  attitude_.predict(gyro_radps, accel_mps2, step.dt_s, motion, step.imu_noise);
  since_legs_s_ += step.dt_s;
  contacts_ = contacts;
  const bool feet_lost = feet_lost_;
  if (step.new_legs) take_legs(legs);
  base_w_base_radps_ = gyro_radps - attitude_.gyro_bias_radps();
  if (base_filtered_) {
    const Mat3& odom_R_base = attitude_.odom_R_base();
    Contacts known = contacts_;
    if (feet_lost) {  // where they stand is anyone's guess
      for (FootContact& contact : known) contact.stands = false;
    }
    const ContactRows rows =
        base_.make_rows(odom_R_base, base_w_base_radps_, legs, known, ground.touch_downs, ground.heights, step.dt_s);
    const Vec3 odom_a_base_mps2 =
        odom_R_base * (accel_mps2 - attitude_.accel_bias_mps2()) - Vec3{0, 0, attitude_.gravity_mps2()};
    base_.predict(step.felt ? odom_a_base_mps2 : Vec3::Zero(), step.dt_s, rows);
    if (step.new_legs) base_.correct(rows);
  }
  count_innovations(step);
  covariance_ = attitude_.covariance();
  fusion_.follow(fusion_variances(covariance_));
  fusion_.tick({attitude_.odom_R_base(), odom_p_base_m()}, odom_p_base_m() - before_m, whole.dt_s);
}

void ProprioceptiveOdometry::take_legs(const Legs& legs) noexcept {
  const double velocity_sigma_mps = attitude_.velocity_sigma_mps();
  const bool feet_lost = std::exchange(feet_lost_, false);
  bool stands = false, rests = false;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {
    FootContact& contact = contacts_[foot];
    if (feet_lost) {
      motion_.rest(foot);
      contact.landed = contact.stands;
    } else {
      motion_.update(foot, odom_p_foot_m(legs[foot]) - odom_p_foot_m_[foot], velocity_sigma_mps, contact.stands,
                     since_legs_s_);
    }
    // Where force says when a sole landed and kinematics where, its swing is no reason to let go of it.
    if (!contact.stands || contact.landed) motion_.rest(foot);
    const double doubt = std::max(params_.sure_contact / std::max(contact.probability, 0.01) - 1.0, 0.0);
    contact.walk_m2ps = motion_.walk_m2ps(foot) + params_.doubtful_walk_m2ps * doubt;
    stands = stands || contact.stands;
    rests = rests || (contact.stands && motion_.walk_m2ps(foot) <= 0.0);
  }
  unrested_s_ = stands && !rests ? unrested_s_ + since_legs_s_ : 0.0;
  attitude_.correct_by_feet(legs, contacts_, since_legs_s_);
  for (std::size_t foot = 0; foot < kFootCount; ++foot) odom_p_foot_m_[foot] = odom_p_foot_m(legs[foot]);
  since_legs_s_ = 0.0;
}

void ProprioceptiveOdometry::count_innovations(const Step& step) noexcept {
  if (!step.new_legs) return;
  const auto take = [&](MeasurementGroup group, const NormalisedRows& rows) {
    innovations_[static_cast<std::size_t>(group)].take(rows, step.stamp_ns);
  };
  take(MeasurementGroup::kFootPosition, attitude_.position_rows());
  take(MeasurementGroup::kSoleAttitude, attitude_.sole_rows());
  if (!base_filtered_) return;
  take(MeasurementGroup::kFootVelocity, base_.velocity_rows());
  take(MeasurementGroup::kTreadHeight, base_.height_rows());
}

// Of the velocity that is published; the attitude filter's own is the least that any can have.
Vec3 ProprioceptiveOdometry::velocity_sigma_mps() const noexcept {
  Vec3 sigma_mps = covariance_.diagonal().segment<3>(kVelocity).cwiseSqrt();
  for (int i = 0; i < 3 && base_filtered_; ++i) {
    sigma_mps[i] = std::max(sigma_mps[i], base_.axis(static_cast<std::size_t>(i)).velocity_sigma_mps());
  }
  return sigma_mps;
}

void ProprioceptiveOdometry::describe(std::int64_t now_ns, StateEstimate& state) const noexcept {
  state.odom_T_base = {attitude_.odom_R_base(), odom_p_base_m()};
  state.odom_v_base_mps = base_filtered_ ? base_.odom_v_base_mps() : attitude_.odom_v_base_mps();
  state.base_w_base_radps = base_w_base_radps_;
  state.world_T_odom = fusion_.world_T_odom();
  state.position_sigma_m = fusion_.position_sigma_m();
  state.odom_sigma_m = math::sqrt(covariance_.diagonal().head<3>().maxCoeff());
  state.velocity_sigma_mps = velocity_sigma_mps();
  state.yaw_sigma_rad = fusion_.yaw_sigma_rad();
  state.tilt_sigma_rad = attitude_.tilt_sigma_rad();
  state.lio_age_ns = fusion_.last_accepted_ns() < 0 ? -1 : now_ns - fusion_.last_accepted_ns();
  for (std::size_t foot = 0; foot < kFootCount; ++foot) state.contact_probability[foot] = contacts_[foot].probability;
}

// The attitude filter's correlations, with the fusion's sigmas for what LIO corrects and those of the published
// velocity.
void ProprioceptiveOdometry::describe(std::int64_t now_ns, EstimateQuality& quality) const noexcept {
  quality.stamp_ns = now_ns;
  Eigen::Matrix<double, 9, 1> scale = Eigen::Matrix<double, 9, 1>::Ones();
  const Vec3 velocity_sigma = velocity_sigma_mps();
  for (int i = 0; i < 3; ++i) {
    scale[i] = fusion_.position_sigma_m()[i] / math::sqrt(covariance_(i, i));
    scale[kVelocity + i] = velocity_sigma[i] / math::sqrt(covariance_(kVelocity + i, kVelocity + i));
  }
  scale[kYaw] = fusion_.yaw_sigma_rad() / math::sqrt(covariance_(kYaw, kYaw));
  for (int j = 0; j < 9; ++j) {
    for (int i = 0; i < 9; ++i) quality.covariance(i, j) = scale[i] * scale[j] * covariance_(i, j);
  }
  quality.innovations = innovations_;
  quality.innovations[static_cast<std::size_t>(MeasurementGroup::kLioPosition)] = fusion_.innovations().position;
  quality.innovations[static_cast<std::size_t>(MeasurementGroup::kLioYaw)] = fusion_.innovations().yaw;
  quality.outliers = attitude_.outliers();
}

}  // namespace polygmap
