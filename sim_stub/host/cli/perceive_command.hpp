// SPDX-License-Identifier: Apache-2.0
// `polygmap perceive`: planes, labels and a picture of depth pictures from files.
#pragma once

#include <atomic>
#include <iosfwd>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace polygmap::sim {

struct PerceiveArguments {
  std::vector<std::string> depth;
  std::string camera, params;
  std::vector<double> gravity;
  std::string labels, json, picture, html;
  int repeat = 1;
};

[[nodiscard]] CLI::App* declare_perceive(CLI::App& app, PerceiveArguments& arguments);
// The exit code. Errors are one sentence on err. interrupt: the signal that asks to stop, 0 until then; null: none can.
[[nodiscard]] int run_perceive(const PerceiveArguments& arguments, std::ostream& out, std::ostream& err,
                               const std::atomic<int>* interrupt);

}  // namespace polygmap::sim
