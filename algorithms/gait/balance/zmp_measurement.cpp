// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/balance/zmp_measurement.hpp"

#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {

bool try_measure_zmp(const ZmpMeasurementParams& params, const RobotModel& robot, const JointFeedback& felt,
                     const std::array<Transform, kFootCount>& odom_T_sole, const Vec2& odom_slope,
                     Vec2& odom_p_zmp_m) noexcept {
  if (!math::all_finite(felt.tau_nm)) return false;
  double sum_n = 0.0;
  Vec3 moment_nm = Vec3::Zero();
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const std::size_t f = index_of(leg);
    const double up_n = felt.foot_force_n[f];
    sum_n += up_n;
    if (up_n < params.pressed_n) continue;
    const LegVector tau_nm = leg_joints(felt.tau_nm, leg);
    if (tau_nm[kAnklePitch] == 0.0 && tau_nm[kAnkleRoll] == 0.0) return false;  // drives that tell none
    const Transform& sole = odom_T_sole[f];
    const Vec3 slope = sole.R.transpose() * Vec3{odom_slope.x(), odom_slope.y(), 0.0};
    const LinkMass& foot = robot.masses.leg[kAnkleRoll];
    // The ankle's balance: the ground's force, as far below it as the sole is, and the foot's weight.
    const double ahead_m = (tau_nm[kAnklePitch] + foot.mass_kg * kGravity_mps2 * foot.centre_m.x()) / up_n -
                           robot.legs.ankle_to_sole_m * slope.x();
    const double left_m = -tau_nm[kAnkleRoll] / up_n - robot.legs.ankle_to_sole_m * slope.y();
    const SoleRectangle& contact = robot.sole.contact;
    moment_nm += up_n * (sole * Vec3{math::clamp(ahead_m, contact.heel_x_m, contact.toe_x_m),
                                     math::clamp(left_m, -contact.half_width_m, contact.half_width_m), 0.0});
  }
  const double weight_n = robot.masses.total_kg() * kGravity_mps2;
  if (!(sum_n > params.min_weight_share * weight_n && sum_n < params.max_weight_share * weight_n)) return false;
  odom_p_zmp_m = moment_nm.head<2>() / sum_n;
  return true;
}

}  // namespace polygmap
