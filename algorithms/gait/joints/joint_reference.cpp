// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/joints/joint_reference.hpp"

#include <algorithm>

#include "algorithms/core/time.hpp"

namespace polygmap {

namespace {

JointVector into_range(const RobotModel& robot, const JointVector& q_rad) noexcept {
  JointVector inside_rad;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const auto i = static_cast<Eigen::Index>(n);
    const JointLimits& limits = robot.drives.limits[n];
    inside_rad[i] = math::clamp(q_rad[i], limits.min_rad, limits.max_rad);
  }
  return inside_rad;
}

}  // namespace

JointSet JointReference::out_of_range(const RobotModel& robot, const Params& params,
                                      const JointVector& q_rad) noexcept {
  const JointVector inside_rad = into_range(robot, q_rad);
  JointSet outside;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const auto i = static_cast<Eigen::Index>(n);
    if (!(std::abs(q_rad[i] - inside_rad[i]) <= params.encoder_offset_rad)) outside.insert(n);
  }
  return outside;
}

bool JointReference::try_arm(const RobotModel& robot, const Params& params, const JointVector& q_rad) noexcept {
  if (!out_of_range(robot, params, q_rad).is_empty()) return false;
  const JointVector inside_rad = into_range(robot, q_rad);
  robot_ = &robot;
  params_ = params;
  reference_rad_ = inside_rad;
  commanded_rad_ = inside_rad;
  knee_was_mute_ = {};
  return true;
}

bool JointReference::follow(const std::array<Transform, kFootCount>& base_T_sole,
                            const std::array<bool, kFootCount>& stands, JointCommand& command) noexcept {
  constexpr double kRounding_rad = 1e-9;  // beyond a limit is none
  const DriveModel& drives = robot_->drives;
  bool limited = false;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const LegSolution solution = solve_leg(robot_->legs, leg, base_T_sole[index_of(leg)]);
    const bool solved = math::all_finite(solution.q_rad);
    const double gain = gain_of(leg, stands);
    limited = limited || !solution.reachable || !solved;
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
      const std::size_t n = joint_index(leg, j);
      const JointLimits& limits = drives.limits[n];
      const auto i = static_cast<Eigen::Index>(n);
      const double before_rad = reference_rad_[i];
      const double step_rad = limits.speed_radps * kTick_s;
      const double asked_rad = solved ? solution.q_rad[static_cast<Eigen::Index>(j)] : before_rad;
      const double q_rad = math::clamp(math::clamp(asked_rad, before_rad - step_rad, before_rad + step_rad),
                                       limits.min_rad, limits.max_rad);
      if (std::abs(q_rad - asked_rad) > kRounding_rad) limited = true;
      const double dq_radps = (q_rad - before_rad) / kTick_s;
      reference_rad_[i] = q_rad;
      // The lead may change faster than the reference, never faster than the drive.
      const double sent_rad = commanded_rad_[i];
      commanded_rad_[i] =
          math::clamp(math::clamp(q_rad + drives.delay_s * dq_radps, sent_rad - step_rad, sent_rad + step_rad),
                      limits.min_rad, limits.max_rad);
      command.joints[n] = {commanded_rad_[i], dq_radps, 0.0, drives.kp_of(n, gain), drives.kd_of(n, gain)};
    }
  }
  return limited;
}

void JointReference::fit_mute_knees(const JointFeedback& feedback, const std::array<bool, kFootCount>& stands,
                                    bool leg_impaired, std::array<Transform, kFootCount>& base_T_sole) noexcept {
  const LegGeometry& legs = robot_->legs;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const std::size_t knee = joint_index(leg, kKnee);
    bool& was_mute = knee_was_mute_[index_of(leg)];
    was_mute = feedback.is_mute(knee) || (was_mute && leg_impaired);
    if (stands[index_of(leg)] || !was_mute) continue;
    // One that speaks again stays as commanded: where it is measured it gives way to its load.
    const JointVector& q_rad = feedback.is_mute(knee) ? feedback.q_rad : reference_rad_;
    const double bent_cos = math::cos(q_rad[static_cast<Eigen::Index>(knee)]);
    const double length_m = math::sqrt(math::square(legs.thigh_m) + math::square(legs.shank_m) +
                                       2.0 * legs.thigh_m * legs.shank_m * bent_cos);
    Transform& sole = base_T_sole[index_of(leg)];
    const Vec3 hip_m = base_p_leg(legs, leg, leg_joints(reference_rad_, leg)).hip_pitch_m;
    const Vec3 way_m = sole * Vec3{0, 0, legs.ankle_to_sole_m} - hip_m;
    sole.p_m += (length_m / std::max(way_m.norm(), 0.1) - 1.0) * way_m;
  }
}

void JointReference::add_damping(const std::array<bool, kFootCount>& stands, const JointFeedback& feedback,
                                 const JointCommand& command, JointVector& torque_nm) const noexcept {
  if (command.stamp_ns - feedback.stamp_ns > params_.damping_age_ns) return;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const double gain = gain_of(leg, stands);
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
      const std::size_t n = joint_index(leg, j);
      const double kd_nmsprad = robot_->drives.kd_beside(n, gain);
      if (!(kd_nmsprad > 0.0) || feedback.silent_cycles[n] > 0) continue;
      const auto i = static_cast<Eigen::Index>(n);
      torque_nm[i] += kd_nmsprad * (command.joints[n].dq_radps - feedback.dq_radps[i]);
    }
  }
}

void JointReference::stiffen_blind(bool blind, const std::array<bool, kFootCount>& stands,
                                   JointCommand& command) noexcept {
  blind_share_ = math::clamp(blind_share_ + (blind ? 1.0 : -1.0) * kTick_s / params_.blind_ramp_s, 0.0, 1.0);
  if (blind_share_ == 0.0) return;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    double& kp_nmprad = command.joints[n].kp_nmprad;
    if (stands[n / kJointsPerLeg]) kp_nmprad += blind_share_ * (robot_->drives.kp_blind_of(n) - kp_nmprad);
  }
}

void JointReference::hold(JointCommand& command) const noexcept {
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const DriveModel& drives = robot_->drives;
    command.joints[n] = {commanded_rad_[static_cast<Eigen::Index>(n)], 0.0, 0.0, drives.kp_of(n), drives.kd_of(n)};
  }
}

Transform JointReference::base_T_sole_reference(Foot leg) const noexcept {
  return base_T_sole(robot_->legs, leg, leg_joints(reference_rad_, leg));
}

}  // namespace polygmap
