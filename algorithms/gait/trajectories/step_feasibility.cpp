// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/trajectories/step_feasibility.hpp"

#include <algorithm>

#include "algorithms/core/time.hpp"
#include "algorithms/robot/drive_torque.hpp"
#include "algorithms/robot/leg_dynamics.hpp"
#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {

StepKnots::StepKnots(const RobotModel& robot, const StepParams& params, std::int32_t knot_ticks, const StepPlan& step,
                     const TorsoTrajectory::State& from, const std::array<Transform, kFootCount>& soles) noexcept
    : plan_(step),
      sole_(robot.sole),
      soles_(soles),
      knot_ticks_(std::max(knot_ticks, 1)),
      count_(1 + (step.shift_ticks + step.swing_ticks + knot_ticks_ - 1) / knot_ticks_) {
  const HorizontalMotion com = TorsoTrajectory::horizontal(from);
  com_.plan(params.com, com, zmp_of_shift(params, step, ComPlan::zmp_under(params.com, com)));
  plan_torso(robot.legs, params, {sole_pose(soles[0]), sole_pose(soles[1])}, com_, plan_.shift_ticks, plan_);
  shift_.plan(from, plan_.lift_off, plan_.shift_ticks, plan_.shift_ticks);
  lean_.plan(shift_.at(plan_.shift_ticks, com), plan_.touch_down, plan_.swing_ticks, plan_.rise_ticks);
  path_.plan(sole_, soles[index_of(swing())] * turned_about_toe(sole_, plan_.heel_up_rad), plan_.goal.target,
             plan_.shape, plan_.swing_ticks);
}

double StepKnots::air_roll_rad(const StepKnot& knot) const noexcept {
  if (!swings_at(knot.tick)) return 0.0;
  const bool leaves = 2 * (knot.tick - plan_.shift_ticks) < plan_.swing_ticks;
  const std::size_t foot = index_of(swing());
  const double ground_m = leaves ? soles_[foot].p_m.z() : plan_.goal.target.position_m.z();
  const double above_m = knot.odom_T_sole[foot].p_m.z() - ground_m;
  return math::clamp(0.5 * above_m / sole_.collision.half_width_m, 0.0, plan_.shape.air_roll_rad);
}

StepKnot StepKnots::operator[](std::int32_t i) const noexcept {
  StepKnot knot;
  knot.tick = i * knot_ticks_;
  knot.odom_T_sole = soles_;
  Transform& odom_T_swing = knot.odom_T_sole[index_of(swing())];
  const std::int32_t swing_tick = std::min(knot.tick - plan_.shift_ticks, path_.duration_ticks());
  if (swing_tick < 0) {
    knot.odom_T_base = TorsoTrajectory::pose(shift_.at(knot.tick, com_.at(knot.tick)));
    if (plan_.heel_up_rad > 0.0) odom_T_swing = odom_T_swing * turned_about_toe(sole_, plan_.heel_up_rad_at(knot.tick));
  } else {
    const TorsoTrajectory::State torso = lean_.at(swing_tick, com_.at(knot.tick));
    knot.odom_T_base = TorsoTrajectory::pose(torso);
    knot.odom_felt_mps2 = {torso[0].acceleration, torso[1].acceleration, kGravity_mps2 + torso[2].acceleration};
    knot.odom_zmp_m = com_.zmp_m(knot.tick);
    odom_T_swing = path_.at(swing_tick);
  }
  return knot;
}

void StepFeasibility::begin(const RobotModel& robot, const StepKnots& knots) noexcept {
  knots_ = knots;
  check_ = {true, 1e9, 1e9, 0.0, 0.0};
  next_ = 0;
  previous_.setZero();
  frames_ = body_frames(robot.legs, previous_);
  StepKnot knot = knots_[0];  // base and legs follow each other: this knot is solved again
  (void)solve(robot, knot, previous_);
  frames_ = body_frames(robot.legs, previous_);
}

bool StepFeasibility::solve(const RobotModel& robot, StepKnot& knot, JointVector& q_rad) const noexcept {
  const Vec3 base_p_com = centre_of_mass_m(robot.masses, base_p_links_m(robot.masses, frames_));
  knot.odom_T_base.p_m.head<2>() -= (knot.odom_T_base.R * base_p_com).head<2>();
  const Transform base_T_odom = knot.odom_T_base.inverse();
  bool reachable = true;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const LegSolution s = solve_leg(robot.legs, leg, base_T_odom * knot.odom_T_sole[index_of(leg)]);
    reachable = reachable && s.reachable;
    q_rad.segment<static_cast<int>(kJointsPerLeg)>(static_cast<Eigen::Index>(joint_index(leg, 0))) = s.q_rad;
  }
  return reachable;
}

void StepFeasibility::check_joints(const DriveModel& drives, const StepKnot& knot, const JointVector& q_rad) noexcept {
  const std::size_t in_air = joint_index(knots_.swing(), kAnkleRoll);
  const double air_roll_rad = knots_.air_roll_rad(knot);
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const JointLimits& limits = drives.limits[n];
    const auto i = static_cast<Eigen::Index>(n);
    // The knee's lower end is the stretched leg, which has a margin of its own.
    double& low = n % kJointsPerLeg == kKnee ? check_.knee_rad : check_.joint_margin_rad;
    const double spare_rad = n == in_air ? air_roll_rad : 0.0;
    low = std::min(low, q_rad[i] - limits.min_rad + spare_rad);
    check_.joint_margin_rad = std::min(check_.joint_margin_rad, limits.max_rad - q_rad[i] + spare_rad);
    if (next_ > 0) {
      const double speed_radps = std::abs(q_rad[i] - previous_[i]) / (knots_.knot_ticks() * kTick_s);
      check_.speed_share = std::max(check_.speed_share, speed_radps / limits.speed_radps);
    }
  }
}

// The hips' drives have plenty, and what an ankle gives follows the zero-moment point.
void StepFeasibility::check_knee_torque(const RobotModel& robot, const StepKnot& knot,
                                        const JointVector& q_rad) noexcept {
  if (!knots_.swings_at(knot.tick)) return;
  constexpr double kLeast_nm = 1e-3;  // in place of none
  const Foot stance = knots_.stance();
  const Mat3 base_R_odom = knot.odom_T_base.R.transpose();
  const Vec3 felt_mps2 = base_R_odom * knot.odom_felt_mps2;
  Vec3 odom_arm_m = Vec3::Zero();
  odom_arm_m.head<2>() = knot.odom_zmp_m - knot.odom_T_sole[index_of(stance)].p_m.head<2>();
  const Vec3 force_n = robot.masses.total_kg() * felt_mps2;
  std::array<Vec3, kJointsPerLeg> specific_mps2;
  specific_mps2.fill(-felt_mps2);
  const double torque_nm = leg_torques_nm(robot.masses, stance, frames_[index_of(stance)], specific_mps2,
                                          {force_n, (base_R_odom * odom_arm_m).cross(force_n)})[kKnee];
  const std::size_t knee = joint_index(stance, kKnee);
  const auto i = static_cast<Eigen::Index>(knee);
  const double speed_radps = next_ > 0 ? (q_rad[i] - previous_[i]) / (knots_.knot_ticks() * kTick_s) : 0.0;
  const TorqueRange range = torque_range_nm(robot.drives.limits[knee], speed_radps);
  const double limit_nm = std::max(torque_nm < 0.0 ? -range.least_nm : range.most_nm, kLeast_nm);
  check_.torque_share = std::max(check_.torque_share, std::abs(torque_nm) / limit_nm);
}

bool StepFeasibility::advance(const RobotModel& robot, const StepParams& params, std::int32_t count) noexcept {
  const std::int32_t end = std::min(next_ + count, knots_.count());
  for (; next_ < end; ++next_) {
    StepKnot knot = knots_[next_];
    JointVector q_rad;
    if (!solve(robot, knot, q_rad)) check_.feasible = false;
    frames_ = body_frames(robot.legs, q_rad);
    check_joints(robot.drives, knot, q_rad);
    check_knee_torque(robot, knot, q_rad);
    previous_ = q_rad;
    check_.feasible = check_.feasible && check_.joint_margin_rad >= knots_.joint_margin_rad() &&
                      check_.knee_rad >= params.knee_min_rad && check_.speed_share <= params.speed_share &&
                      check_.torque_share <= knots_.torque_share();
    if (!check_.feasible) return true;
  }
  return next_ == knots_.count();
}

}  // namespace polygmap
