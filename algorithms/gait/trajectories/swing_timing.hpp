// SPDX-License-Identifier: Apache-2.0
// How fast a swing runs along its path, and how far beside it: as planned, unless the body topples towards the free
// foot (one sole cannot hold that; the free foot has to be there in time, or back) or ahead, the ground is late (the
// weight is on its way) or is not there (back to where the foot stood). A straight path, on which a foot lands sooner,
// is hurried while the body falls outward, up to `speed_up`, and slowed to what its drives have. A foot that may have
// touched above its target stops.
#pragma once

#include <algorithm>

#include "algorithms/core/math/math.hpp"
#include "algorithms/core/time.hpp"

namespace polygmap {

class SwingTiming {
 public:
  struct Params {
    double falling_outward_m = 0.025;
    double falling_ahead_m = 0.05;
    double speed_up = 1.6;
    // Chosen on 91 pushed climbs of the simulation (2026-11-28), and tried on no robot.
    double widen_m = 0.08;
    double widen_mps = 0.25;
    std::int32_t late_ticks = 10;
    double descend_search = 5.0;
    std::int32_t pause_ticks = 200;
    double retreat = 0.5;
    double pace_per_tick = 0.05;

    static void visit(auto& p, auto& field) {
      field("falling_outward_m", p.falling_outward_m, 0.001, 0.5,
            "The body falls outward when the divergent component's error towards the free foot is larger.");
      field("falling_ahead_m", p.falling_ahead_m, 0.001, 0.5,
            "The body falls ahead when that error forwards is larger: its foot hurries on.");
      field("speed_up", p.speed_up, 1.0, 5.0,
            "The foot of a body that falls goes this many times as fast where its drives can.");
      field("widen_m", p.widen_m, 0.0, 0.3, "The foot of a body that falls outward lands this much farther out.");
      field("widen_mps", p.widen_mps, 0.0, 2.0, "The foot goes farther out at this speed.");
      field("late_ticks", p.late_ticks, 0, 500,
            "The foot searches downwards for the ground so long after the path's end.");
      field("descend_search", p.descend_search, 0.1, 20.0,
            "The foot searches downwards this many times as fast as its path ends.");
      field("pause_ticks", p.pause_ticks, 0, 2000, "The foot waits for so long where there is no ground.");
      field("retreat", p.retreat, 0.05, 2.0,
            "A foot that found no ground goes back this many times as fast, since the torso is elsewhere.");
      field("pace_per_tick", p.pace_per_tick, 0.001, 1.0,
            "The foot's pace, one as planned, changes by no more from tick to tick: what the drives accelerate.");
    }
  };
  // What decides on a tick.
  struct Seen {
    double falling_outward_m = 0.0;  // of the divergent component's error, towards the free foot
    double falling_ahead_m = 0.0;    // forwards
    double turn_until_tick = 0.0;    // of the path: earlier a foot may still go back to where it stood
    double drive_share = 0.0;        // of the leg's fastest drive in the last tick, over its limit
    double side_room_m = 1e9;        // beside the target, away from the standing foot
    bool wanted_back = false;        // to where it stood, however the body stands
    bool may_hurry = true;           // its drives are all there
    bool stopped = false;            // while it is judged whether the foot touches above its target
  };

  void begin() noexcept { *this = {}; }
  void advance(const Params& params, const Seen& seen, std::int32_t duration_ticks) noexcept {
    if (no_ground_) {
      widened_m_ = std::max(widened_m_ - params.widen_mps * kTick_s, 0.0);
      pace_ = --pause_ticks_ >= 0 ? 0.0 : -params.retreat;
      tick_ += pace_;
      return;
    }
    // Falling is over at half of what it began with: noise is to change no pace back and forth.
    falls_outward_ = seen.falling_outward_m > (falls_outward_ ? 0.5 : 1.0) * params.falling_outward_m;
    if (!fell_outward_ && falls_outward_) {
      fell_outward_ = true;
      turns_back_ = tick_ < seen.turn_until_tick;
    }
    fell_ahead_ = fell_ahead_ || seen.falling_ahead_m > params.falling_ahead_m;
    if (seen.wanted_back && !straight_) turns_back_ = true;
    // The drives are as fast as the pace is, about. The plan's own pace is proved for them, a straight path's is not:
    // it is hurried for as long as the body falls on.
    const double most = std::min(std::max(std::abs(pace_), params.pace_per_tick) / std::max(seen.drive_share, 1e-3),
                                 seen.may_hurry ? params.speed_up : 1.0);
    const double usual = tick_ > duration_ticks + params.late_ticks ? params.descend_search
                         : straight_                                ? (falls_outward_ ? most : std::min(most, 1.0))
                         : fell_outward_ || fell_ahead_             ? std::max(most, 1.0)
                                                                    : 1.0;
    const double wanted = turns_back_ ? -1.0 : usual;
    const bool stopped = seen.stopped && !turns_back_;
    pace_ = stopped ? 0.0 : pace_ + math::clamp(wanted - pace_, -params.pace_per_tick, params.pace_per_tick);
    tick_ += pace_;
    if (fell_outward_ && !turns_back_) {
      widened_m_ = std::min({widened_m_ + params.widen_mps * kTick_s, params.widen_m, std::max(seen.side_room_m, 0.0)});
    }
  }
  // From here on another path, which no plan proved for the drives.
  void begin_straight() noexcept {
    tick_ = 0.0;
    pace_ = 1.0;
    straight_ = true;
  }
  // Nothing was found down there.
  void retreat(const Params& params) noexcept {
    no_ground_ = true;
    pause_ticks_ = params.pause_ticks;
  }

  [[nodiscard]] double tick() const noexcept { return tick_; }               // of the path
  [[nodiscard]] double last_tick() const noexcept { return tick_ - pace_; }  // before that
  [[nodiscard]] double pace() const noexcept { return pace_; }               // ticks of the path in the last tick
  [[nodiscard]] bool goes_back() const noexcept { return turns_back_ || no_ground_; }
  // Of a body that fell outward, on the path it began with.
  [[nodiscard]] bool may_land_sooner() const noexcept { return fell_outward_ && !turns_back_ && !straight_; }
  [[nodiscard]] bool no_ground() const noexcept { return no_ground_; }
  [[nodiscard]] double widened_m() const noexcept { return widened_m_; }  // away from the standing foot

 private:
  double tick_ = 0.0;
  double pace_ = 1.0;
  double widened_m_ = 0.0;
  std::int32_t pause_ticks_ = 0;
  bool fell_outward_ = false;  // once in this swing
  bool falls_outward_ = false;
  bool fell_ahead_ = false;
  bool turns_back_ = false;
  bool straight_ = false;
  bool no_ground_ = false;
};

}  // namespace polygmap
