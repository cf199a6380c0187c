// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/cli/replay_command.hpp"

#include <CLI/CLI.hpp>
#include <ostream>

#include "firmware/recording/replay.hpp"
#include "sim_stub/host/cli/climb_command.hpp"
#include "sim_stub/host/cli/command_words.hpp"

namespace polygmap::sim {

CLI::App* declare_replay(CLI::App& app, ReplayArguments& a) {
  CLI::App* command = app.add_subcommand(
      "replay",
      "Feed a recording to the module and compare what comes out, to the bit: exit code 0 when nothing differs, 1 with "
      "the first difference, 2 when it cannot be read, 3 when it is unfinished and agrees as far as it goes");
  command->add_option("recording", a.recording, "run.mcap that climb or polygmapd wrote")->required()->type_name("RUN.mcap");
  return command;
}

int run_replay(const ReplayArguments& a, std::ostream& out, std::ostream& err) {
  const recording::ReplayResult result = recording::replay(a.recording);
  if (result.verdict == recording::ReplayVerdict::kUnreadable) {
    if (!result.difference.empty()) out << "first difference: " << result.difference << "\n" << std::flush;
    err << "polygmap: " << result.complaint << "\n";
  } else {
    out << text_of(result);
  }
  const int said = written(out, err);
  return said == kExitPass ? static_cast<int>(result.verdict) : said;
}

}  // namespace polygmap::sim
