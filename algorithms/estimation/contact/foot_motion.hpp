// SPDX-License-Identifier: Apache-2.0
// Does a foot that is said to stand slip? Its speed over the ground, as the base is predicted and its leg measured.
//
// Of two feet that stand, each is the other's witness: none is let go unless they move against each other, whatever the
// IMU says of the base. One that stands alone has the IMU as its only witness, so only what is far beyond what the feet
// of this robot usually seem to move by is a slip. A foot that slips is let go by as much as it moves, a continuous
// function, and for a limited time: a contact that never rests is the estimate's error.
#pragma once

#include <array>

#include "algorithms/core/math/math.hpp"
#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

class FootMotion {
 public:
  struct Params {
    // Play of half a degree in hip and knee moves a foot by 5 mm, in 30 to 60 ms and back later: no slip. With 20 ms
    // the quicker way of the two was one, and every swing left the estimate 5 mm off. Chosen in simulated climbs with
    // such play; the logs of docs/measured/estimation.md hardly differ from 20 to 60 ms, but where a foot is made to
    // slip by 60 mm (Cassie 3.9, 4.8 and 5.7 mm with 20, 50 and 60 ms).
    double window_s = 0.05;
    double slip_mps = 0.2;
    double alone_slip_mps = 0.15;
    double usual_mps = 0.08;
    double usual_s = 1.0;
    double usual_times = 2.5;
    double usual_share = 0.6;
    double gain = 20.0;
    double most_s = 0.4;

    static void visit(auto& p, auto& field) {
      field("window_s", p.window_s, 0.002, 0.5, "The measured speed of a foot is averaged over this.");
      field("slip_mps", p.slip_mps, 0.01, 10.0, "Two feet that stand and move apart faster: one of them slips.");
      field("alone_slip_mps", p.alone_slip_mps, 0.01, 10.0, "A foot that stands alone slips at no lower speed.");
      field("usual_mps", p.usual_mps, 0.0, 10.0, "Speed by which a foot that stands alone seems to move at the start.");
      field("usual_s", p.usual_s, 0.01, 1000.0, "That speed is averaged over this.");
      field("usual_times", p.usual_times, 1.0, 100.0,
            "A foot that stands alone slips beyond so many times that speed.");
      field("usual_share", p.usual_share, 0.1, 1.0, "What counts for that average, at most, of a slip's speed.");
      field("gain", p.gain, 0.0, 100.0,
            "The random walk that a slip stands for is this times its speed squared times the window.");
      field("most_s", p.most_s, 0.0, 100.0, "A contact is let go for no longer than this.");
    }
  };
  void reset(const Params& params) noexcept;

  // By how much a foot moved and turned over the ground in one step, the base as predicted from the last corrected
  // state.
  struct Step {
    bool rests = false;  // from the step's beginning on: it is not in the air and has not just landed
    bool sole_known = false;
    Vec3 odom_m = Vec3::Zero(), odom_rad = Vec3::Zero();
    Vec3 odom_from_base_m = Vec3::Zero();
  };
  void update(const std::array<Step, kFootCount>& steps, double dt_s) noexcept;

  // By which a standing foot seems to move over the ground, whether it is let go or not.
  [[nodiscard]] double speed_mps(std::size_t foot) const noexcept { return feet_[foot].speed_mps; }
  // Random walk of the contact that its slip stands for, m^2/s, 0 at rest.
  [[nodiscard]] double walk_m2ps(std::size_t foot) const noexcept { return feet_[foot].walk_m2ps; }

 private:
  struct Track {
    Vec3 odom_v_mps = Vec3::Zero(), odom_w_radps = Vec3::Zero();
    double age_s = 0.0, let_go_s = 0.0;
    double speed_mps = 0.0;
    double walk_m2ps = 0.0;
  };
  void let_go(Track& track, double speed_mps, double slip_mps, double dt_s) noexcept;

  Params params_;
  std::array<Track, kFootCount> feet_{};
  double usual_m2ps2_ = 0.0;
};

}  // namespace polygmap
