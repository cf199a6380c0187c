// SPDX-License-Identifier: Apache-2.0
// How far the estimated centre of mass is from the true one: a leaning attitude, encoders' offsets, a load nobody told
// of. A pendulum tells: it accelerates away from where the ground presses. The true divergent component xi moves by
// xi' = omega (xi - zmp), what is estimated of it is xi + bias, and the bias changes slowly.
#pragma once

#include <algorithm>

#include "algorithms/core/math/math.hpp"

namespace polygmap {

class DcmBias {
 public:
  struct Params {
    double rate_radps = 1.0;
    double haste = 2.0;
    double surprise_m = 0.02;
    double most_m = 0.04;
    double begin_s = 0.4;

    static void visit(auto& p, auto& field) {
      field("rate_radps", p.rate_radps, 0.0, 20.0, "The observer's slow pole pair.");
      field("haste", p.haste, 0.0, 20.0,
            "In the beginning, when all that is known of the bias is that it is small, the rate is this over the time "
            "since then.");
      field("surprise_m", p.surprise_m, 0.0, 1.0,
            "An estimate farther from the observer's is a push, which says nothing of the bias.");
      field("most_m", p.most_m, 0.0, 0.2, "The bias is believed up to this.");
      field("begin_s", p.begin_s, 0.01, 10.0,
            "The time since the beginning counts from this on, or haste would know no bound.");
    }
  };
  void reset() noexcept { *this = {}; }
  // One tick. dcm_m: as estimated; zmp_m: as measured; odometry. odom_R_heading: what biases them turns with the robot.
  // omega_radps: of the pendulum.
  void update(const Params& params, const Vec2& dcm_m, const Vec2& zmp_m, const Mat2& odom_R_heading,
              double omega_radps, double tick_s) noexcept {
    odom_bias_m_ = odom_R_heading * bias_m_;
    const Vec2 surprise_m = dcm_m - odom_bias_m_ - true_dcm_m_;
    if (!known_ || !(surprise_m.norm() < params.surprise_m)) {
      true_dcm_m_ = dcm_m - odom_bias_m_;
      known_ = true;
      return;
    }
    seen_s_ += tick_s;
    const double rate_radps = std::max(params.rate_radps, params.haste / (params.begin_s + seen_s_));
    // Errors follow s^2 + 2 rate s + rate^2 with these. The bias goes against the surprise: where it is too large, the
    // true component is taken for too far behind, and falls back further.
    const double bias_gain = math::square(rate_radps) / omega_radps;
    const double dcm_gain = omega_radps + bias_gain + 2.0 * rate_radps;
    true_dcm_m_ += tick_s * (omega_radps * (true_dcm_m_ - zmp_m) + dcm_gain * surprise_m);
    bias_m_ -= tick_s * bias_gain * (odom_R_heading.transpose() * surprise_m);
    bias_m_ *= std::min(1.0, params.most_m / std::max(bias_m_.norm(), 1e-6));
  }
  // A tick without a measured zero-moment point: the bias stays.
  void missed(const Mat2& odom_R_heading) noexcept {
    odom_bias_m_ = odom_R_heading * bias_m_;
    known_ = false;
  }
  // What is estimated has jumped by so much and the true one has not, odometry: what estimates it was corrected.
  void shift(const Vec2& odom_shift_m, const Mat2& odom_R_heading) noexcept {
    bias_m_ += odom_R_heading.transpose() * odom_shift_m;
    missed(odom_R_heading);
  }
  // Estimated minus true, odometry.
  [[nodiscard]] const Vec2& odom_bias_m() const noexcept { return odom_bias_m_; }

 private:
  Vec2 true_dcm_m_ = Vec2::Zero();
  Vec2 bias_m_ = Vec2::Zero();  // of the heading
  Vec2 odom_bias_m_ = Vec2::Zero();
  double seen_s_ = 0.0;
  bool known_ = false;
};

}  // namespace polygmap
