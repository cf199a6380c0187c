// SPDX-License-Identifier: Apache-2.0
// Recorded logs for state estimation: IMU, contacts and feet by position in the base frame, so any robot's; and poses
// of a lidar odometry.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "algorithms/core/messages/samples.hpp"

namespace polygmap::sim {

struct LogTruth {
  Transform true_T_base;
  Vec3 true_v_base_mps = Vec3::Zero();
};

struct LogRow {
  std::int64_t stamp_ns = 0;  // since the log's first row
  Vec3 gyro_radps = Vec3::Zero(), accel_mps2 = Vec3::Zero();
  std::array<double, kFootCount> contact{};  // probability, or 0 and 1
  std::array<Vec3, kFootCount> base_p_foot_m{Vec3::Zero(), Vec3::Zero()};
  // Of the soles, where the log has them: their rates are against the base, in its axes.
  std::array<Mat3, kFootCount> base_R_foot{Mat3::Identity(), Mat3::Identity()};
  std::array<Vec3, kFootCount> base_w_foot_radps{Vec3::Zero(), Vec3::Zero()};
  LogTruth truth;  // where the log has it
};

struct EstimateLog {
  double start_s = 0.0;    // stamp of the first row, as recorded
  double period_s = 0.01;  // of its rows, in the median
  bool has_truth = false;
  bool has_soles = false;  // their orientation and rates; without them feet are points
  std::vector<LogRow> rows;
  // Longer times between rows are bridged, and nothing is concluded from one side of them to the other.
  [[nodiscard]] double gap_s() const { return std::max(0.05, 2.5 * period_s); }
};

struct LioRow {
  std::int64_t stamp_ns = 0, arrival_ns = 0;  // since the log's first row
  Transform pose;                             // of the base, or of the lidar where its mount is given
};

// Throw config::FileError: one sentence with file and line.
[[nodiscard]] EstimateLog read_estimate_log(const std::string& path);
[[nodiscard]] std::vector<LioRow> read_lio_log(const std::string& path, double start_s);

}  // namespace polygmap::sim
