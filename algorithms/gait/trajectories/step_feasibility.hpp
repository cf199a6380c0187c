// SPDX-License-Identifier: Apache-2.0
// Can the legs do a step? Its knots (eqs 30, 37), followed with kinematics and statics of the legs.
#pragma once

#include "algorithms/gait/trajectories/step_plan.hpp"
#include "algorithms/robot/leg_frames.hpp"

namespace polygmap {

// One of the N knots of a step: foot and torso poses {p_f, p_t, t_i} of eq. (30), t_i = i dt of eq. (37). The paper's
// robot is led from knot to knot; here they are a proof of feasibility only, and what is carried out are the smooth
// trajectories that the knots are taken from (Swing, TorsoTrajectory, ComPlan).
struct StepKnot {
  std::array<Transform, kFootCount> odom_T_sole;
  Transform odom_T_base;
  Vec3 odom_felt_mps2 = Vec3::Zero();  // while a foot swings: the body's acceleration against free fall
  Vec2 odom_zmp_m = Vec2::Zero();      // then: where the ground carries the stance foot
  std::int32_t tick = 0;
};

// The knots of a plan, each made when asked for: nothing is stored.
class StepKnots {
 public:
  StepKnots() noexcept = default;
  // knot_ticks: between two knots, at least 1.
  StepKnots(const RobotModel& robot, const StepParams& params, std::int32_t knot_ticks, const StepPlan& plan,
            const TorsoTrajectory::State& from, const std::array<Transform, kFootCount>& soles) noexcept;
  [[nodiscard]] const TorsoPose& torso_at_landing() const noexcept { return plan_.touch_down; }
  [[nodiscard]] HorizontalMotion com_at_landing() const noexcept {
    return com_.at(plan_.shift_ticks + plan_.swing_ticks);
  }
  [[nodiscard]] std::int32_t count() const noexcept { return count_; }
  [[nodiscard]] double joint_margin_rad() const noexcept { return plan_.joint_margin_rad; }  // that the plan is to keep
  [[nodiscard]] double torque_share() const noexcept { return plan_.torque_share; }          // that it may ask for
  [[nodiscard]] std::int32_t knot_ticks() const noexcept { return knot_ticks_; }
  [[nodiscard]] Foot stance() const noexcept { return other(swing()); }
  [[nodiscard]] Foot swing() const noexcept { return plan_.goal.foot; }
  [[nodiscard]] bool swings_at(std::int32_t tick) const noexcept { return tick >= plan_.shift_ticks; }
  [[nodiscard]] StepKnot operator[](std::int32_t i) const noexcept;
  // By how much the sole in the air may roll where its ankle's range ends: its lower side then comes down by half of
  // what the sole is above the ground. The swing is planned level; the sole rolls because its ankle stops at the range.
  [[nodiscard]] double air_roll_rad(const StepKnot& knot) const noexcept;

 private:
  StepPlan plan_;
  SoleModel sole_;
  std::array<Transform, kFootCount> soles_;
  TorsoTrajectory shift_, lean_;
  ComPlan com_;
  Swing path_;
  std::int32_t knot_ticks_ = 1, count_ = 0;
};

struct StepCheck {
  bool feasible = false;
  double joint_margin_rad = 0.0;  // least, over all knots and joints
  double knee_rad = 0.0;          // least
  double speed_share = 0.0;       // greatest, of the drive's limit
  double torque_share = 0.0;      // greatest, of the knee that carries the body alone, of what its drive has
};

// Follows the knots with kinematics and statics of the legs, as many per call as the tick can spare. Every call is
// given the same robot and parameters.
class StepFeasibility {
 public:
  void begin(const RobotModel& robot, const StepKnots& knots) noexcept;
  // Up to `count` knots; true when all are done or one cannot be. A knot costs two leg solutions, the frames
  // of both legs, a centre of mass and the torque of one knee.
  bool advance(const RobotModel& robot, const StepParams& params, std::int32_t count) noexcept;
  [[nodiscard]] const StepCheck& check() const noexcept { return check_; }
  [[nodiscard]] const StepKnots& knots() const noexcept { return knots_; }

 private:
  // Both legs at a knot; false when one is out of reach. The base is placed so that the centre of mass of the last
  // posture is where the plan has it; knot.odom_T_base is changed.
  bool solve(const RobotModel& robot, StepKnot& knot, JointVector& q_rad) const noexcept;
  void check_joints(const DriveModel& drives, const StepKnot& knot, const JointVector& q_rad) noexcept;
  // Of the stance leg while the other one swings, as if all links had the centre of mass's acceleration and the
  // swinging leg hung on the torso. Two legs that stand are not asked: they share. frames_ are the knot's, and what the
  // drive has is told by the knee's speed since the knot before.
  void check_knee_torque(const RobotModel& robot, const StepKnot& knot, const JointVector& q_rad) noexcept;

  StepKnots knots_;
  StepCheck check_;
  JointVector previous_ = JointVector::Zero();
  BodyFrames frames_;  // of the last posture
  std::int32_t next_ = 0;
};

}  // namespace polygmap
