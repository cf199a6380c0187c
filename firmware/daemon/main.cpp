// SPDX-License-Identifier: Apache-2.0
// polygmapd: the module as a robot's service. Exit codes: exit_code.hpp; of --replay those of replay.hpp; of --doctor 0
// when nothing hinders, else 1.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/config/operator_request_text.hpp"
#include "firmware/daemon/devices.hpp"
#include "firmware/daemon/doctor/doctor.hpp"
#include "firmware/daemon/service/service.hpp"
#include "firmware/daemon/watch.hpp"
#include "firmware/mailbox/mailbox_writer.hpp"
#include "firmware/recording/replay.hpp"

namespace polygmap::daemon {
namespace {

constexpr const char* kUsage =
    "polygmapd --config FILE [--record RUN.mcap]   runs the module with the devices of this file; writes all that\n"
    "                                    goes in and comes out, pictures too, for --replay and any MCAP tool\n"
    "polygmapd --config FILE --check     only reads it\n"
    "polygmapd --ask WHAT --config FILE  asks the one that runs with this file to arm, start, pause, resume, stop,\n"
    "                                    reset, hand_over or go_to=AHEAD,LEFT[,[TURN][,UP]] (metres, degrees), or for\n"
    "                                    its state\n"
    "polygmapd --watch [--json] [--config FILE]   looks on at one that runs, and writes the mailbox that FILE names, "
    "else\n"
    "                                    /polygmap: a table in place on a terminal, else a line a second; --json: an\n"
    "                                    object a second\n"
    "polygmapd --replay RUN.mcap         feeds a recording to the module and compares what comes out\n"
    "polygmapd --doctor [--json] [--strict] [--config FILE]   says what on this machine hinders it, and what to do\n"
    "polygmapd --version\n"
    "\n"
    "Exit codes of --config: 0 asked to stop, 1 stopped by itself, 2 configuration, 3 device, 4 no real time, 5 as 0 "
    "with the\n"
    "recording incomplete.\n"
    "Exit codes of --ask: 0 it does so, 1 it refuses and says why, 2 configuration, 3 nobody listens.\n"
    "Exit codes of --watch: 0 ended by a signal, 2 configuration, 3 that mailbox cannot be read.\n"
    "Exit codes of --replay: 0 the same bits, 1 a difference, 2 no recording, 3 an unfinished\n"
    "one that agrees as far as it goes. Of --doctor: 0 nothing hinders, 1 "
    "else; with --strict a warning hinders, too.\n";

struct Options {
  enum class Mode { kRun, kCheck, kAsk, kReplay, kDoctor, kWatch, kHelp, kVersion } mode = Mode::kRun;
  std::string ask;
  std::string config, recording;  // recording: to be replayed, or written
  bool json = false, strict = false;
};

// Empty, or what is wrong.
std::string parse(int argc, char** argv, Options& options) {
  std::vector<std::string_view> modes;
  bool checks = false, records = false;
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    const bool takes_path = word == "--config" || word == "--replay" || word == "--record";
    const bool lacks_value = i + 1 == argc || argv[i + 1][0] == '\0';
    if (takes_path && lacks_value) return std::string(word) + " takes a path";
    const bool may_ask = !lacks_value && (operator_request_of(argv[i + 1]) || argv[i + 1] == std::string_view("state"));
    if (word == "--ask" && !may_ask) return "--ask takes state, or one of " + std::string(kWhatMayBeAsked);
    if (word == "--config") {
      options.config = argv[++i];
    } else if (word == "--record") {
      options.recording = argv[++i];
      records = true;
    } else if (word == "--replay") {
      options.recording = argv[++i];
      options.mode = Options::Mode::kReplay;
      modes.push_back(word);
    } else if (word == "--doctor" || word == "--watch" || word == "--help" || word == "-h" || word == "--version") {
      using enum Options::Mode;
      options.mode = word == "--doctor" ? kDoctor : word == "--watch" ? kWatch : word == "--version" ? kVersion : kHelp;
      modes.push_back(word);
    } else if (word == "--ask") {
      options.ask = argv[++i];
      options.mode = Options::Mode::kAsk;
      modes.push_back(word);
    } else if (word == "--json") {
      options.json = true;
    } else if (word == "--strict") {
      options.strict = true;
    } else if (word == "--check") {
      checks = true;
    } else {
      return "unknown argument " + std::string(word);
    }
  }
  if (modes.size() > 1) return std::string(modes[0]) + " and " + std::string(modes[1]) + " do not go together";
  const bool may_be_json = options.mode == Options::Mode::kDoctor || options.mode == Options::Mode::kWatch;
  if (options.json && !may_be_json) return "--json is of --doctor and --watch";
  if (options.strict && options.mode != Options::Mode::kDoctor) return "--strict is of --doctor";
  const bool needs_config = modes.empty() || options.mode == Options::Mode::kAsk;
  if (needs_config && options.config.empty()) return "--config FILE is missing";
  if (records && (checks || !modes.empty())) return "--record is of --config alone";
  if (checks && !modes.empty()) return "--check is of --config";
  if (checks) options.mode = Options::Mode::kCheck;
  return {};
}

int complain(const std::string& what, ExitCode code) {
  std::fprintf(stderr, "polygmapd: %s\n", what.c_str());
  return number_of(code);
}

int run_replay(const std::string& directory) {
  const recording::ReplayResult result = recording::replay(directory);
  const bool is_read = result.verdict != recording::ReplayVerdict::kUnreadable;
  std::fputs(recording::text_of(result).c_str(), is_read ? stdout : stderr);
  return static_cast<int>(result.verdict);
}

// Empty, or why nothing can be written there.
std::string begin_recording(recording::Recorder& recorder, const std::string& path, const Params& params) {
  recorder.begin(path, params, static_cast<std::uint64_t>(std::chrono::system_clock::now().time_since_epoch().count()));
  return recorder.failed() ? recorder.finish() : std::string();
}

int run_service(const DaemonConfig& config, const std::string& recording_path) {
  const StopSignals signals;
  Notifier notifier;
  if (!notifier.open()) return complain("NOTIFY_SOCKET names no socket that can be used.", ExitCode::kConfiguration);
  Devices devices;
  if (const std::string wrong = devices.open(config); !wrong.empty()) return complain(wrong, ExitCode::kDevice);
  DeviceCounts counts;
  devices.count_in(counts);
  OperatorSocket operator_socket;
  Ports ports = devices.ports();
  if (!config.operator_socket.empty()) {
    const std::string wrong = operator_socket.open(config.operator_socket);
    if (!wrong.empty()) return complain(config.path + ", operator: " + wrong + ".", ExitCode::kDevice);
    ports.operator_input = &operator_socket;
  }
  std::unique_ptr<recording::Recorder> recorder;
  if (!recording_path.empty()) {
    recorder = std::make_unique<recording::Recorder>(ports, &devices.picture_keeper());
    const std::string wrong = begin_recording(*recorder, recording_path, config.params);
    if (!wrong.empty()) return complain(wrong, ExitCode::kRecording);
  }
  MailboxWriter mailbox;
  if (!config.mailbox.empty()) {
    const std::string wrong = mailbox.open({.name = config.mailbox, .group = config.mailbox_group});
    if (!wrong.empty()) return complain(config.path + ", mailbox: " + wrong + ".", ExitCode::kDevice);
  }
  ServiceParts parts{.ports = recorder ? recorder->ports() : ports,
                     .maintain = [&devices] { devices.maintain(); },
                     .let_go = [&devices] { devices.let_go(); },
                     .heap = counted_heap(),
                     .operator_socket = config.operator_socket.empty() ? nullptr : &operator_socket,
                     .devices = &counts,
                     .recorder = recorder.get(),
                     .mailbox = mailbox.is_open() ? &mailbox : nullptr,
                     .hook = row_hook()};
  Service service(config, std::move(parts), signals, notifier);
  const Outcome outcome = service.run();
  std::fprintf(stderr, "polygmapd: %s\n", outcome.why.c_str());
  if (!outcome.recording_failure.empty()) std::fprintf(stderr, "polygmapd: %s\n", outcome.recording_failure.c_str());
  const bool ran = outcome.code == ExitCode::kAsked || outcome.code == ExitCode::kStoppedItself ||
                   outcome.code == ExitCode::kRecording;
  if (ran) std::printf("%s%s", counts.text().c_str(), text_of(outcome).c_str());
  std::fflush(stdout);
  mailbox.tell_closed();
  if (outcome.threads_hang) std::_Exit(number_of(outcome.code));
  return number_of(outcome.code);
}

int run_ask(const Options& options) {
  std::string socket, text;
  try {
    socket = read_operator_socket(options.config);
  } catch (const config::FileError& error) {
    return complain(error.what(), ExitCode::kConfiguration);
  }
  if (socket.empty()) {
    return complain(options.config + " has no key operator: there is nobody to ask.", ExitCode::kConfiguration);
  }
  if (!try_ask(socket, options.ask, text)) return complain(text + ".", ExitCode::kDevice);
  std::puts(text.c_str());
  return text.starts_with(kRefusedAnswer) ? number_of(ExitCode::kStoppedItself) : 0;
}

int run_watch(const Options& options) {
  const StopSignals signals;
  if (options.config.empty()) return run_watch(POLYGMAP_MAILBOX_NAME, options.json, signals);
  std::string mailbox;
  try {
    mailbox = read_mailbox_name(options.config);
  } catch (const config::FileError& error) {
    return complain(error.what(), ExitCode::kConfiguration);
  }
  if (mailbox.empty()) {
    return complain(options.config + " has no key mailbox: there is nothing to watch.", ExitCode::kConfiguration);
  }
  return run_watch(mailbox, options.json, signals);
}

int run_with_config(const Options& options) {
  DaemonConfig config;
  try {
    config = read_daemon_config(options.config);
  } catch (const config::FileError& error) {
    return complain(error.what(), ExitCode::kConfiguration);
  }
  for (const std::string& warning : config.warnings) std::fprintf(stderr, "polygmapd: warning: %s\n", warning.c_str());
  if (options.mode == Options::Mode::kCheck) {
    std::printf("%s can be used.\n", options.config.c_str());
    return 0;
  }
  return run_service(config, options.recording);
}

int run(int argc, char** argv) {
  Options options;
  if (const std::string wrong = parse(argc, argv, options); !wrong.empty()) {
    return complain(wrong + ".\n" + kUsage, ExitCode::kConfiguration);
  }
  switch (options.mode) {
    case Options::Mode::kHelp:
      std::fputs(kUsage, stdout);
      return 0;
    case Options::Mode::kVersion:
      std::puts("polygmapd " POLYGMAP_PROGRAM_VERSION);
      return 0;
    case Options::Mode::kReplay:
      return run_replay(options.recording);
    case Options::Mode::kDoctor:
      return run_doctor(options.config, options.json, options.strict);
    case Options::Mode::kAsk:
      return run_ask(options);
    case Options::Mode::kWatch:
      return run_watch(options);
    case Options::Mode::kRun:
    case Options::Mode::kCheck:
      break;
  }
  return run_with_config(options);
}

}  // namespace
}  // namespace polygmap::daemon

int main(int argc, char** argv) {
  try {
    return polygmap::daemon::run(argc, argv);
  } catch (const std::exception& error) {  // of the library, for want of memory, before the lanes run
    std::fprintf(stderr, "polygmapd: %s\n", error.what());
    return polygmap::daemon::number_of(polygmap::daemon::ExitCode::kConfiguration);
  }
}
