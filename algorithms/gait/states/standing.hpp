// SPDX-License-Identifier: Apache-2.0
// Both feet stand and nothing is planned: the body settles between them, and looks for a step. Before the first step
// onto the stairs it stands tall for a while, so that the camera sees the toes.
#pragma once

#include "algorithms/gait/states/between_feet.hpp"

namespace polygmap {

class Standing {
 public:
  void begin(const GaitInput& in, GaitShared& gait) noexcept;
  [[nodiscard]] Transition tick(const GaitInput& in, GaitShared& gait) noexcept;
  void follow(const GaitInput& in, GaitShared& gait) noexcept { rest_.follow(in, gait); }
  // What is left of it when the gait ends here: tall no more.
  [[nodiscard]] BetweenFeet end(const GaitInput& in, GaitShared& gait) noexcept;

 private:
  void begin_toe_calibration(const GaitInput& in, GaitShared& gait, Foot leading) noexcept;
  // unsteady: the reason where what is decided keeps changing.
  [[nodiscard]] Transition wait(const GaitShared& gait, const ClimbPlanner::Decision& decision,
                                StopReason unsteady) noexcept;

  BetweenFeet rest_;
  struct {
    bool active = false;
    Foot leading = Foot::kLeft;  // with which the step after it is to begin
  } toe_calibration_;
  StopReason waiting_for_ = StopReason::kNone;
  std::int32_t wait_ticks_ = 0;  // for that reason, without a break
};

// Finished or stopped, on two feet.
class End {
 public:
  End() noexcept = default;
  explicit End(const BetweenFeet& rest) noexcept : rest_(rest) {}
  void follow(const GaitInput& in, GaitShared& gait) noexcept { rest_.follow(in, gait); }

 private:
  BetweenFeet rest_;
};

}  // namespace polygmap
