// SPDX-License-Identifier: Apache-2.0
// What the gait's states are given, what they share, and what they answer. A state is constructed afresh when it is
// entered; whatever outlives it stands here.
#pragma once

#include <algorithm>
#include <optional>

#include "algorithms/core/messages/gait_status.hpp"
#include "algorithms/gait/states/body_plan.hpp"

namespace polygmap {

// Ticks saturate far beyond every duration.
[[nodiscard]] constexpr std::int32_t next_tick(std::int32_t tick) noexcept { return std::min(tick + 1, 1'000'000); }

// Of one tick.
struct GaitInput {
  std::int64_t now_ns;
  const StateEstimate& state;
  const FootholdSet& footholds;  // the newest finished search
  const JointFeedback& feedback;
  const JointReference& joints;  // as last commanded
  Vec2 odom_dcm_error_m;         // of the divergent component, as last measured
  bool usable;                   // the estimate is fresh, and all of it numbers
  bool mute;                     // it would be, but for drives or feet that are silent while others speak
  bool leg_impaired;             // that lasted for so long that the gait stops; for good
  bool held;                     // either: the body stays where it is, and the states' clocks stand still
  bool lost;                     // the estimate is, or in this swing was, so old that the gait stops; or leg_impaired
  StopReason stop_requested;     // kNone: it is not
  bool may_step;                 // false: a foot in the air comes down, no other is lifted
  std::int64_t since_last_ns;    // since the last tick: the plan stood still, and the body did not
};

struct GaitMemory {
  std::int32_t shifts = 0;                   // since the last swing
  std::int32_t idle_ticks = 0;               // without a step to do since the last swing
  std::int32_t obstacle_ticks = 0;           // of them, with an obstacle in the way
  bool rests_first = false;                  // the next step begins from rest between the feet
  std::int32_t refusals = 0;                 // of steps that the legs could not do, since the last swing
  std::uint32_t aborted_swings = 0;          // since the last foot that landed
  bool thrown = false;                       // the body, by the error of its divergent component
  bool toes_calibrated = false;              // stood tall for it, or need not
  Mat3 left_R_right_met = Mat3::Identity();  // of the soles, when the gait was armed
  bool soft_ground = false;                  // it gave way under them before the standstill was over
};

struct GaitShared {
  const RobotModel& robot;
  const GaitParams& params;
  BodyPlan& plan;
  ClimbPlanner& planner;
  GaitMemory& memory;
  GaitStatus& status;
};

// Where the soles are, not where the plan has them: legs that carry more than believed give way by some millimetres.
// leads: the weight is on its way for a leading step of that foot.
[[nodiscard]] inline ClimbPlanner::Situation situation(const GaitInput& in, bool leads = false,
                                                       Foot leading = Foot::kLeft) noexcept {
  return {in.now_ns, {sole_pose(in.state.odom_T_sole[0]), sole_pose(in.state.odom_T_sole[1])}, leads, leading};
}

// Before the first leading step the toes are looked at, once.
[[nodiscard]] inline bool needs_toe_calibration(const GaitShared& gait, const StepGoal& goal) noexcept {
  return !gait.memory.toes_calibrated && goal.kind == StepKind::kLeading && gait.planner.treads_climbed() == 0;
}

// The next step, as a state knows it; ticks from the one that is over.
struct StepAhead {
  const StepGoal* goal = nullptr;
  const StepGoal* after = nullptr;  // the step that may come after it; null: none is thought of
  std::int32_t lift_off_ticks = 0;  // 0: its foot is in the air
  std::int32_t swing_ticks = 0;     // from then on, of one in the air from now on
  bool returns = false;             // its foot goes back, at no planned time,
  Transform back_to;                // to there
};

// What a state wants next.
struct Transition {
  enum class To : std::uint8_t { kStay, kStanding, kWeightShift, kSwing, kEnd };
  To to = To::kStay;
  bool same_foot = false;                 // of a shift: the weight is over the stance foot already
  GaitPhase phase = GaitPhase::kStopped;  // of an end, both feet standing:
  StopReason reason = StopReason::kNone;  // why,
  double measured_m = 0.0;                // and the rise, tread or slope behind it
  std::optional<ClimbPlanner::Decision> decision = std::nullopt;  // of a shift or a swing
  std::optional<StepTry> tried = std::nullopt;                    // of a swing: the shape that the legs can do

  [[nodiscard]] static Transition stand() noexcept { return {.to = To::kStanding}; }
  [[nodiscard]] static Transition shift(const ClimbPlanner::Decision& decision, bool same_foot) noexcept {
    return {.to = To::kWeightShift, .same_foot = same_foot, .decision = decision};
  }
  [[nodiscard]] static Transition swing(const ClimbPlanner::Decision& decision, const StepTry& tried) noexcept {
    return {.to = To::kSwing, .decision = decision, .tried = tried};
  }
  [[nodiscard]] static Transition stop(StopReason reason, double measured_m = 0.0) noexcept {
    return {.to = To::kEnd, .reason = reason, .measured_m = measured_m};
  }
  [[nodiscard]] static Transition finish() noexcept { return {.to = To::kEnd, .phase = GaitPhase::kFinished}; }
};

}  // namespace polygmap
