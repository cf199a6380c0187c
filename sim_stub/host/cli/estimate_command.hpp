// SPDX-License-Identifier: Apache-2.0
// `polygmap estimate`: a recorded log through the module's state estimation.
#pragma once

#include <atomic>
#include <iosfwd>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace polygmap::sim {

struct EstimateArguments {
  std::string log, lio, json, csv, html, params;
  std::vector<double> lidar_mount;
  double lio_tau_s = 0.0;  // 0: by LIO's noise, as log_params() has it
};

[[nodiscard]] CLI::App* declare_estimate(CLI::App& app, EstimateArguments& arguments);
// The exit code. Errors are one sentence on err. interrupt: the signal that asks to stop, 0 until then; null: none can.
[[nodiscard]] int run_estimate(const EstimateArguments& arguments, std::ostream& out, std::ostream& err,
                               const std::atomic<int>* interrupt);

}  // namespace polygmap::sim
