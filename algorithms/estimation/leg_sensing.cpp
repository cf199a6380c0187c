// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/leg_sensing.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>

#include "algorithms/robot/drive_torque.hpp"

namespace polygmap {
namespace {

// With speeds that its own were smoothed to.
JointFeedback carried_on(const JointFeedback& joints, const JointVector& dq_radps) noexcept {
  JointFeedback carried = joints;
  carried.dq_radps = dq_radps;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const std::uint16_t cycles = std::min(joints.silent_cycles[n], JointFeedback::kCarried_cycles);
    if (cycles == 0) continue;
    const auto i = static_cast<Eigen::Index>(n);
    carried.q_rad[i] += cycles * kTick_s * dq_radps[i];
    if (joints.is_mute(n)) carried.dq_radps[i] = 0.0;
  }
  return carried;
}

// The lowest silent one of those that turn about the same axis: it carries most and gives way most.
std::optional<std::size_t> lowest_silent(const JointFeedback& joints, Foot leg,
                                         std::initializer_list<LegJoint> upwards) noexcept {
  for (const LegJoint joint : upwards) {
    const std::size_t n = joint_index(leg, joint);
    if (joints.is_mute(n)) return n;
  }
  return std::nullopt;
}

}  // namespace

void LegSensing::reset(const Params& params, const RobotModel& robot) noexcept {
  params_ = params;
  robot_ = &robot;
  counters_ = {};
  encoders_.reset(params.encoders);
  forces_.reset(params.forces);
  speeds_.reset(params.speeds);
  joints_ = {};
  felt_ns_ = 0;
  dt_s_ = 0.0;
  replied_ns_ = {};
  any_ = false;
}

bool LegSensing::is_valid(const JointFeedback& joints) const noexcept {
  bool good = math::all_finite(joints.q_rad) && math::all_finite(joints.dq_radps) &&
              joints.q_rad.cwiseAbs().maxCoeff() <= params_.max_joint_rad &&
              joints.dq_radps.cwiseAbs().maxCoeff() <= params_.max_joint_speed_radps;
  for (const double force_n : joints.foot_force_n) {
    good = good && (std::isnan(force_n) || std::abs(force_n) <= params_.max_force_n);
  }
  const bool torques_told = math::all_finite(joints.tau_nm);
  return good && !(torques_told && joints.tau_nm.cwiseAbs().maxCoeff() > params_.max_torque_nm);
}

bool LegSensing::try_take(const JointFeedback& joints, std::int64_t latest_ns, const ImuSample& base,
                          const Vec3& base_up, const std::array<bool, kFootCount>& stands) noexcept {
  if (!is_valid(joints)) {
    ++counters_.invalid;
    return false;
  }
  if (joints.stamp_ns > latest_ns) {
    ++counters_.future;
    return false;
  }
  if (any_ && joints.stamp_ns <= joints_.stamp_ns) {
    ++counters_.stale;
    return false;
  }
  const double since_s = any_ ? seconds(joints.stamp_ns - joints_.stamp_ns) : 0.0;
  JointFeedback carried = carried_on(joints, speeds_.smoothed(joints.dq_radps, since_s));
  carried.q_rad -= encoders_.offset_rad();
  carried.tau_nm /= forces_.torque_scale();
  level_soles(base_up, stands, carried);
  if (any_ && jumps(carried)) {
    ++counters_.jump;
    return false;
  }
  dt_s_ = since_s;
  joints_ = carried;
  frames_ = body_frames(robot_->legs, joints_.q_rad);
  for (std::size_t n = 0; n < kJointCount; ++n) replied_ns_[n] = joints.stamp_ns - joints.silent_ns(n);
  forces_.update(*robot_, frames_, joints_, base, base_up, stands);
  joints_.foot_force_n = forces_.up_n();
  for (std::size_t n = 0; n < kJointCount; ++n) {  // the last torque is not this one's
    if (is_mute(n)) joints_.tau_nm[static_cast<Eigen::Index>(n)] = std::numeric_limits<double>::quiet_NaN();
  }
  if (!std::isnan(joints_.foot_force_n[0] + joints_.foot_force_n[1])) felt_ns_ = joints_.stamp_ns;
  any_ = true;
  return true;
}

// A drive that holds gives way under its load all the same: by how much, the sole tells that stands level.
void LegSensing::level_soles(const Vec3& base_up, const std::array<bool, kFootCount>& stands,
                             JointFeedback& joints) const noexcept {
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const double force_n = joints_.foot_force_n[index_of(leg)];  // as it was before
    const bool pressed = std::isnan(force_n) ? stands[index_of(leg)] : force_n > params_.level_n;
    if (!pressed) continue;
    const auto pitch = lowest_silent(joints, leg, {kAnklePitch, kKnee, kHipPitch});
    const auto roll = lowest_silent(joints, leg, {kAnkleRoll, kHipRoll});
    if (!pitch && !roll) continue;
    const Mat3 base_R_sole = base_T_sole(robot_->legs, leg, leg_joints(joints.q_rad, leg)).R;
    const Vec3 off_rad = base_R_sole.transpose() * base_R_sole.col(2).cross(base_up);
    if (pitch) joints.q_rad[static_cast<Eigen::Index>(*pitch)] += off_rad.y();
    if (roll) joints.q_rad[static_cast<Eigen::Index>(*roll)] += off_rad.x();
  }
}

// The bound grows until the joint's next accepted reply, so a true move is taken up again by itself.
bool LegSensing::jumps(const JointFeedback& carried) const noexcept {
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const auto i = static_cast<Eigen::Index>(n);
    const double most_rad =
        params_.joint_slack_rad + params_.max_joint_speed_radps * seconds(carried.stamp_ns - replied_ns_[n]);
    if (std::abs(carried.q_rad[i] - joints_.q_rad[i]) > most_rad) return true;
  }
  return false;
}

LegSample LegSensing::legs() const noexcept {
  LegSample sample;
  sample.stamp_ns = joints_.stamp_ns;
  for (std::size_t i = 0; i < kFootCount; ++i) {
    sample.legs[i] = measure_leg(frames_[i], leg_joints(joints_.dq_radps, static_cast<Foot>(i)));
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
      const std::size_t n = joint_index(static_cast<Foot>(i), j);
      if (!is_mute(n)) continue;
      sample.measured[i] = sample.legs[i].sole_known = false;
      sample.silent_ns = std::max(sample.silent_ns, joints_.silent_ns(n));
    }
  }
  sample.silent_ns = std::max(sample.silent_ns, joints_.stamp_ns - felt_ns_);
  sample.foot_force_n = joints_.foot_force_n;
  sample.foot_force_sigma_n = forces_.sigma_n();
  return sample;
}

void LegSensing::learn_offsets(const std::array<LegMeasurement, kFootCount>& legs,
                               const std::array<FootContact, kFootCount>& contacts, double longest_s) noexcept {
  if (any_) encoders_.update(legs, contacts, joints_.tau_nm, std::min(dt_s_, longest_s));
}

void LegSensing::to_drives(JointCommand& command) const noexcept {
  constexpr std::int64_t kTelling_ns = 6 * kNsPerMs;  // older angles tell no torque: the setpoint's own stand in
  const std::int64_t age_ns = command.stamp_ns - joints_.stamp_ns;
  const bool told = any_ && age_ns <= kTelling_ns;
  const double until_taken_s = seconds(age_ns) + robot_->drives.delay_s;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const auto i = static_cast<Eigen::Index>(n);
    const double offset_rad = encoders_.offset_rad()[i];
    const JointLimits& limits = robot_->drives.limits[n];
    JointSetpoint& joint = command.joints[n];
    joint.q_rad = math::clamp(joint.q_rad + offset_rad, limits.min_rad, limits.max_rad);
    joint.tau_ff_nm = math::clamp(joint.tau_ff_nm * forces_.torque_scale(), -limits.torque_nm, limits.torque_nm);
    if (told && !is_mute(n)) {
      const double dq_radps = joints_.dq_radps[i];
      limit_torque(limits, joints_.q_rad[i] + offset_rad + until_taken_s * dq_radps, dq_radps, joint);
    } else {
      limit_torque(limits, joint.q_rad, joint.dq_radps, joint);
    }
  }
}

}  // namespace polygmap
