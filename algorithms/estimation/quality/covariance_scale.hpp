// SPDX-License-Identifier: Apache-2.0
// By how much the published covariance of position and velocity is larger or smaller than the filter's: as the standing
// feet's innovations, averaged over some milliseconds, are to what they usually are. Published only: no gain depends on
// it, so that nothing which the filter measures of itself feeds back.
//
// The constants are fitted to the three logs in docs/measured/estimation.md and looked at on simulated climbs.
#pragma once

#include <algorithm>

#include "algorithms/core/math/math.hpp"

namespace polygmap {

class CovarianceScale {
 public:
  struct Params {
    double usual_m = 8.5e-4;
    double rise_s = 0.04;
    double fall_s = 0.06;
    double slow_s = 1.0;
    double slow_share = 0.3;
    double least = 0.3;
    double position_share = 0.4;
    double coupling_s = 0.05;
    double jerk_times = 2.5;
    double jerk_floor_mpsrs = 0.012;
    double least_position_m = 2e-5;
    double least_velocity_mps = 2e-4;

    static void visit(auto& p, auto& field) {
      field("usual_m", p.usual_m, 1e-5, 0.1,
            "Innovation of a standing foot with which the filter's covariance is right.");
      field("rise_s", p.rise_s, 1e-3, 10.0, "Larger innovations count after this time.");
      field("fall_s", p.fall_s, 1e-3, 10.0, "Smaller ones count after this.");
      field("slow_s", p.slow_s, 1e-3, 100.0, "Their average over this time counts, too.");
      field("slow_share", p.slow_share, 0.0, 10.0, "It counts by this share.");
      field("least", p.least, 0.0, 1.0,
            "The filter's variances are no more than this share too large: legs that are longer than thought move no "
            "foot.");
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
    fast_m2_ = slow_m2_ = math::square(0.3 * params.usual_m);
  }
  // innovation_m2: mean square per axis of the standing feet's averaged innovations; negative: no foot stands.
  // accel_step_mps2: change of the accelerometer since the last sample.
  void update(double innovation_m2, const Vec3& accel_step_mps2, double dt_s) noexcept {
    if (innovation_m2 >= 0.0) {
      const double time_s = innovation_m2 > fast_m2_ ? params_.rise_s : params_.fall_s;
      fast_m2_ += dt_s / (time_s + dt_s) * (innovation_m2 - fast_m2_);
      slow_m2_ += dt_s / (params_.slow_s + dt_s) * (innovation_m2 - slow_m2_);
    }
    const double step_m2ps2 = accel_step_mps2.squaredNorm() * dt_s * dt_s / 3.0;
    const double time_s = step_m2ps2 > jerk_m2ps2_ ? params_.rise_s : params_.fall_s;
    jerk_m2ps2_ += dt_s / (time_s + dt_s) * (step_m2ps2 - jerk_m2ps2_);
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
  [[nodiscard]] double velocity_scale() const noexcept {
    return std::max((fast_m2_ + params_.slow_share * slow_m2_) / math::square(params_.usual_m), params_.least);
  }

  Params params_;
  double fast_m2_ = 0.0, slow_m2_ = 0.0, jerk_m2ps2_ = 0.0;
  double filter_m2_ = 0.0, position_m2_ = 0.0;
  double dt_s_ = 0.0;
};

}  // namespace polygmap
