// SPDX-License-Identifier: Apache-2.0
// One foot swings, from lift-off to touch-down, or back to where it stood. It is steered in odometry.
#pragma once

#include "algorithms/gait/states/state.hpp"

namespace polygmap {

class SwingPhase {
 public:
  // The foot lifts off for the decision's goal, which is latched; tried: the shape that the legs can do.
  void begin(const GaitInput& in, GaitShared& gait, const ClimbPlanner::Decision& decision,
             const StepTry& tried) noexcept;
  [[nodiscard]] Transition tick(const GaitInput& in, GaitShared& gait) noexcept;
  // The pace of the next tick.
  void follow(const GaitInput& in, GaitShared& gait) noexcept;
  // On its path, odometry, without steering.
  [[nodiscard]] Transform sole() const noexcept;
  [[nodiscard]] Foot foot() const noexcept { return goal_.foot; }
  // After this tick: the step that it is of, at the pace that it has.
  [[nodiscard]] StepAhead ahead(const ClimbPlanner& planner) const noexcept;

 private:
  struct Contact {
    bool felt = false;     // by the sole
    double early_m = 0.0;  // so far above the target, where that is early
    bool ground = false;   // the foot stands on something
  };
  // Each sample once: of a bus that falls silent the last one is read on and on, and older than steer_age_ns it tells
  // nothing.
  [[nodiscard]] bool feel_force(const GaitInput& in, const SwingParams& params, std::int64_t steer_age_ns) noexcept;
  [[nodiscard]] Contact feel(const GaitInput& in, const SwingParams& params, std::int64_t steer_age_ns,
                             const Transform& odom_T_sole) noexcept;
  [[nodiscard]] Transition abort_swing(const GaitInput& in, GaitShared& gait) noexcept;
  [[nodiscard]] Transition touch_down(const GaitInput& in, GaitShared& gait, bool felt, double early_m) noexcept;
  void stop_foot(const GaitInput& in, GaitShared& gait) const noexcept;
  [[nodiscard]] SolePose start_flat(const GaitShared& gait) const noexcept;
  [[nodiscard]] Transform beside_path(const BodyPlan& plan, const Transform& odom_T_sole) const noexcept;
  // Until which tick of its path it may go back: where the body falls, or a drive of its leg is silent; and where the
  // operator asks to stop.
  struct Turns {
    double by_itself_tick = 0.0, asked_tick = 0.0;
  };
  [[nodiscard]] Turns turns_until(const GaitInput& in, const SwingParams& params) const noexcept;
  void land_soon(GaitShared& gait) noexcept;
  void land_beside(GaitShared& gait, const SolePose& target) noexcept;
  void lower_torso(GaitShared& gait, const SolePose& sole) const noexcept;
  void wait_over_stance(GaitShared& gait, const SolePose& sole) const noexcept;

  StepGoal goal_;
  StepTry tried_;
  Swing path_;  // odometry
  SwingTiming timing_;
  Vec2 zmp_stance_m_ = Vec2::Zero();     // plan frame
  Vec3 odom_off_path_m_ = Vec3::Zero();  // horizontally, from where the path begins to where the foot stood
  double turn_tick_ = 0.0;               // of the path, where the foot turned back
  double heel_up_rad_ = 0.0;             // as it lifted off
  TouchEvidence touch_;
  EarlyTouch early_touch_;
  std::int64_t felt_stamp_ns_ = 0;   // of the last sample in it
  std::int32_t unjudged_ticks_ = 0;  // for which no error tells of a fall
  bool leg_was_mute_ = false;        // a drive of it, for good
  bool lowers_body_ = false;         // since the leg does not lower its foot
  bool unloaded_ = false;            // the foot was felt to leave the ground
};

}  // namespace polygmap
