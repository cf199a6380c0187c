// SPDX-License-Identifier: Apache-2.0
// The gait: walks up to the stairs, climbs them in either of the paper's gaits, ends by itself.
#pragma once

#include <array>
#include <variant>

#include "algorithms/core/messages/footholds.hpp"
#include "algorithms/core/messages/gait_plan.hpp"
#include "algorithms/core/messages/gait_status.hpp"
#include "algorithms/core/messages/state.hpp"
#include "algorithms/gait/balance/balance.hpp"
#include "algorithms/gait/footsteps/climb_planner.hpp"
#include "algorithms/gait/joints/joint_reference.hpp"
#include "algorithms/gait/states/standing.hpp"
#include "algorithms/gait/states/swing_phase.hpp"
#include "algorithms/gait/states/weight_shift.hpp"

namespace polygmap {

// A state machine of four states, each a type, over one plan of the body; and from the plan to the drives.
class Gait {
 public:
  using Params = GaitParams;

  // robot: outlives the gait.
  void reset(const Params& params, const RobotModel& robot) noexcept;
  // One 500 Hz tick: state machine, trajectories, leg kinematics, joint command. footholds: the newest finished search.
  // Without fresh samples a swing is finished as it was planned; then the gait stops on two feet.
  void tick(std::int64_t now_ns, const StateEstimate& state, const FootholdSet& footholds,
            const JointFeedback& feedback, JointCommand& command) noexcept;
  [[nodiscard]] const GaitStatus& status() const noexcept { return status_; }
  // What it means to do, as of the last tick. Costs some tens of microseconds, and nothing of it is made in the cycle.
  void tell_plan(GaitPlan& plan) const noexcept;
  [[nodiscard]] const Balance& balance() const noexcept { return balance_; }
  // Finishes the committed step, or puts its foot back where the operator asks so early (SwingParams), then holds in
  // double support. From the thread of tick().
  void request_stop(StopReason reason) noexcept {
    if (stop_requested_ == StopReason::kNone) stop_requested_ = reason;
    // After the climb's end no state is left that would take the reason over.
    if (status_.phase == GaitPhase::kFinished) status_.stop_reason = stop_requested_;
  }
  // No foot is lifted from now on; true again: it goes on. From the thread of tick().
  void allow_steps(bool may_step) noexcept { may_step_ = may_step; }
  // Goes there, or where it cannot stops; from the first tick on in which it knows where it stands. From the thread of
  // tick().
  void go_to(const Destination& destination) noexcept { planner_.go_to(destination); }
  [[nodiscard]] bool goes_to() const noexcept { return planner_.goes_to(); }
  // Up the stairs that it sees, until they end.
  void climb() noexcept { planner_.climb(); }
  // After its end, finished or stopped, with both feet on the ground: it stands, and looks for a step. Where it stands
  // and how many treads it has climbed stays. False, and nothing happens: there are joints_away().
  [[nodiscard]] bool try_restart(const JointVector& q_rad) noexcept;
  // Those that are not where they were commanded to be, or not finite.
  [[nodiscard]] JointSet joints_away(const JointVector& q_rad) const noexcept;
  [[nodiscard]] bool stop_requested() const noexcept { return stop_requested_ != StopReason::kNone; }
  // Before its first good reading it commands no gains and no torques.
  [[nodiscard]] bool armed() const noexcept { return armed_; }

 private:
  [[nodiscard]] GaitShared shared() noexcept { return {*robot_, params_, plan_, planner_, memory_, status_}; }
  // Without one good reading the drives get no stiffness: there is nothing safe to ask of them.
  [[nodiscard]] bool try_arm(const JointFeedback& feedback) noexcept;
  void judge_ground(const StateEstimate& state) noexcept;
  void take_turn(const StateEstimate& state) noexcept;
  void hold_upright(const GaitInput& in, JointCommand& command) noexcept;
  void advance(const GaitInput& in) noexcept;
  [[nodiscard]] Transition tick_state(const GaitInput& in, GaitShared& gait) noexcept;
  void enter(const GaitInput& in, GaitShared& gait, const Transition& next) noexcept;
  void end(const GaitInput& in, GaitShared& gait, const Transition& next) noexcept;
  void follow_state(const GaitInput& in, GaitShared& gait) noexcept;
  void observe_links() noexcept;
  void add_torques(const StateEstimate& state, const JointFeedback& feedback, bool usable,
                   JointCommand& command) noexcept;

  Params params_;
  const RobotModel* robot_ = nullptr;
  ClimbPlanner planner_;
  BodyPlan plan_;
  JointReference joints_;
  Balance balance_;
  LinkMotion::Acceleration link_acceleration_;
  Vec2 dcm_error_m_ = Vec2::Zero();  // of the divergent component, as last measured, odometry
  GaitMemory memory_;
  GaitStatus status_;
  std::variant<Standing, WeightShift, SwingPhase, End> state_;
  std::int64_t last_tick_ns_ = 0;
  bool armed_ = false;          // the joint angles are known
  bool placed_ = false;         // so is how the body leans
  bool started_ = false;        // and where it is
  bool leg_impaired_ = false;   // a drive or a foot was silent so long that the gait stops, whatever it says later
  bool lost_in_swing_ = false;  // so was the estimate; the foot in the air came down all the same
  bool restarts_ = false;       // with the next tick
  bool may_step_ = true;
  StopReason stop_requested_ = StopReason::kNone;
};

}  // namespace polygmap
