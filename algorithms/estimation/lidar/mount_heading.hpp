// SPDX-License-Identifier: Apache-2.0
// A lidar whose heading on the robot is not what the data sheet says bends the way it tells: tied to ours by its
// heading, LIO's world is turned by that much for good, 17 mm a metre for each degree. Its headings themselves are
// right by then, because the tie has the mount in it. So the way that legs tell, turned by LIO's headings, and LIO's
// way are apart by the mount's turn of the way since the tie, and by what legs drift to the side.
//
// That drift is taken for a random walk of the way walked, so on a straight way the newest offset says all there is to
// say of the mount, and it is shared out; on the way back what was learnt farther off is forgotten. Roll and pitch of
// the mount bend nothing: LIO's world is level.
#pragma once

#include "algorithms/core/math/transform.hpp"

namespace polygmap {

class MountHeading {
 public:
  struct Params {
    double sigma_rad = 0.01;
    double drift_mprm = 0.006;

    static void visit(auto& p, auto& field) {
      field("sigma_rad", p.sigma_rad, 0.0, 0.5,
            "Sigma of the heading of the lidar's mount, as installed; 0: it is as configured.");
      field("drift_mprm", p.drift_mprm, 1e-5, 0.1,
            "Legs drift to the side by this after a metre, besides what their heading does, and with the root of the "
            "way.");
    }
  };
  void reset(const Params& params) noexcept {
    *this = MountHeading{};
    params_ = params;
  }
  // The two worlds have been tied, as of a pose that comes late: the way counts from the next move on.
  void tie() noexcept {
    tied_ = seen_ = false;
    bend_ = {};
  }
  // LIO's newest pose has turned the odometry's heading, by a low-pass of this gain: what it turns now has been missing
  // for as long as that lags, so the way of that time turns along. The pose counts in the next move. variance_m2: of
  // its place against the legs' besides the mount's bend and what legs drift to the side.
  struct Seen {
    Vec3 world_p_base_m;
    double turn_rad, gain, variance_m2;
  };
  void see(const Seen& seen) noexcept;
  // Once per tick. The base as LIO has it; by which legs moved it, turned as LIO has it.
  void move(const Vec3& world_p_base_m, const Vec3& world_step_m) noexcept;

  struct Bend {
    Vec3 way_m = Vec3::Zero();  // part of LIO's way, world axes
    Vec3 variance_m2 = Vec3::Zero();
  };
  // As of LIO's newest pose.
  [[nodiscard]] const Bend& bend() const noexcept { return bend_; }

 private:
  [[nodiscard]] Bend shared_out(const Vec3& world_p_base_m) const noexcept;

  Params params_;
  bool tied_ = false, seen_ = false;
  double variance_m2_ = 0.0;
  Vec3 tied_m_ = Vec3::Zero();     // the base at the tie
  Vec3 legs_m_ = Vec3::Zero();     // the base as legs have it, turned by LIO's headings since then
  Vec3 lagging_m_ = Vec3::Zero();  // the base, low-passed as the headings are
  Vec3 counted_m_ = Vec3::Zero();  // up to where the way walked is counted, in pieces: sway is none
  double walked_m_ = 0.0;
  Bend bend_;
};

}  // namespace polygmap
