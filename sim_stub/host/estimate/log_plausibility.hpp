// SPDX-License-Identifier: Apache-2.0
// Is a log in the units and axes that its columns name? What cannot be is refused, what is odd is told.
#pragma once

#include <string>
#include <vector>

#include "sim_stub/host/estimate/estimate_log.hpp"

namespace polygmap::sim {

// What the answer hangs on.
struct LogFigures {
  double accel_mps2 = 0.0;              // median of the acceleration's length
  Vec3 base_up_felt = Vec3::Zero();     // mean acceleration: points up where a robot stays upright
  Vec3 base_up_by_feet = Vec3::Zero();  // from the feet to the base, in the mean
  double leg_m = 0.0;                   // median distance of a foot
  double period_s = 0.0;                // median time from row to row
  Vec3 base_sole_up = Vec3::Zero();     // z axes of standing soles, in the mean; 0 without soles
  // How standing soles turn against the gyro in a fifth of a second, RMS; 0 without soles: as they are, with a
  // quaternion in the order x, y, z, w, and with one that is inverted.
  double sole_turn_rad = 0.0, reordered_sole_turn_rad = 0.0, inverted_sole_turn_rad = 0.0;
  struct Frozen {
    const char* what = "";
    double from_s = 0.0, for_s = 0.0;
  } frozen;                   // the longest time in which a signal stays the same to the last digit
  double gravity_kept = 1.0;  // share of gravity that the gyro's turns leave, at worst
  // Against the truth, 0 without it.
  double true_turn_radps = 0.0;                                                    // RMS
  double gyro_error_share = 0.0;                                                   // of the turns, squared
  Vec3 true_axis_turn_radps = Vec3::Zero(), gyro_axis_error_share = Vec3::Zero();  // the same of each axis
  double true_speed_mps = 0.0;                                                     // mean
  double true_velocity_error_share = 0.0;  // of places a second apart: what the velocity does not add up to
  double felt_lean_mps2 = 0.0;             // of the mean acceleration, out of the vertical
};
struct LogGaps {
  std::size_t count = 0;
  double longest_s = 0.0;
};
[[nodiscard]] LogGaps gaps_of(const EstimateLog& log);

// gyro_scale: as if the gyro had said so much.
[[nodiscard]] LogFigures figures_of(const EstimateLog& log, double gyro_scale = 1.0);

// One sentence each. Throws config::FileError, one sentence, where the log cannot be what it says.
[[nodiscard]] std::vector<std::string> doubts_about(const EstimateLog& log, const std::string& path);

}  // namespace polygmap::sim
