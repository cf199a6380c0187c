// SPDX-License-Identifier: Apache-2.0
// Which feet stand, from force and phase. A force alone comes late and goes late; the plan alone does not know the
// ground.
#pragma once

#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

struct FootContact {
  double probability = 0.0;  // that the foot rests on the ground
  double load_share = 0.5;   // of the force on both feet
  bool stands = false;       // from certainty until nothing is left of it
  bool landed = false;       // began to stand in this tick
  double walk_m2ps = 0.0;    // random walk that its motion over the ground stands for (FootMotion)
};

class ContactEstimator {
 public:
  struct Params {
    double force_air_n = 10.0;
    double force_standing_n = 25.0;
    double settle_s = 0.006;
    double stated_standing = 0.5;
    double stated_air = 0.4;
    double flicker_s = 0.003;
    double stuck_swing_s = 0.15;

    static void visit(auto& p, auto& field) {
      field("force_air_n", p.force_air_n, 0.0, 200.0, "A foot that presses no harder is in the air.");
      field("force_standing_n", p.force_standing_n, 1.0, 500.0,
            "A foot that presses as hard stands; one that touches weighs at least its own leg.");
      field.ordered("force_air_n", "force_standing_n");
      field("settle_s", p.settle_s, 0.001, 0.1,
            "A contact's probability rises from 0 to 1 in this time at the earliest, which blanks the impact.");
      field("stated_standing", p.stated_standing, 0.05, 1.0, "A foot whose stated probability is as high stands.");
      field("stated_air", p.stated_air, 0.0, 0.95,
            "A foot that stands does so until its stated probability falls below this.");
      field.ordered("stated_air", "stated_standing");
      field("flicker_s", p.flicker_s, 0.001, 0.1, "A stated contact that ends fades in this time.");
      field("stuck_swing_s", p.stuck_swing_s, 0.02, 2.0,
            "A planned swing whose force has not gone away for so long stands after all.");
    }
  };
  void reset(const Params& params) noexcept;
  // planned_stance releases a foot at once at lift-off (forces lag); once unloaded, force alone brings it back, so an
  // early touch-down counts. A foot whose force is not told, not a number, stands as planned.
  void update(const std::array<double, kFootCount>& force_n, const std::array<bool, kFootCount>& planned_stance,
              std::int64_t stamp_ns) noexcept;
  // The same for contacts as a log states them, a probability or 0 and 1. A drop of some milliseconds is bridged: a
  // foot that really lifts is seen to move.
  void update_stated(const std::array<double, kFootCount>& probability, std::int64_t stamp_ns) noexcept;
  [[nodiscard]] const std::array<FootContact, kFootCount>& feet() const noexcept { return feet_; }

 private:
  Params params_;
  std::array<FootContact, kFootCount> feet_{};
  std::array<bool, kFootCount> was_planned_{true, true};
  std::array<bool, kFootCount> unloaded_{};
  std::array<std::int64_t, kFootCount> swing_since_ns_{};
  std::int64_t stamp_ns_ = -1;
};

}  // namespace polygmap
