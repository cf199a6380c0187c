// SPDX-License-Identifier: Apache-2.0
// The search for a shape of a step that both legs can do.
#pragma once

#include "algorithms/gait/trajectories/step_feasibility.hpp"

namespace polygmap {

// kKnotsPerCall knots per call. A leading or passing step is only offered when the trailing step after it is possible
// too. Every call is given the same robot and parameters.
class StepSearch {
 public:
  enum class State : std::uint8_t { kSearching, kFound, kImpossible };
  static constexpr std::int32_t kKnotsPerCall = 2;  // as many as a tick of the gait has room for
  static constexpr std::int32_t kLookAhead = 2;     // as far apart are the knots of a step that is proved again later

  // trailing: the goal of the step after one that leads; ignored otherwise. shift_ticks: of the shift before the goal's
  // swing, as it will be done.
  void begin(const RobotModel& robot, const StepParams& params, const StepGoal& goal, const StepGoal& trailing,
             std::int32_t shift_ticks, const TorsoTrajectory::State& from,
             const std::array<Transform, kFootCount>& soles) noexcept;
  State step(const RobotModel& robot, const StepParams& params) noexcept;
  [[nodiscard]] State state() const noexcept { return state_; }
  [[nodiscard]] bool leading_found() const noexcept { return leading_found_; }  // then it is the one after that fails
  [[nodiscard]] const StepPlan& plan() const noexcept { return plan_; }

 private:
  void next_try() noexcept;
  void try_candidate(const RobotModel& robot, const StepParams& params) noexcept;
  [[nodiscard]] bool leads_on(const RobotModel& robot, const StepParams& params) const noexcept;

  StepTries tries_ = kStepTries;
  StepGoal goal_, trailing_;
  TorsoTrajectory::State from_{};
  std::array<Transform, kFootCount> soles_;
  StepPlan plan_;       // the offered one, of goal_
  StepPlan candidate_;  // under proof
  StepFeasibility proof_;
  HorizontalMotion com_landed_;  // after the leading swing
  TorsoPose torso_landed_;
  std::int32_t shift_ticks_ = 1;
  std::size_t try_ = 0;
  bool leading_found_ = false;
  State state_ = State::kImpossible;
};

}  // namespace polygmap
