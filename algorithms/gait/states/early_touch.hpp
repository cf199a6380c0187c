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
    stops_ = lands_ = false;
  }
  // The sample that touch took last.
  void take(const Params& params, const TouchEvidence::Params& evidence, const TouchEvidence& touch,
            double force_n) noexcept {
    if (samples_ > 0 ? !touch.likely(evidence) : !touch.touches(evidence, true)) return release();
    ++samples_;
    const bool may_stop = stopped_ < kMostStops * params.samples;
    const bool still_felt = may_stop && samples_ > params.samples;
    lands_ = touch.touches(evidence, false) && (force_n >= params.certain_n || still_felt);
    stops_ = may_stop && !lands_;
    if (stops_) ++stopped_;
  }
  [[nodiscard]] bool lands() const noexcept { return lands_; }
  // The foot is to stand still meanwhile.
  [[nodiscard]] bool stops() const noexcept { return stops_; }

 private:
  // A scrape that begins again whenever the foot goes on stops it no more after so many whole stops of a swing: then
  // only what presses by certain_n is the ground.
  static constexpr std::int32_t kMostStops = 3;

  std::int32_t samples_ = 0;  // since the first that told of it
  std::int32_t stopped_ = 0;  // samples of this swing that stopped the foot
  bool stops_ = false;
  bool lands_ = false;
};

}  // namespace polygmap
