// SPDX-License-Identifier: Apache-2.0
// Polynomials of degree five: continuous in position, speed and acceleration wherever two of them meet.
#pragma once

#include "algorithms/gait/trajectories/motion.hpp"

namespace polygmap {

// 0 -> 1 for u in 0..1, with zero speed and acceleration at both ends; held outside.
[[nodiscard]] constexpr double smooth_step(double u) noexcept {
  const double x = math::clamp(u, 0.0, 1.0);
  return x * x * x * (10.0 + x * (6.0 * x - 15.0));
}
// The same inside a window of a normalised time.
[[nodiscard]] constexpr double smooth_window(double u, double begin, double end) noexcept {
  return smooth_step((u - begin) / (end - begin));
}

class Quintic {
 public:
  constexpr Quintic() noexcept = default;
  // duration_s > 0.
  constexpr Quintic(const Motion& from, const Motion& to, double duration_s) noexcept
      : c0_(from.position), c1_(from.speed), c2_(0.5 * from.acceleration), duration_s_(duration_s) {
    const double T = duration_s;
    const double d = to.position - (c0_ + T * (c1_ + T * c2_));
    const double v = (to.speed - (c1_ + 2.0 * c2_ * T)) * T;
    const double a = (to.acceleration - 2.0 * c2_) * T * T;
    c3_ = (10.0 * d - 4.0 * v + 0.5 * a) / (T * T * T);
    c4_ = (-15.0 * d + 7.0 * v - a) / (T * T * T * T);
    c5_ = (6.0 * d - 3.0 * v + 0.5 * a) / (T * T * T * T * T);
  }
  // Held at the ends of 0..duration.
  [[nodiscard]] constexpr Motion at(double t_s) const noexcept {
    const double t = math::clamp(t_s, 0.0, duration_s_);
    return {c0_ + t * (c1_ + t * (c2_ + t * (c3_ + t * (c4_ + t * c5_)))),
            c1_ + t * (2.0 * c2_ + t * (3.0 * c3_ + t * (4.0 * c4_ + t * 5.0 * c5_))),
            2.0 * c2_ + t * (6.0 * c3_ + t * (12.0 * c4_ + t * 20.0 * c5_))};
  }

 private:
  double c0_ = 0.0, c1_ = 0.0, c2_ = 0.0, c3_ = 0.0, c4_ = 0.0, c5_ = 0.0;
  double duration_s_ = 0.0;
};

}  // namespace polygmap
