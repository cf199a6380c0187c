// SPDX-License-Identifier: Apache-2.0
// How well the fused pose is known, in the world as odometry began it: standard deviations that say what a fixed gain
// does to errors of different kinds.
#pragma once

#include "algorithms/core/math/transform.hpp"

namespace polygmap {

class LioUncertainty {
 public:
  struct Params {
    // What no filter sees, legs that are longer than thought: per axis, besides what the heading does. The rest of the
    // drift is what the odometry's filter says (follow). Set on the simulated climbs of seeds 1-20: with it the fused
    // position's squared error over its variance is 2.5 in the mean there, of 3 that are honest, and 2.8 on 101-120.
    double drift_per_m = 0.0011;
    double initial_sigma_m = 1e-3;
    double initial_sigma_rad = 1e-3;

    static void visit(auto& p, auto& field) {
      field("drift_per_m", p.drift_per_m, 0.0, 0.1,
            "Odometry drifts by this along each axis besides what its filter and the heading say: legs are longer than "
            "thought.");
      field("initial_sigma_m", p.initial_sigma_m, 0.0, 1.0, "Position at the start.");
      field("initial_sigma_rad", p.initial_sigma_rad, 0.0, 1.0, "Yaw at the start.");
    }
  };
  // x, y, z in m and yaw in rad, world axes.
  using Quantities = Eigen::Vector4d;

  void reset(const Params& params) noexcept;
  // ProprioceptiveOdometry alone, one tick: it errs alike all the way, so sigmas add up, and a wrong heading bends the
  // way.
  void move(const Vec3& world_step_m) noexcept;
  // The odometry's own variances, besides what the heading does, as its filter has them now: what they grew by adds to
  // the walk, what they shrink by is taken off it.
  void follow(const Quantities& odometry) noexcept {
    walk_variance_ = (walk_variance_ + odometry - odometry_variance_).cwiseMax(0.0);
    odometry_variance_ = odometry;
  }
  // The odometry starts, with these.
  void begin(const Quantities& odometry) noexcept { odometry_variance_ = odometry; }
  // A LIO pose of these sigmas, blended in with the gain of eq. (9).
  void blend(double gain, double lio_sigma_m, double lio_sigma_rad) noexcept;
  // LIO's world is tied to ours anew, from here on: with these sigmas, the base at world_p_base, whose place and
  // heading are known with variance `known`.
  void tie(const Vec3& world_p_base_m, double sigma_m, double sigma_rad, const Quantities& known) noexcept;
  // Before any blend: the share of one more LIO pose's innovation that is the tie's error rather than the odometry's
  // drift since the tie, for position and for rotation. A robot at rest: 1/2, 1/3, ...
  struct TieGains {
    double position, rotation;
  };
  [[nodiscard]] TieGains tie_gains(double lio_sigma_m, double lio_sigma_rad) const noexcept;
  void average(const TieGains& gains, double lio_sigma_m, double lio_sigma_rad) noexcept;
  // The odometry chooses its origin.
  void rebase(const Transform& new_T_old) noexcept { tie_world_p_base_m_ = new_T_old * tie_world_p_base_m_; }

  [[nodiscard]] Vec3 position_sigma_m(const Vec3& world_p_base_m) const noexcept;
  [[nodiscard]] double yaw_sigma_rad() const noexcept;
  [[nodiscard]] const Quantities& tie_variance() const noexcept { return tie_variance_; }
  // Of LIO's next pose against the prediction, without that pose's own noise.
  [[nodiscard]] Quantities offset_variance() const noexcept;

 private:
  Params params_;
  Quantities start_variance_ = Quantities::Zero();  // odometry's until the tie: no LIO pose can tell
  Quantities lag_ = Quantities::Zero();             // drift since then that the low-pass has not followed yet, sigmas
  Vec3 bent_m_ = Vec3::Zero();                      // the same of a wrong heading: signed, so that sway cancels
  Quantities walk_variance_ = Quantities::Zero();   // the same of drift that has no direction
  Quantities odometry_variance_ = Quantities::Zero();
  Quantities noise_variance_ = Quantities::Zero();  // LIO's that came through
  Quantities tie_covariance_ = Quantities::Zero();  // of the tie's error with the odometry's
  Quantities tie_variance_ = Quantities::Zero();    // LIO's share at the tie, which stays ...
  double tie_share_ = 0.0;                          // ... once the low-pass has forgotten it: until then they cancel
  Vec3 tie_world_p_base_m_ = Vec3::Zero();          // a world tied with a turn is wrong in proportion to the distance
};

}  // namespace polygmap
