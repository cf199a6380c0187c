// SPDX-License-Identifier: Apache-2.0
// How heavy the robot is in its drives' own newtons. Motors that give less than their data sheet says feel a heavier
// robot than the masses make, as do those that carry a load nobody told of: either takes that many times the torques.
#pragma once

#include <algorithm>

#include "algorithms/core/math/math.hpp"

namespace polygmap {

class FeltWeight {
 public:
  struct Params {
    double time_s = 2.0;
    double begin_s = 0.1;
    double most = 0.3;

    static void visit(auto& p, auto& field) {
      field("time_s", p.time_s, 0.05, 60.0, "The felt weight is averaged over so long.");
      field("begin_s", p.begin_s, 0.01, 10.0, "In the beginning over the time since then, and this.");
      field("most", p.most, 0.0, 0.5, "It differs from what the masses make by no more than this share.");
    }
  };
  // One tick on both feet. felt_n: on both feet, as the torques tell. expected_n: as masses and motion make it.
  void update(const Params& params, double felt_n, double expected_n, double tick_s) noexcept {
    const double share = felt_n / expected_n;
    if (!(share > 0.5 && share < 2.0)) return;  // it is pushed, falls or hangs
    seen_s_ = std::min(seen_s_ + tick_s, params.time_s);
    const double gain = tick_s / std::min(params.begin_s + seen_s_, params.time_s);
    share_ += gain * (share - share_);
    share_ = math::clamp(share_, 1.0 - params.most, 1.0 + params.most);
  }
  // Of the weight that the masses make.
  [[nodiscard]] double share() const noexcept { return share_; }

 private:
  double share_ = 1.0;
  double seen_s_ = 0.0;
};

}  // namespace polygmap
