// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/joints/planned_posture.hpp"

#include <algorithm>

#include "algorithms/robot/leg_kinematics.hpp"

namespace polygmap {

void PlannedPosture::reset(const JointVector& q_rad, const Vec3& base_p_com_m) noexcept {
  q_rad_ = q_rad;
  base_p_com_m_ = base_p_com_m;
  motion_.restart();
}

LinkMotion::Acceleration PlannedPosture::update(const RobotModel& robot, const Transform& torso,
                                                const Vec2& plan_p_com_m,
                                                const std::array<Transform, kFootCount>& plan_T_sole) noexcept {
  Transform plan_T_base = torso;
  PerLink base_p_links;
  const bool restarted = motion_.restarted();
  const JointVector before_rad = q_rad_;
  const int passes = restarted ? 4 : 1;  // the base follows the legs' places and they the base
  for (int i = 0; i < passes; ++i) {
    plan_T_base.p_m.head<2>() = plan_p_com_m - (plan_T_base.R * base_p_com_m_).head<2>();
    const Transform base_T_plan = plan_T_base.inverse();
    for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
      const LegSolution s = solve_leg(robot.legs, leg, base_T_plan * plan_T_sole[index_of(leg)]);
      q_rad_.segment<static_cast<int>(kJointsPerLeg)>(static_cast<Eigen::Index>(joint_index(leg, 0))) = s.q_rad;
    }
    base_p_links = base_p_links_m(robot.masses, body_frames(robot.legs, q_rad_));
    base_p_com_m_ = centre_of_mass_m(robot.masses, base_p_links);
  }
  moved_rad_ = restarted ? JointVector::Zero() : JointVector(q_rad_ - before_rad);
  return motion_.update(plan_T_base, base_p_links, q_rad_);
}

double PlannedPosture::drive_share(const DriveModel& drives, Foot leg) const noexcept {
  double most = 0.0;
  for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
    const double speed_radps = std::abs(moved_rad_[static_cast<Eigen::Index>(joint_index(leg, j))]) / kTick_s;
    most = std::max(most, speed_radps / drives.limits_of(leg, j).speed_radps);
  }
  return most;
}

}  // namespace polygmap
