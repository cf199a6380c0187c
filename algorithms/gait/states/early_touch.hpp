// SPDX-License-Identifier: Apache-2.0
// Whether what a swinging foot feels above its target is the ground. A leg that accelerates feigns some tens of
// newtons: where it presses no harder, the foot stops, and stands on the ground if it still feels it then.
#pragma once

#include "algorithms/gait/states/touch_evidence.hpp"

namespace polygmap {

class EarlyTouch {
 public:
  struct Params {
    double from_m = 0.005;
    double certain_n = 120.0;
    std::int32_t samples = 10;

    static void visit(auto& p, auto& field) {
      field("from_m", p.from_m, 0.0, 0.1, "Contact this far above the target counts as early.");
      // 2026-11-26, climbs with all errors doubled: 34 N at most in the air, 50 N hurried. Real treads: 280 N and more.
      field("certain_n", p.certain_n, 0.0, 500.0, "No acceleration of the leg feigns a contact that presses more.");
      field(
          "samples", p.samples, 0, 500,
          "The foot stops for an early contact that presses less than `certain_n`, and lands if it is still felt after "
          "so many samples.");
    }
  };

  void release() noexcept {
    samples_ = 0;
    lands_ = false;
  }
  // The sample that touch took last.
  void take(const Params& params, const TouchEvidence::Params& evidence, const TouchEvidence& touch,
            double force_n) noexcept {
    if (samples_ > 0 ? !touch.likely(evidence) : !touch.touches(evidence, true)) return release();
    ++samples_;
    lands_ = touch.touches(evidence, false) && (force_n >= params.certain_n || samples_ > params.samples);
    if (!lands_ && stopped_ <= 3 * params.samples) ++stopped_;
    may_stop_ = stopped_ <= 3 * params.samples;
  }
  [[nodiscard]] bool lands() const noexcept { return lands_; }
  // The foot is to stand still meanwhile.
  [[nodiscard]] bool stops() const noexcept { return samples_ > 0 && !lands_ && may_stop_; }

 private:
  std::int32_t samples_ = 0;  // since the first that told of it
  std::int32_t stopped_ = 0;  // samples of this swing that stopped the foot: a scrape at every start is to end
  bool may_stop_ = true;
  bool lands_ = false;
};

}  // namespace polygmap
