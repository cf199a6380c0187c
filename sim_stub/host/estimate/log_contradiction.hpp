// SPDX-License-Identifier: Apache-2.0
// Do a log's signals contradict each other? A foot that stands does not move: where gyro, accelerometer, feet and
// contacts say so of many rows, one of them is not what its columns name.
#pragma once

#include <string>

#include "sim_stub/host/estimate/estimate_replay.hpp"

namespace polygmap::sim {

// One sentence that says what contradicts what, and which change of the log would undo it; empty where nothing does.
// whole: of this log. Replays the log's beginning anew where there is a suspicion.
[[nodiscard]] std::string doubt_about_contacts(const EstimateLog& log, const Replay& whole,
                                               const ReplayOptions& options);
// Of LIO poses that were not used, because they contradict the odometry.
[[nodiscard]] std::string doubt_about_lio(const std::string& path, std::size_t poses, const Replay& whole);

}  // namespace polygmap::sim
