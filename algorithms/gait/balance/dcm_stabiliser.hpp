// SPDX-License-Identifier: Apache-2.0
// Keeps the centre of mass on its reference by moving the zero-moment point: feedback of the divergent component of
// motion, x + v/omega, in the horizontal plane.
#pragma once

#include "algorithms/gait/trajectories/motion.hpp"

namespace polygmap {

class DcmStabiliser {
 public:
  struct Params {
    double gain = 3.0;
    double integral_per_s = 0.3;
    double integral_max_m = 0.02;

    static void visit(auto& p, auto& field) {
      field("gain", p.gain, 1.01, 20.0, "Metres of ZMP for each metre of DCM; at 1 and below nothing is stable.");
      field("integral_per_s", p.integral_per_s, 0.0, 10.0, "Integral gain of the same.");
      field("integral_max_m", p.integral_max_m, 0.0, 0.2, "The integral's share is bounded by this.");
    }
  };
  void reset() noexcept {
    integral_m_.setZero();
    error_m_.setZero();
  }
  // The ZMP to ask for. omega_radps: of the pendulum, sqrt(g / height over the ground). error of the reference's own
  // ZMP is none: it is reference.position - acceleration / omega^2.
  [[nodiscard]] Vec2 zmp_m(const Params& params, const HorizontalMotion& reference, const Vec2& com_m,
                           const Vec2& velocity_mps, double omega_radps, double tick_s) noexcept {
    error_m_ = com_m - reference.position_m + (velocity_mps - reference.velocity_mps) / omega_radps;
    for (int a = 0; a < 2; ++a) {
      integral_m_[a] = math::clamp(integral_m_[a] + params.integral_per_s * tick_s * error_m_[a],
                                   -params.integral_max_m, params.integral_max_m);
    }
    const Vec2 planned_m = reference.position_m - reference.acceleration_mps2 / math::square(omega_radps);
    return planned_m + params.gain * error_m_ + integral_m_;
  }
  // Of the last tick: how far the divergent component is ahead of its reference.
  [[nodiscard]] const Vec2& error_m() const noexcept { return error_m_; }

 private:
  Vec2 error_m_ = Vec2::Zero();
  Vec2 integral_m_ = Vec2::Zero();
};

}  // namespace polygmap
