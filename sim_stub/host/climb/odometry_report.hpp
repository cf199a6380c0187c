// SPDX-License-Identifier: Apache-2.0
// Judges the pose: odometry, lidar odometry and what is fused of both, against the truth (the paper's Fig. 4).
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "algorithms/core/messages/gait_status.hpp"
#include "algorithms/core/messages/samples.hpp"
#include "algorithms/core/messages/state.hpp"
#include "sim_stub/host/climb/climb_summary.hpp"
#include "sim_stub/world/truth.hpp"

namespace polygmap::sim {

// Root of the power of a signal between two frequencies, all axes together: Fourier sums under a Hann window. The
// samples are kPlantTick_s apart.
[[nodiscard]] double band_rms_m(const std::vector<Vec3>& signal_m, double low_hz, double high_hz);

// Every world is laid on the true one once, by heading and place: all know which way is up.
class OdometryReport {
 public:
  // Once per tick.
  void observe(const Truth& truth, const StateEstimate& state, GaitPhase phase);
  // Every LIO pose that the module accepted, at its arrival; one whose stamp is not of the last 2 s is not judged.
  void observe_lio(const LioSample& sample);

  [[nodiscard]] bool aligned() const { return aligned_; }
  [[nodiscard]] std::int64_t aligned_stamp_ns() const { return aligned_stamp_ns_; }
  // By where the base is in this tick, so that what lies in odometry is judged without its drift until then.
  [[nodiscard]] const Transform& true_T_odom() const { return true_T_odom_now_; }
  // None for a moment before the first or after the last tick, or longer than 2 s ago.
  [[nodiscard]] std::optional<Transform> true_T_base_at(std::int64_t stamp_ns) const;
  [[nodiscard]] OdometryFigures figures() const;

 private:
  struct TruePose {
    std::int64_t stamp_ns;
    Transform true_T_base;
  };
  struct SquaredError {
    double sum_m2 = 0.0;
    std::uint64_t count = 0;
    void add(const Vec3& error_m);
    [[nodiscard]] double rmse_m() const;
  };

  std::deque<TruePose> past_;
  bool aligned_ = false, climbing_ = false;
  std::int64_t aligned_stamp_ns_ = 0;
  Transform true_T_odom_, true_T_world_, true_T_odom_now_;
  std::optional<Transform> true_T_lio_;
  std::optional<Vec3> held_lio_m_;  // the last pose that arrived, true world
  SquaredError base_, lio_, fused_;
  // From the first lift-off on, tick by tick, true world.
  std::vector<Vec3> base_errors_m_, held_lio_errors_m_, fused_errors_m_;
  double nees_sum_ = 0.0;
  std::uint64_t nees_in_bounds_ = 0;
};

}  // namespace polygmap::sim
