// SPDX-License-Identifier: Apache-2.0
// `polygmap replay`: the module lives a recording once more.
#pragma once

#include <iosfwd>
#include <string>

namespace CLI {
class App;
}

namespace polygmap::sim {

struct ReplayArguments {
  std::string recording;
};
CLI::App* declare_replay(CLI::App& app, ReplayArguments& a);
[[nodiscard]] int run_replay(const ReplayArguments& a, std::ostream& out, std::ostream& err);

}  // namespace polygmap::sim
