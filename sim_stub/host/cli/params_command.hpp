// SPDX-License-Identifier: Apache-2.0
// `polygmap params`: the module's parameters as text.
#pragma once

#include <iosfwd>
#include <string>

#include "firmware/params.hpp"

namespace CLI {
class App;
}

namespace polygmap::sim {

struct ParamsArguments {
  CLI::App *list = nullptr, *reality = nullptr, *states = nullptr, *docs = nullptr,
           *diff = nullptr;  // of which one is asked for
  std::string file;
  bool json = false;
};
CLI::App* declare_params(CLI::App& app, ParamsArguments& a);
[[nodiscard]] int run_params(const ParamsArguments& a, std::ostream& out, std::ostream& err);

// A file that --params takes, with what each parameter is.
[[nodiscard]] std::string params_toml(const Params& params);
[[nodiscard]] std::string params_json(const Params& params);
// docs/reference/params.md
[[nodiscard]] std::string params_markdown();
// docs/reference/reality.md
[[nodiscard]] std::string reality_markdown();
// docs/reference/states.md
[[nodiscard]] std::string states_markdown();
// A line for each value that is not the default; empty when there is none.
[[nodiscard]] std::string params_difference(const Params& params);

}  // namespace polygmap::sim
