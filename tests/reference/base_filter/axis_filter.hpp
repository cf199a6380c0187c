// SPDX-License-Identifier: Apache-2.0
// Eqs (1)-(4) along one world axis: 10 of the 30 states, 16 or 24 of the 56 rows.
//
// With P0, Q and R diagonal per axis no covariance between axes ever arises (exactly 0 in a dense run), so three of
// these are the paper's filter at a thirtieth of the work. R diagonal: rows one after the other equal one batch update.
#pragma once

#include <array>

#include "algorithms/core/capacities.hpp"
#include "algorithms/core/math/math.hpp"

namespace polygmap {

class AxisFilter {
 public:
  static constexpr int kStates = 2 + static_cast<int>(kContactCount);  // base position, base velocity, contacts
  using State = Eigen::Matrix<double, kStates, 1>;
  using Covariance = Eigen::Matrix<double, kStates, kStates>;
  using PerContact = std::array<double, kContactCount>;

  void initialise(const State& x, const State& variances) noexcept {
    x_ = x;
    P_ = variances.asDiagonal();
  }

  // Eq. (2). process: variances of this step.
  void predict(double accel_mps2, double dt_s, const State& process) noexcept {
    x_[kPosition] += dt_s * x_[kVelocity] + 0.5 * dt_s * dt_s * accel_mps2;
    x_[kVelocity] += dt_s * accel_mps2;
    P_.row(kPosition) += dt_s * P_.row(kVelocity);
    P_.col(kPosition) += dt_s * P_.col(kVelocity);
    P_.diagonal() += process;
  }

  // Rows B_p_c of eqs (3)-(4): contact minus base, in world axes.
  void correct_positions(const PerContact& relative_m, const PerContact& variance_m2) noexcept {
    for (std::size_t c = 0; c < kContactCount; ++c) {
      const int i = kFirstContact + static_cast<int>(c);
      const State PHt = P_.col(i) - P_.col(kPosition);
      (void)correct(PHt, PHt[i] - PHt[kPosition] + variance_m2[c], relative_m[c] - (x_[i] - x_[kPosition]));
    }
  }
  // Rows B_v_c: a standing contact moves against the base at minus the base's velocity. All eight observe this one
  // number, so their mean by information is the same update. Returns the innovation's square over its variance.
  double correct_velocities(const PerContact& relative_mps, const PerContact& variance_m2ps2) noexcept {
    double information = 0.0, weighted = 0.0;
    for (std::size_t c = 0; c < kContactCount; ++c) {
      information += 1.0 / variance_m2ps2[c];
      weighted -= relative_mps[c] / variance_m2ps2[c];
    }
    const State PHt = P_.col(kVelocity);
    return correct(PHt, PHt[kVelocity] + 1.0 / information, weighted / information - x_[kVelocity]);
  }
  // Rows h_c, of the vertical axis. A negative variance: nothing known of that contact's height. Returns the sum of the
  // innovations' squares over their variances.
  double correct_heights(const PerContact& height_m, const PerContact& variance_m2) noexcept {
    double squares = 0.0;
    for (std::size_t c = 0; c < kContactCount; ++c) {
      if (variance_m2[c] < 0.0) continue;
      const int i = kFirstContact + static_cast<int>(c);
      const State PHt = P_.col(i);
      squares += correct(PHt, PHt[i] + variance_m2[c], height_m[c] - x_[i]);
    }
    return squares;
  }

  [[nodiscard]] double position_m() const noexcept { return x_[kPosition]; }
  [[nodiscard]] double velocity_mps() const noexcept { return x_[kVelocity]; }
  [[nodiscard]] double velocity_sigma_mps() const noexcept { return math::sqrt(P_(kVelocity, kVelocity)); }
  [[nodiscard]] double contact_m(std::size_t contact) const noexcept {
    return x_[kFirstContact + static_cast<int>(contact)];
  }
  [[nodiscard]] const Covariance& covariance() const noexcept { return P_; }

 private:
  enum Index : int { kPosition, kVelocity, kFirstContact };

  // By value: the caller's column is about to change. Returns the innovation's square over its variance.
  double correct(const State PHt, double innovation_variance, double innovation) noexcept {
    if (!(innovation_variance > 0.0)) return 0.0;  // no measurement could be as sure as that
    const double inverse = 1.0 / innovation_variance;
    x_ += PHt * (innovation * inverse);
    for (int j = 0; j < kStates; ++j) {
      const double scaled = PHt[j] * inverse;
      for (int i = 0; i <= j; ++i) P_(i, j) = P_(j, i) = P_(i, j) - PHt[i] * scaled;
    }
    return innovation * innovation * inverse;
  }

  State x_ = State::Zero();
  Covariance P_ = Covariance::Zero();
};

}  // namespace polygmap
