// SPDX-License-Identifier: Apache-2.0
// One simulated climb: robot, module and report in a closed loop.
#pragma once

#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "sim_stub/host/climb/climb_options.hpp"
#include "sim_stub/host/climb/climb_summary.hpp"

namespace polygmap::sim {

// Called about once per simulated second: step, simulated time, worst row of the schedule.
struct ClimbProgress {
  double time_s;
  int treads_climbed;
  std::string_view phase;
  const char* worst_row;
  double worst_row_us;
};

using ClimbProgressFunction = std::function<void(const ClimbProgress&)>;

// The climb is over, but its files could not be written: one sentence, and the verdict that is worth a minute.
struct ClimbNotWritten : std::runtime_error {
  ClimbNotWritten(const std::string& sentence, ClimbSummary climbed)
      : std::runtime_error(sentence), summary(std::move(climbed)) {}
  ClimbSummary summary;
};

// Runs one climb to its end and, unless options.out_dir is empty, writes summary.json and climb.svg there (the
// directory exists). Throws ClimbNotWritten when it cannot write.
[[nodiscard]] ClimbSummary run_climb(const ClimbOptions& options, const ClimbProgressFunction& progress);

}  // namespace polygmap::sim
