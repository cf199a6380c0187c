// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/cli/recording_commands.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <ostream>

#include "firmware/config/file_error.hpp"
#include "firmware/recording/digests.hpp"
#include "firmware/recording/replay.hpp"
#include "sim_stub/host/cli/climb_command.hpp"
#include "sim_stub/host/cli/command_words.hpp"
#include "sim_stub/host/record/recording_info.hpp"
#include "sim_stub/host/record/zstd_chunks.hpp"
#include "sim_stub/host/report/report_page.hpp"

namespace polygmap::sim {
namespace {

enum Command : std::size_t { kReplay, kReport, kInfo, kPack };
constexpr int kExitUnfinished = 3;

int print_digests(const RecordingArguments& a, std::ostream& out, std::ostream& err) {
  const recording::RecordingDigests digests = recording::digests_of(a.recordings.front(), zstd_decompress());
  out << text_of(digests);
  const int said = written(out, err);
  if (!digests.complaint.empty()) {
    err << "polygmap: " << digests.complaint << "\n";
    return kExitUsage;
  }
  return said != kExitPass || digests.is_finished ? said : kExitUnfinished;
}

int run_replay(const RecordingArguments& a, std::ostream& out, std::ostream& err) {
  if (a.digests) return print_digests(a, out, err);
  const recording::ReplayResult result = recording::replay(a.recordings.front(), zstd_decompress());
  const bool is_read = result.verdict != recording::ReplayVerdict::kUnreadable;
  if (a.json) {
    const nlohmann::ordered_json json{
        {"verdict", static_cast<int>(result.verdict)},    {"ticks", result.ticks},         {"differ", result.differ},
        {"first_difference", result.difference},          {"complaint", result.complaint}, {"unfinished", result.ends},
        {"without_perception", result.without_perception}};
    out << json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << "\n";
  } else if (is_read) {
    out << text_of(result);
  } else if (!result.difference.empty()) {
    out << "first difference: " << result.difference << "\n" << std::flush;
  }
  if (!is_read) err << "polygmap: " << result.complaint << "\n";
  const int said = written(out, err);
  return said == kExitPass ? static_cast<int>(result.verdict) : said;
}

int run_report(const RecordingArguments& a, std::ostream& out, std::ostream& err) {
  if (const std::string wrong = directory_complaint(a.out); !wrong.empty()) {
    err << "polygmap: " << wrong << "\n";
    return kExitUsage;
  }
  ReportedFiles files;
  try {
    files = write_report(a.recordings, a.out);
    if (!files.unreadable.empty()) {
      err << "polygmap: " << files.unreadable << "\n";
      return kExitUsage;
    }
  } catch (const config::FileError& error) {
    err << "polygmap: " << error.what() << "\n";
    return kExitUsage;
  }
  out << a.out << "/report.html\n";
  if (!files.unsound.empty()) err << "polygmap: " << files.unsound << "\n";
  const int said = written(out, err);
  return said == kExitPass && !files.unsound.empty() ? kExitUnfinished : said;
}

int run_info(const RecordingArguments& a, std::ostream& out, std::ostream& err) {
  const RecordingInfo info = info_of(a.recordings.front());
  if (!info.topics.empty()) out << (a.json ? json_of(info) : text_of(info));
  const int said = written(out, err);
  if (!info.complaint.empty()) {
    err << "polygmap: " << info.complaint << "\n";
    return kExitUsage;
  }
  if (info.topics.empty() && !info.is_finished) {
    err << "polygmap: \"" << a.recordings.front() << "\" ends before its first message.\n";
  }
  return said != kExitPass || info.is_finished ? said : kExitUnfinished;
}

int run_pack(const RecordingArguments& a, std::ostream& out, std::ostream& err) {
  const std::string& path = a.recordings.front();
  if (const std::string wrong = pack_recording(path, a.packed.empty() ? path : a.packed); !wrong.empty()) {
    err << "polygmap: " << wrong << "\n";
    return kExitUsage;
  }
  return written(out, err);
}

}  // namespace

void declare_recording_commands(CLI::App& app, RecordingArguments& a) {
  const auto declare = [&](Command command, const char* name, const char* text, int most) {
    CLI::App* const sub = app.add_subcommand(name, text);
    sub->add_option("recording", a.recordings, "run.mcap that climb or polygmapd wrote")
        ->required()
        ->expected(1, most)
        ->type_name("RUN.mcap");
    a.commands[command] = sub;
    return sub;
  };
  CLI::App* const replay = declare(
      kReplay, "replay",
      "Feed a recording to the module and compare what comes out, to the bit: exit code 0 when nothing differs, 1 with "
      "the first difference, 2 when it cannot be read, 3 when it is unfinished and agrees as far as it goes",
      1);
  replay->add_flag("--json", a.json, "One JSON object instead of lines");
  replay->add_flag("--digests", a.digests,
                   "Instead, print a hash of what each stage left in each second: SECOND STAGE HASH, line by line");
  declare(kReport, "report", "Write one page about a recording, or about two side by side: OUT/report.html", 2)
      ->add_option("--out", a.out, "Directory for report.html")
      ->capture_default_str();
  declare(kInfo, "info", "Say what is in an MCAP file: exit code 2 when it is none, 3 when it was cut off", 1)
      ->add_flag("--json", a.json, "One JSON object instead of lines");
  declare(kPack, "pack", "Make a recording small: zstd in its chunks, which MCAP tools read, in place", 1)
      ->add_option("--out", a.packed, "Another file to write")
      ->type_name("FILE");
}

std::optional<int> run_recording_command(const RecordingArguments& a, std::ostream& out, std::ostream& err) {
  if (a.commands[kReplay]->parsed()) return run_replay(a, out, err);
  if (a.commands[kReport]->parsed()) return run_report(a, out, err);
  if (a.commands[kInfo]->parsed()) return run_info(a, out, err);
  if (a.commands[kPack]->parsed()) return run_pack(a, out, err);
  return std::nullopt;
}

}  // namespace polygmap::sim
