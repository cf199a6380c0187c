// SPDX-License-Identifier: Apache-2.0
// The weight moves over the stance foot, while the step that is to follow is proved.
#pragma once

#include "algorithms/gait/states/crouch.hpp"
#include "algorithms/gait/trajectories/step_search.hpp"

namespace polygmap {

class WeightShift {
 public:
  // same_foot: the weight is over the stance foot already.
  void begin(const GaitInput& in, GaitShared& gait, const ClimbPlanner::Decision& decision, bool same_foot) noexcept;
  [[nodiscard]] Transition tick(const GaitInput& in, GaitShared& gait) noexcept;
  void follow(const GaitInput& in, GaitShared& gait) noexcept;
  // After this tick: the step that is to follow. Its foot lifts no sooner, and later where the body is not steady.
  [[nodiscard]] StepAhead ahead() const noexcept;

 private:
  [[nodiscard]] Transition legs_cannot(const GaitInput& in, GaitShared& gait) const noexcept;
  [[nodiscard]] bool close_to_planned(const WeightShiftParams& params, const StepGoal& goal) const noexcept;
  // Over the stance foot for a moment more, then back: one lost frame is no reason to.
  [[nodiscard]] Transition wait(const WeightShiftParams& params) const noexcept {
    return tick_ > shift_ticks_ + params.reshift_ticks ? Transition::stand() : Transition{};
  }

  ClimbPlanner::Decision decision_;
  StepSearch search_;
  Crouch crouch_;
  std::int32_t tick_ = 0;
  std::int32_t shift_ticks_ = 0;
  std::int32_t swing_ticks_ = 0;  // of the shape that is tried first
};

}  // namespace polygmap
