// SPDX-License-Identifier: Apache-2.0
// The joint angles of the plan alone, without the steering of the feet, and how they accelerate the links.
#pragma once

#include "algorithms/gait/balance/link_motion.hpp"

namespace polygmap {

class PlannedPosture {
 public:
  // At rest at these angles. base_p_com_m: the centre of mass there.
  void reset(const JointVector& q_rad, const Vec3& base_p_com_m) noexcept;
  // The plan goes on from elsewhere.
  void restart() noexcept { motion_.restart(); }
  // The plan goes on as it was, in another frame.
  void carry(const Transform& to_T_plan) noexcept { motion_.carry(to_T_plan); }
  // One tick. torso: the base's height and attitude; where it is follows from the centre of mass, as the masses
  // have it. The result belongs to the tick before.
  [[nodiscard]] LinkMotion::Acceleration update(const RobotModel& robot, const Transform& torso,
                                                const Vec2& plan_p_com_m,
                                                const std::array<Transform, kFootCount>& plan_T_sole) noexcept;
  // Of the leg's fastest drive in the last tick, over its limit; 0 after a restart.
  [[nodiscard]] double drive_share(const DriveModel& drives, Foot leg) const noexcept;

 private:
  LinkMotion motion_;
  JointVector q_rad_ = JointVector::Zero();
  JointVector moved_rad_ = JointVector::Zero();  // in the last tick
  Vec3 base_p_com_m_ = Vec3::Zero();
};

}  // namespace polygmap
