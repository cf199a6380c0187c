// SPDX-License-Identifier: Apache-2.0
// What a replay comes to, as files.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "sim_stub/host/estimate/estimate_score.hpp"

namespace polygmap::sim {

[[nodiscard]] const char* name_of(StartSource source);
// Error at the end, per cent of the way gone; 0 where nothing went.
[[nodiscard]] double drift_percent(const Score& score);
[[nodiscard]] double horizontal_drift_percent(const Score& score);

// Scores where the log has truth, biases, innovations, what was refused.
[[nodiscard]] nlohmann::ordered_json estimate_json(const EstimateLog& log, const std::vector<LioRow>& lio,
                                                   const Replay& replay, const std::string& params_hash,
                                                   const std::vector<std::string>& warnings);
// Throw config::FileError when the file cannot be written.
void write_estimate_json(const std::string& path, const EstimateLog& log, const std::vector<LioRow>& lio,
                         const Replay& replay, const std::string& params_hash,
                         const std::vector<std::string>& warnings);
void write_estimate_csv(const std::string& path, const EstimateLog& log, const Replay& replay);

}  // namespace polygmap::sim
