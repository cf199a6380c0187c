// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/calibration/standing_vertical.hpp"

#include "algorithms/robot/leg_dynamics.hpp"
#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {

Vec3 up_by_soles(const LegGeometry& legs, const JointVector& q_rad) noexcept {
  Vec3 sum = Vec3::Zero();
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    sum += base_T_sole(legs, foot, leg_joints(q_rad, foot)).R.col(2);
  }
  return sum.normalized();
}

bool try_up_by_statics(const StandingVerticalParams& params, const RobotModel& robot, const JointFeedback& felt,
                       Vec3& base_up) noexcept {
  if (!math::all_finite(felt.tau_nm)) return false;
  const double sum_n = felt.foot_force_n[0] + felt.foot_force_n[1];
  const double weight_n = robot.masses.total_kg() * kGravity_mps2;
  if (!(sum_n > params.min_weight_share * weight_n && sum_n < params.max_weight_share * weight_n)) return false;

  const BodyFrames frames = body_frames(robot.legs, felt.q_rad);
  const PerLink links_m = base_p_links_m(robot.masses, frames);
  const LinkMass& foot = robot.masses.leg[kAnkleRoll];
  const double feet_kg = 2.0 * foot.mass_kg, above_kg = robot.masses.total_kg() - feet_kg;
  Vec3 above_kgm = robot.masses.total_kg() * centre_of_mass_m(robot.masses, links_m);
  Vec3 carried_nm = Vec3::Zero(), turning_nm = Vec3::Zero();  // ankle places by force; moments of the ankles
  double carried_n = 0.0;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const std::size_t f = index_of(leg);
    if (!(felt.foot_force_n[f] > params.pressed_n)) return false;
    const LegVector tau_nm = leg_joints(felt.tau_nm, leg);
    if (tau_nm[kAnklePitch] == 0.0 && tau_nm[kAnkleRoll] == 0.0) return false;  // drives that tell none
    above_kgm -= foot.mass_kg * links_m.leg[f][kAnkleRoll];
    const double up_n = felt.foot_force_n[f] - foot.mass_kg * kGravity_mps2;  // at the ankle
    carried_n += up_n;
    carried_nm += up_n * frames[f].joint[kAnkleRoll].p_m;
    for (const LegJoint joint : {kAnklePitch, kAnkleRoll}) {
      turning_nm += tau_nm[joint] * frames[f].joint[joint].R.col(kJointAxis[joint]);
    }
  }
  // Of what is above: forces at the ankles, the drives' torques against it, and its weight balance,
  // (carried - centre) x up = turning / weight.
  const Vec3 below_m = carried_nm / carried_n - above_kgm / above_kg;
  const Vec3 arm_m = turning_nm / carried_n;
  base_up = Vec3{(below_m.x() + arm_m.y()) / below_m.z(), (below_m.y() - arm_m.x()) / below_m.z(), 1.0}.normalized();
  return true;
}

}  // namespace polygmap
