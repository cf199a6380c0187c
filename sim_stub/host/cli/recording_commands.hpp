// SPDX-License-Identifier: Apache-2.0
// `polygmap replay`, `report`, `info` and `pack`: what is done with a recording.
#pragma once

#include <array>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace polygmap::sim {

struct RecordingArguments {
  std::array<CLI::App*, 4> commands{};  // in the order above
  std::vector<std::string> recordings;
  std::string out = "report_out", packed;
  bool json = false, digests = false;
};
void declare_recording_commands(CLI::App& app, RecordingArguments& a);
// Of the one that was given; none when none was. The exit code; errors are one sentence on err.
[[nodiscard]] std::optional<int> run_recording_command(const RecordingArguments& a, std::ostream& out,
                                                       std::ostream& err);

}  // namespace polygmap::sim
