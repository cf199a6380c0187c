// SPDX-License-Identifier: Apache-2.0
// How fast a swing runs along its path, and how far beside it: as planned, unless the body topples towards the free
// foot (one sole cannot hold that; the free foot has to be there in time, or back) or the ground is late (the weight is
// on its way).
#pragma once

#include <algorithm>

#include "algorithms/gait/blend.hpp"

namespace polygmap {

class SwingPace {
 public:
  struct Params {
    double topples_m = 0.02;   // of the divergent component's error towards the free foot:
    double hurry = 1.6;        // beyond, the foot goes so many times as fast,
    double turn_share = 0.38;  // or back, earlier in the swing than this;
    double wider_m = 0.06;     // and it lands that much farther out
    double wider_mps = 0.25;
    std::int32_t late_ticks = 10;  // after the path's end it goes down
    double seek = 5.0;             // so many times as fast
  };

  void begin() noexcept { *this = {}; }
  // One tick. toppling_m: of the divergent component's error, towards the free foot. may_turn_back: not where the feet
  // would stand one behind the other.
  void advance(const Params& params, double toppling_m, bool may_turn_back, std::int32_t duration_ticks) noexcept {
    if (!topples_ && toppling_m > params.topples_m) {
      topples_ = true;
      turns_back_ = may_turn_back && tick_ < params.turn_share * duration_ticks;
    }
    constexpr double kHarderPerTick = 0.05;
    const double usual = tick_ > duration_ticks + params.late_ticks ? params.seek : topples_ ? params.hurry : 1.0;
    const double wanted = turns_back_ ? -1.0 : usual;
    pace_ += math::clamp(wanted - pace_, -kHarderPerTick, kHarderPerTick);
    tick_ += pace_;
    if (topples_ && !turns_back_) wider_m_ = std::min(wider_m_ + params.wider_mps * kTick_s, params.wider_m);
  }

  [[nodiscard]] double tick() const noexcept { return tick_; }               // of the path
  [[nodiscard]] double last_tick() const noexcept { return tick_ - pace_; }  // before that
  [[nodiscard]] bool turns_back() const noexcept { return turns_back_; }
  [[nodiscard]] double wider_m() const noexcept { return wider_m_; }  // away from the standing foot

 private:
  double tick_ = 0.0;
  double pace_ = 1.0;
  double wider_m_ = 0.0;
  bool topples_ = false;
  bool turns_back_ = false;
};

}  // namespace polygmap
