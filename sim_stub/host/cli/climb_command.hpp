// SPDX-License-Identifier: Apache-2.0
// `polygmap climb`: reads and checks the arguments, runs the climb, says what came of it.
#pragma once

#include <atomic>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "sim_stub/host/climb/climb.hpp"

namespace polygmap::sim {

enum ExitCode : int {
  kExitPass = 0,      // the climb passed, or help was asked for
  kExitFail = 1,      // the climb failed
  kExitUsage = 2,     // a bad argument, or output that cannot be written
  kExitSignal = 128,  // and the number of the signal that ended the climb
};

using ClimbRunner = std::function<ClimbSummary(const ClimbOptions&, const ClimbProgressFunction&)>;

// arguments without the program's name. Errors are one sentence on err. live: out is a terminal, the progress line is
// rewritten in place; otherwise a line now and then. interrupt: the signal that asks perceive or estimate to stop, 0
// until then; null where none can. A climb's is the runner's.
[[nodiscard]] int polygmap_main(const std::vector<std::string>& arguments, const ClimbRunner& run, std::ostream& out,
                                std::ostream& err, bool live, const std::atomic<int>* interrupt = nullptr);

}  // namespace polygmap::sim
