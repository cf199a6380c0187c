// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/estimator.hpp"

#include <algorithm>
#include <utility>

namespace polygmap {

void Estimator::reset(const Params& params, const RobotModel& robot) noexcept {
  params_ = params;
  robot_ = &robot;
  counters_ = {};
  standstill_.reset(params.standstill);
  contacts_.reset(params.contacts);
  encoders_.reset(params.encoders);
  imu_noise_.reset();
  forces_.reset(params.forces);
  odometry_.reset(params, robot);
  ring_.clear();
  state_ = {};
  quality_ = {};
  imu_ = {};
  joints_ = {};
  new_imus_ = 0;
  new_joints_ = has_imu_ = has_joints_ = has_state_ = false;
  legs_ = {};
  ground_ = {};
  stood_ = {};
  initial_odom_T_base_ = {};
  initialised_ns_ = 0;
}

void Estimator::tick(const std::array<bool, kFootCount>& planned_stance) noexcept {
  ++counters_.ticks;
  const bool new_imu = std::exchange(new_imus_, 0U) > 0;
  const bool new_joints = std::exchange(new_joints_, false);
  if (!has_imu_ || !has_joints_) return;
  const std::int64_t now_ns = std::max(imu_.stamp_ns, joints_.stamp_ns);
  if (has_state_ && now_ns <= state_.stamp_ns) return;
  has_state_ = true;

  for (TouchDown& touch_down : ground_.touch_downs) touch_down.now = false;
  if (new_joints) take_joints(planned_stance);
  if (!state_.initialised) {
    if (new_imu && new_joints) calibrate();
    publish(now_ns);
    return;
  }

  const double dt_s = seconds(now_ns - state_.stamp_ns);
  if (dt_s > params_.max_step_s) ++counters_.gaps;
  // The last rates bridge a short silence of the IMU; beyond it the feet alone say how the base moves.
  const bool felt = seconds(now_ns - imu_.stamp_ns) <= params_.max_step_s;
  odometry_.step({now_ns, dt_s, imu_.gyro_radps, imu_.accel_mps2, felt, new_joints, imu_noise_.density()}, legs_,
                 contacts_.feet(), ground_);
  publish(now_ns);
  if (seconds(now_ns - state_.oldest_input_ns) <= params_.max_step_s) ring_.push(state_);
}

void Estimator::add_lio(const LioSample& sample, std::int64_t now_ns) noexcept {
  LioVerdict verdict = odometry_.fusion().check(sample, now_ns);
  if (verdict == LioVerdict::kAccepted) {
    // Until initialised the base has swayed by millimetres only; where it stood in odom is known from then on (rebase).
    StateEstimate then;
    bool known = standstill_.collecting() && sample.stamp_ns >= standstill_.start_ns();
    if (state_.initialised) {
      if (known && sample.stamp_ns < initialised_ns_) {
        then.odom_T_base = initial_odom_T_base_;
      } else {
        known = ring_.try_at(sample.stamp_ns, then);
      }
    }
    verdict = known ? odometry_.fusion().fuse(sample, then.odom_T_base) : LioVerdict::kNoOdometry;
  }
  ++counters_.lio[static_cast<std::size_t>(verdict)];
}

void Estimator::set_tread_height(Foot foot, double odom_z_m, double sigma_m) noexcept {
  KnownHeight& height = ground_.heights[index_of(foot)];
  height = {};
  if (!state_.initialised || !std::isfinite(odom_z_m) || !(sigma_m > 0.0 && sigma_m < 1.0)) {
    ++counters_.height_invalid;
  } else if (std::abs(odom_z_m - state_.odom_T_sole[index_of(foot)].p_m.z()) > params_.max_height_error_m) {
    ++counters_.height_rejected;
  } else {
    ++counters_.height_taken;
    height = {odom_z_m, sigma_m};
  }
}

void Estimator::add_imu(const ImuSample& imu, std::int64_t now_ns) noexcept {
  if (!odometry_.is_valid_imu(imu.gyro_radps, imu.accel_mps2)) {
    ++counters_.imu_invalid;
    return;
  }
  if (imu.stamp_ns > now_ns + params_.max_lead_ns) {  // taken, it would make every later sample a stale one
    ++counters_.imu_future;
    return;
  }
  if (has_imu_ && imu.stamp_ns <= imu_.stamp_ns) {
    ++counters_.imu_stale;
    return;
  }
  imu_noise_.update(imu.stamp_ns, imu.gyro_radps, imu.accel_mps2);
  const Vec3 gyro_radps = imu_.gyro_radps, accel_mps2 = imu_.accel_mps2;
  imu_ = imu;
  imu_.gyro_radps = robot_->mounts.base_R_imu * imu.gyro_radps;
  imu_.accel_mps2 = robot_->mounts.base_R_imu * imu.accel_mps2;
  if (++new_imus_ > 1) {  // samples come evenly
    const double share = 1.0 / new_imus_;
    imu_.gyro_radps = gyro_radps + share * (imu_.gyro_radps - gyro_radps);
    imu_.accel_mps2 = accel_mps2 + share * (imu_.accel_mps2 - accel_mps2);
  }
  has_imu_ = true;
}

void Estimator::add_joints(const JointFeedback& joints, std::int64_t now_ns) noexcept {
  bool good = math::all_finite(joints.q_rad) && math::all_finite(joints.dq_radps) &&
              joints.q_rad.cwiseAbs().maxCoeff() <= params_.max_joint_rad &&
              joints.dq_radps.cwiseAbs().maxCoeff() <= params_.max_joint_speed_radps;
  for (const double force_n : joints.foot_force_n) {
    good = good && (params_.infer_forces || std::abs(force_n) <= params_.max_force_n);
  }
  if (params_.infer_forces) {
    good = good && math::all_finite(joints.tau_nm) && joints.tau_nm.cwiseAbs().maxCoeff() <= params_.max_torque_nm;
  }
  if (!good) {
    ++counters_.joints_invalid;
    return;
  }
  if (joints.stamp_ns > now_ns + params_.max_lead_ns) {
    ++counters_.joints_future;
    return;
  }
  if (has_joints_ && joints.stamp_ns <= joints_.stamp_ns) {
    ++counters_.joints_stale;
    return;
  }
  // The bound grows until the next accepted sample, so a true move is taken up again by itself.
  const double most_rad =
      params_.joint_slack_rad + params_.max_joint_speed_radps * seconds(joints.stamp_ns - joints_.stamp_ns);
  const JointVector q_rad = joints.q_rad - encoders_.offset_rad();
  if (has_joints_ && (q_rad - joints_.q_rad).cwiseAbs().maxCoeff() > most_rad) {
    ++counters_.joints_jump;
    return;
  }
  joints_dt_s_ = has_joints_ ? seconds(joints.stamp_ns - joints_.stamp_ns) : 0.0;
  joints_ = joints;
  joints_.q_rad = q_rad;
  if (params_.infer_forces) {  // until there is an attitude, upright
    joints_.foot_force_n = forces_.update(robot_->legs, joints_, state_.odom_T_base.R.row(2).transpose());
  }
  for (double& force_n : joints_.foot_force_n) force_n = std::max(force_n, 0.0);
  has_joints_ = new_joints_ = true;
}

void Estimator::to_encoders(JointCommand& command) const noexcept {
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const JointLimits& limits = robot_->drives.limits[n];
    double& q_rad = command.joints[n].q_rad;
    q_rad = math::clamp(q_rad + encoders_.offset_rad()[static_cast<Eigen::Index>(n)], limits.min_rad, limits.max_rad);
  }
}

void Estimator::take_joints(const std::array<bool, kFootCount>& planned_stance) noexcept {
  contacts_.update(joints_.foot_force_n, planned_stance, joints_.stamp_ns);
  for (std::size_t i = 0; i < kFootCount; ++i) {
    legs_[i] = measure_leg(robot_->legs, static_cast<Foot>(i), joints_.q_rad, joints_.dq_radps);
    const FootContact& contact = contacts_.feet()[i];
    if (stood_[i] && !contact.stands) ground_.heights[i] = {};  // lifted: its tread's height is history
    stood_[i] = contact.stands;
    // The contact's place is that of the touch: by now the leg may have pushed on by some millimetres.
    StateEstimate then;
    ground_.touch_downs[i].now = contact.landed && ring_.try_at(contact.touch_ns, then);
    if (ground_.touch_downs[i].now) ground_.touch_downs[i].odom_T_sole = then.odom_T_sole[i];
  }
  // A robot that is being put down rocks on its soles.
  if (state_.initialised || standstill_.collecting())
    encoders_.update(legs_, contacts_.feet(), joints_.tau_nm, std::min(joints_dt_s_, params_.max_step_s));
}

void Estimator::calibrate() noexcept {
  const bool still = standstill_.try_finish(imu_, joints_, legs_);
  if (counters_.standstill_restarts != standstill_.restarts()) {
    counters_.standstill_restarts = standstill_.restarts();
    odometry_.fusion().reset(params_.fusion, robot_->mounts.base_T_lidar);  // what it averaged was another place
    encoders_.learn_anew();
  }
  if (!standstill_.collecting()) return;

  // Origin: the floor under the base, the soles at z = 0 in the mean, yaw 0.
  initial_odom_T_base_ = {standstill_.odom_R_base(), Vec3::Zero()};
  for (const LegMeasurement& leg : legs_) {
    initial_odom_T_base_.p_m.z() -= (initial_odom_T_base_.R * leg.base_T_sole.p_m).z() / kFootCount;
  }
  if (!still) return;

  ContactInEkf::Start start;
  start.odom_R_base = initial_odom_T_base_.R;
  start.odom_p_base_m = initial_odom_T_base_.p_m;
  start.odom_v_base_mps = standstill_.odom_v_base_mps();
  start.gyro_bias_radps = standstill_.gyro_bias_radps();
  start.gravity_mps2 = standstill_.gravity_mps2();
  odometry_.initialise(start, legs_, params_.max_step_s);
  ground_.heights.fill({0.0, params_.floor_sigma_m});
  odometry_.fusion().rebase(initial_odom_T_base_);
  initialised_ns_ = std::max(imu_.stamp_ns, joints_.stamp_ns);
  state_.initialised = true;
}

void Estimator::publish(std::int64_t now_ns) noexcept {
  state_.stamp_ns = counters_.stamp_ns = quality_.stamp_ns = now_ns;
  state_.oldest_input_ns = std::min(imu_.stamp_ns, joints_.stamp_ns);
  if (state_.initialised) {
    odometry_.describe(now_ns, state_);
    odometry_.describe(now_ns, quality_);
  } else {
    state_.odom_T_base = initial_odom_T_base_;
  }
  state_.q_rad = joints_.q_rad;
  for (std::size_t i = 0; i < kFootCount; ++i) {
    state_.odom_T_sole[i] = state_.odom_T_base * legs_[i].base_T_sole;
    state_.contact_probability[i] = contacts_.feet()[i].probability;
  }
}

}  // namespace polygmap
