// SPDX-License-Identifier: Apache-2.0
// The body settles between its feet and stays there; where an ankle has not the range for that, nearer to the upper
// foot.
#pragma once

#include "algorithms/gait/states/crouch.hpp"

namespace polygmap {

class BetweenFeet {
 public:
  // Sets out from where the plan is. height_m: of the torso above the higher sole, where both legs reach so far.
  void settle(const GaitInput& in, GaitShared& gait, double height_m) noexcept;
  // Every tick, the first included.
  void follow(const GaitInput& in, GaitShared& gait) noexcept;
  [[nodiscard]] std::int32_t tick() const noexcept { return tick_; }  // since it set out

 private:
  struct Rest {
    TorsoPose base;
    Vec2 com_m;
  };
  // Plan frame.
  [[nodiscard]] Rest rest(const GaitShared& gait, const TorsoParams& torso) const noexcept;
  void rise(GaitShared& gait) noexcept;

  Crouch crouch_;
  std::int32_t tick_ = 0;
};

}  // namespace polygmap
