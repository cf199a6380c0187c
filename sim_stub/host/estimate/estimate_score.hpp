// SPDX-License-Identifier: Apache-2.0
// A replay against the log's truth.
#pragma once

#include "sim_stub/host/estimate/estimate_replay.hpp"

namespace polygmap::sim {

// NEES: squared error of position and velocity (6 states, world axes) over its covariance.
inline constexpr int kNeesStates = 6;
inline constexpr double kNeesLow = 1.2373, kNeesHigh = 14.4494;  // chi-squared of 6, 2.5 % and 97.5 %

inline constexpr double kPlanted_s = 1.0;

struct Score {
  double position_rmse_m = 0.0, velocity_rmse_mps = 0.0, attitude_rmse_rad = 0.0;
  double odometry_rmse_m = 0.0;  // without LIO's offset
  double tilt_rmse_rad = 0.0, yaw_rmse_rad = 0.0;
  double distance_m = 0.0;  // that the true base went
  double final_error_m = 0.0;
  double horizontal_distance_m = 0.0, final_horizontal_error_m = 0.0;
  double nees_in_bounds = 0.0;  // share of the rows
  double nees_mean = 0.0;
  // The farthest that a foot went from where it was planted, as the legs and the estimate say, while both stood by the
  // log for kPlanted_s at least; negative: they never did.
  double planted_foot_m = -1.0;
};

[[nodiscard]] Score score(const EstimateLog& log, const Replay& replay);

}  // namespace polygmap::sim
