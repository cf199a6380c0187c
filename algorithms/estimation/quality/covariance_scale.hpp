// SPDX-License-Identifier: Apache-2.0
// By how much the published covariance of position and velocity is larger or smaller than the filter's: as the squares
// of the standing feet's innovations, averaged over some milliseconds, are to what the filter expects of them.
// Published only: no gain depends on it, so that nothing which the filter measures of itself feeds back.
//
// The constants are fitted to the three logs in docs/measured/estimation.md, to two of them with every second row left
// out, and to three simulated climbs. The scale depends on the rate: with fewer rows innovations average less well.
#pragma once

#include <algorithm>

#include "algorithms/core/math/math.hpp"

namespace polygmap {

class CovarianceScale {
 public:
  struct Params {
    double usual_ratio = 0.22;
    double fall_s = 0.1;
    double least = 0.003;
    double position_share = 0.65;
    double coupling_s = 0.03;
    double jerk_times = 3.6;
    double jerk_floor_mpsrs = 0.0035;
    double least_position_m = 2e-5;
    double least_velocity_mps = 5e-4;

    static void visit(auto& p, auto& field) {
      field(
          "usual_ratio", p.usual_ratio, 1e-5, 10.0,
          "Square of a standing foot's averaged innovation over the variance that the filter expects of it, with which "
          "the filter's covariance is right.");
      field("fall_s", p.fall_s, 1e-3, 10.0, "Larger innovations count at once, and smaller ones after this time.");
      field("least", p.least, 0.0, 1.0, "The filter's variances are no more than this share too large.");
      field("position_share", p.position_share, 0.0, 10.0,
            "Position's variance grows by this share of what the filter's does.");
      field("coupling_s", p.coupling_s, 0.0, 1.0, "Velocity's errors move the position for this time.");
      field("jerk_times", p.jerk_times, 0.0, 100.0,
            "An acceleration that changes from sample to sample leaves so much of that step in the velocity.");
      field("jerk_floor_mpsrs", p.jerk_floor_mpsrs, 0.0, 1.0, "So much of that change is the accelerometer's noise.");
      field("least_position_m", p.least_position_m, 0.0, 0.1, "One sigma of the position at least.");
      field("least_velocity_mps", p.least_velocity_mps, 0.0, 1.0, "One sigma of the velocity at least.");
    }
  };
  using Covariance = Eigen::Matrix<double, 9, 9>;  // position, velocity, attitude

  void reset(const Params& params) noexcept {
    *this = CovarianceScale{};
    params_ = params;
    ratio_ = 0.09 * params.usual_ratio;
  }
  // innovation_ratio: of the standing feet, as ContactInEkf has it; negative: no foot stands.
  // accel_step_mps2: change of the accelerometer since the last sample.
  void update(double innovation_ratio, const Vec3& accel_step_mps2, double dt_s) noexcept {
    const double kept = params_.fall_s / (params_.fall_s + dt_s);
    const auto follow = [&](double& value, double now) { value = std::max(now, now + kept * (value - now)); };
    if (innovation_ratio >= 0.0) follow(ratio_, innovation_ratio);
    follow(jerk_m2ps2_, accel_step_mps2.squaredNorm() * dt_s * dt_s / 3.0);
    dt_s_ = dt_s;
  }
  // Of what the filter's variance of the position grows by, what counts.
  [[nodiscard]] double growth_share() const noexcept { return params_.position_share * velocity_scale(); }
  // To be called once per step, after update.
  [[nodiscard]] Covariance published(const Covariance& filter) noexcept {
    const double scale = velocity_scale();
    const double trace_m2 = filter.topLeftCorner<3, 3>().trace();
    if (filter_m2_ <= 0.0) {
      position_m2_ = trace_m2;
    } else if (trace_m2 > filter_m2_) {
      position_m2_ += params_.position_share * scale * (trace_m2 - filter_m2_);
    } else {
      position_m2_ *= trace_m2 / filter_m2_;
    }
    filter_m2_ = trace_m2;
    Eigen::Matrix<double, 9, 1> by = Eigen::Matrix<double, 9, 1>::Ones();
    by.head<3>().setConstant(math::sqrt(std::max(position_m2_, 1e-12) / std::max(trace_m2, 1e-12)));
    by.segment<3>(3).setConstant(math::sqrt(scale));
    Covariance P;
    for (int j = 0; j < 9; ++j) {
      for (int i = 0; i < 9; ++i) P(i, j) = by[i] * by[j] * filter(i, j);
    }
    P.topLeftCorner<3, 3>() += math::square(params_.coupling_s) * P.block<3, 3>(3, 3);
    P.diagonal().head<3>().array() += math::square(params_.least_position_m);
    const double jerk_m2ps2 = std::max(jerk_m2ps2_ - 2.0 * math::square(params_.jerk_floor_mpsrs) * dt_s_, 0.0);
    P.diagonal().segment<3>(3).array() +=
        math::square(params_.jerk_times) * jerk_m2ps2 + math::square(params_.least_velocity_mps);
    return P;
  }

 private:
  [[nodiscard]] double velocity_scale() const noexcept { return std::max(ratio_ / params_.usual_ratio, params_.least); }

  Params params_;
  double ratio_ = 0.0, jerk_m2ps2_ = 0.0;
  double filter_m2_ = 0.0, position_m2_ = 0.0;
  double dt_s_ = 0.0;
};

}  // namespace polygmap
