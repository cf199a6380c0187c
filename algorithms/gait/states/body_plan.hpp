// SPDX-License-Identifier: Apache-2.0
// Where the plan has the body, tick by tick. The plan frame is odometry as it was when the last shift or swing began,
// in which standing feet do not move and the joint commands never jump.
#pragma once

#include "algorithms/core/messages/gait_plan.hpp"
#include "algorithms/core/messages/state.hpp"
#include "algorithms/gait/joints/base_correction.hpp"
#include "algorithms/gait/joints/joint_reference.hpp"
#include "algorithms/gait/joints/planned_posture.hpp"
#include "algorithms/gait/states/landed_foot.hpp"
#include "algorithms/gait/trajectories/com_plan.hpp"
#include "algorithms/gait/trajectories/torso.hpp"

namespace polygmap {

class BodyPlan {
 public:
  void reset() noexcept;
  // At rest where the joints' reference puts the feet.
  void place(const JointReference& joints, const Transform& plan_T_base) noexcept;
  // The same, and the links' motion is that of a body at rest.
  void start(const JointReference& joints, const Transform& plan_T_base) noexcept;

  // One tick: the plan's next pose, then, where the estimate is known, how far it is off.
  void advance() noexcept;
  // Instead: it stays where it is, at rest. When a foot that was in the air stands, it leans a little to between them,
  // so that both carry.
  void hold(const HeldBodyParams& params, bool on_both_feet, bool may_lean) noexcept;
  // To a foot that does not carry nobody leans.
  void keep_upright() noexcept { leant_m_ = kUpright_m; }
  // Held, it comes down. False: no farther.
  [[nodiscard]] bool try_lower(const HeldBodyParams& params) noexcept;
  void correct(const StateEstimate& state, double correction_time_s) noexcept;
  void correction_missed() noexcept { correction_.missed(); }
  // The attitude was corrected: what the masses have too much of the centre of mass has changed by so much, at once.
  void shift_bias(const Vec2& odom_shift_m) noexcept;
  // Once the tick's joint references are known: where they have the centre of mass, without what the masses have too
  // much of it.
  void observe_reference(const RobotModel& robot, const JointVector& reference_rad, const Vec2& odom_com_bias_m,
                         double bias_time_s) noexcept;
  // How the plan accelerates the links, without the steering of the feet: those of plan_T_sole are planned.
  [[nodiscard]] LinkMotion::Acceleration observe_links(const RobotModel& robot,
                                                       std::array<Transform, kFootCount> plan_T_sole) noexcept;
  void count_tick() noexcept;

  // The plan goes on in odometry as it is now.
  void carry_to_odometry() noexcept;
  void move_torso(const TorsoPose& goal, std::int32_t ticks, std::int32_t height_ticks) noexcept;
  // The plan of the centre of mass, to be made anew from this tick on.
  [[nodiscard]] ComPlan& renewed_com() noexcept;
  // The centre of mass comes to rest there.
  void rest_over(const ComPlan::Params& params, const Vec2& plan_p_m) noexcept;
  void set_sole(Foot foot, const Transform& plan_T_sole) noexcept { plan_T_sole_[index_of(foot)] = plan_T_sole; }
  // Turns a standing sole about its toe's edge, until its heel has risen by that.
  void raise_heel(const SoleModel& sole, Foot foot, double heel_up_rad) noexcept;
  // Of feet that stand: down again by so much at most, a tick.
  void lower_heels(const SoleModel& sole, double by_rad) noexcept;
  [[nodiscard]] Transform flat_sole(const SoleModel& sole, Foot foot) const noexcept {
    return plan_T_sole(foot) * turned_about_toe(sole, -heel_up_rad_[index_of(foot)]);
  }
  [[nodiscard]] double heel_up_rad(Foot foot) const noexcept { return heel_up_rad_[index_of(foot)]; }
  [[nodiscard]] bool is_on_toe(Foot foot) const noexcept { return heel_up_rad_[index_of(foot)] > 0.0; }
  // Its sole is planned as it stands so; 0 in the air.
  void stand_on_toe(Foot foot, double heel_up_rad) noexcept { heel_up_rad_[index_of(foot)] = heel_up_rad; }
  void restart_posture() noexcept { posture_.restart(); }

  // The foot stands where it is planned to be, early_m above its target, and is held there in odometry.
  void land(Foot foot, bool felt, double early_m, std::int64_t now_ns) noexcept;
  // Of two that stand, one that the body has lifted, where it is when it loses its load: without load its leg gives way
  // no longer, and the foot would go to where it is planned, and along with what the base is off its plan.
  void hold_lifted_foot(const LandedFootParams& params, const StateEstimate& state, const JointFeedback& feedback,
                        std::int64_t now_ns) noexcept;
  void hold_landed_foot(const LandedFootParams& params, const JointFeedback& feedback, std::int64_t now_ns) noexcept;
  void release_landed_foot() noexcept;
  // Two feet that both carry are planned to stand to each other as the estimate has them; their middle stays where it
  // is planned. What both are off alike is no error of theirs: a body that leans has its feet elsewhere.
  void settle_feet_apart(const FeetApartParams& params, const StateEstimate& state,
                         const JointFeedback& feedback) noexcept;

  [[nodiscard]] const Transform& plan_T_base() const noexcept { return plan_T_base_; }
  [[nodiscard]] const std::array<Transform, kFootCount>& plan_T_sole() const noexcept { return plan_T_sole_; }
  [[nodiscard]] const Transform& plan_T_sole(Foot foot) const noexcept { return plan_T_sole_[index_of(foot)]; }
  [[nodiscard]] SolePair soles() const noexcept { return {sole_pose(plan_T_sole_[0]), sole_pose(plan_T_sole_[1])}; }
  [[nodiscard]] Transform odom_T_plan() const noexcept { return correction_.odom_T_plan(plan_T_base_); }
  [[nodiscard]] Transform plan_T_odom() const noexcept { return odom_T_plan().inverse(); }
  // x and y: of the centre of mass.
  [[nodiscard]] const TorsoTrajectory::State& torso() const noexcept { return torso_state_; }
  // So many ticks after this one, which is counted, with the legs as they are now; while it is held, where it is.
  [[nodiscard]] PlannedBody ahead(std::int32_t ticks) const noexcept;
  [[nodiscard]] bool is_held() const noexcept { return held_; }
  [[nodiscard]] double height_m() const noexcept { return torso_state_[2].position; }
  [[nodiscard]] HorizontalMotion com() const noexcept { return TorsoTrajectory::horizontal(torso_state_); }
  [[nodiscard]] double drive_share(const DriveModel& drives, Foot leg) const noexcept {
    return posture_.drive_share(drives, leg);
  }

 private:
  TorsoTrajectory torso_;
  TorsoTrajectory::State torso_state_{};
  std::int32_t torso_tick_ = 0;  // of the torso's plan, saturates
  ComPlan com_;
  std::int32_t com_tick_ = 0;        // of the plan of the centre of mass, likewise
  Vec2 com_shift_m_ = Vec2::Zero();  // of that plan: the leg in the air moved while the base was held
  Transform plan_T_base_;
  std::array<Transform, kFootCount> plan_T_sole_;
  std::array<double, kFootCount> heel_up_rad_{};  // of feet that stand
  BaseCorrection correction_;
  PlannedPosture posture_;
  Vec3 reference_p_com_m_ = Vec3::Zero();  // centre of mass of the posture last asked for, base frame, without the next
  Vec3 base_com_bias_m_ = Vec3::Zero();    // what the masses have too much of it
  LandedFoot landed_;
  static constexpr double kUpright_m = 1.0;  // more than it may lean
  bool held_ = false;
  double leant_m_ = 0.0, lowered_m_ = 0.0;  // since then
};

}  // namespace polygmap
