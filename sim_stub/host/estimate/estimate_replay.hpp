// SPDX-License-Identifier: Apache-2.0
// A recorded log through the ports into the estimator that flies: what `polygmap estimate` does.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "algorithms/estimation/estimator.hpp"
#include "sim_stub/host/estimate/estimate_log.hpp"
#include "sim_stub/host/interrupted.hpp"

namespace polygmap::sim {

// The module's, but for what no data sheet says of a robot that is only known by its log.
[[nodiscard]] Estimator::Params log_params();
// Of which a log needs the lidar mount alone: none, LIO gives the base's pose.
[[nodiscard]] RobotModel log_robot();

struct ReplayOptions {
  std::string params_hash;  // of what --params says, before the other options
  Estimator::Params estimator = log_params();
  RobotModel robot = log_robot();
  // One sigma, where no standstill at the start says what they are.
  double gyro_bias_sigma_radps = 0.003, accel_bias_sigma_mps2 = 0.03;
  const std::atomic<int>* interrupt = nullptr;  // the signal that asks to stop, 0 until then
};

enum class StartSource : std::uint8_t { kTruth, kStandstill, kFirstAcceleration };

// After one row.
struct ReplayTick {
  std::int64_t stamp_ns = 0;
  Transform world_T_base, odom_T_base;
  Vec3 world_v_base_mps = Vec3::Zero();
  Vec3 base_w_base_radps = Vec3::Zero();
  EstimateQuality quality;
  std::array<double, kFootCount> contact_probability{};
  std::int64_t lio_age_ns = -1;
  bool slips = false;                                 // a standing foot seems to move
  std::uint32_t imu_invalid = 0;                      // so far
  std::array<std::uint32_t, kLioVerdictCount> lio{};  // so far
};

struct Replay {
  std::vector<ReplayTick> ticks;  // one per row
  StartSource start = StartSource::kTruth;
  Vec3 gyro_bias_radps = Vec3::Zero(), accel_bias_mps2 = Vec3::Zero();  // at the end
  std::uint32_t imu_invalid = 0;  // rows beyond what the module takes for true: left out
  std::uint32_t gaps = 0;         // rows that came after more than the log's gap_s()
  std::uint32_t slipping_rows = 0;
  std::uint32_t rows_without_contact = 0;
  std::array<std::uint32_t, kLioVerdictCount> lio{};
  std::size_t lio_not_arrived = 0;  // by the last row
  double largest_slew_m = 0.0;      // most that one tick moved the fused pose against the odometry
};

// False: the log's numbers, each possible by itself, broke the filter.
[[nodiscard]] bool is_finite(const Replay& replay);
// Throws Interrupted.
[[nodiscard]] Replay replay(const EstimateLog& log, const std::vector<LioRow>& lio, const ReplayOptions& options);

}  // namespace polygmap::sim
