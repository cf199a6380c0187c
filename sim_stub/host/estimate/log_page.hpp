// SPDX-License-Identifier: Apache-2.0
// A replayed log as a page of curves (host/report/page/DATA.md, "A log").
#pragma once

#include <string>
#include <vector>

#include "sim_stub/host/estimate/estimate_replay.hpp"
#include "sim_stub/host/report/report_blocks.hpp"

namespace polygmap::sim {

// name: the log's file, as shown. lio: of the lidar or the base, as options.robot says.
[[nodiscard]] ReportJson log_json(const std::string& name, const EstimateLog& log, const std::vector<LioRow>& lio,
                                  const Replay& replay, const ReplayOptions& options,
                                  const std::vector<std::string>& warnings);
// Throws config::FileError.
void write_log_page(const std::string& path, const std::string& name, const EstimateLog& log,
                    const std::vector<LioRow>& lio, const Replay& replay, const ReplayOptions& options,
                    const std::vector<std::string>& warnings);

}  // namespace polygmap::sim
