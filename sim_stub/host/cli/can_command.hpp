// SPDX-License-Identifier: Apache-2.0
// `polygmap can`: frames of a bus file's drives, made, read and described.
#pragma once

#include <iosfwd>
#include <string>

#include "algorithms/core/messages/samples.hpp"

namespace CLI {
class App;
}

namespace polygmap::sim {

struct CanArguments {
  CLI::App *encode = nullptr, *decode = nullptr, *dbc = nullptr;  // of which one is asked for
  std::string bus, on, joint, frame;
  JointSetpoint command;
};
CLI::App* declare_can(CLI::App& app, CanArguments& arguments);
// The exit code. Errors are one sentence on err.
[[nodiscard]] int run_can(const CanArguments& arguments, std::ostream& out, std::ostream& err);

}  // namespace polygmap::sim
