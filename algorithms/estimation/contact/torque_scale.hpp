// SPDX-License-Identifier: Apache-2.0
// How many newton metres the drives tell, and have to be told, for each that the legs need. Motors that give less than
// their data sheet says feel a heavier robot than the masses make, as do those that carry a load nobody told of: either
// takes that many times the torques.
#pragma once

#include <algorithm>
#include <cmath>

#include "algorithms/core/math/math.hpp"

namespace polygmap {

class TorqueScale {
 public:
  struct Params {
    double time_s = 2.0;
    double begin_s = 0.1;
    double unsure = 0.05;
    double most = 0.3;
    double pressed_n = 60.0;

    static void visit(auto& p, auto& field) {
      field("time_s", p.time_s, 0.05, 60.0, "The felt weight is averaged over so long.");
      field("begin_s", p.begin_s, 0.01, 10.0, "In the beginning over the time since then, and this.");
      field("unsure", p.unsure, 0.001, 0.3,
            "The felt weight is wrong itself by this share, 3 to 5 % too low by the observed force's damping: what "
            "differs by less changes nothing, what differs by twice as much counts in full.");
      field("most", p.most, 0.0, 0.5, "It differs from what the masses make by no more than this share.");
      field("pressed_n", p.pressed_n, 1.0, 500.0, "The weight is felt while both feet are pressed by more than this.");
    }
  };
  // Some time on both feet. felt_n: on both feet, by torques that were divided by scale(). weight_n: as masses and
  // motion make it.
  void update(const Params& params, double felt_n, double weight_n, double dt_s) noexcept {
    const double share = scale_ * felt_n / weight_n;
    if (!(share > 0.5 && share < 2.0)) return;  // it is pushed, falls or hangs
    seen_s_ = std::min(seen_s_ + dt_s, params.time_s);
    const double gain = dt_s / std::min(params.begin_s + seen_s_, params.time_s);
    felt_share_ += gain * (share - felt_share_);
    const double off = felt_share_ - 1.0;
    const double counts = math::clamp(std::abs(off) / params.unsure - 1.0, 0.0, 1.0);
    scale_ = 1.0 + math::clamp(counts * off, -params.most, params.most);
  }
  [[nodiscard]] double scale() const noexcept { return scale_; }
  // It has followed the felt weight for a while.
  [[nodiscard]] bool is_settled(const Params& params) const noexcept {
    return seen_s_ >= std::min(4.0 * params.begin_s, params.time_s);
  }

 private:
  double felt_share_ = 1.0;
  double scale_ = 1.0;
  double seen_s_ = 0.0;
};

}  // namespace polygmap
