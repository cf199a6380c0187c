// SPDX-License-Identifier: Apache-2.0
// Runs the module on its lanes until it is asked to stop or has stopped, and tells the service manager how it is.
//
// The module arms by itself (control_lane.hpp): until all drives have answered its commands have no gains. Asked to
// stop while it arms, it lets go of the drives. Asked later, a foot in the air comes down first, and the drives keep
// the last command: the robot stands on them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "firmware/daemon/config/daemon_config.hpp"
#include "firmware/daemon/exit_code.hpp"
#include "firmware/daemon/service/device_counts.hpp"
#include "firmware/daemon/service/operator_socket.hpp"
#include "firmware/daemon/service/row_hook.hpp"
#include "firmware/daemon/service/service_mailbox.hpp"
#include "firmware/daemon/service/status_board.hpp"
#include "firmware/daemon/service/stop_signals.hpp"
#include "firmware/daemon/system/heap_count.hpp"
#include "firmware/daemon/system/notifier.hpp"
#include "firmware/pipeline.hpp"
#include "firmware/recording/recorder.hpp"
#include "hal/linux/system/posix_clock.hpp"

namespace polygmap::daemon {

struct ServiceParts {
  Ports ports;
  std::function<void()> maintain = [] {};  // some ten times a second, on a thread of its own that may block
  std::function<void()> let_go = [] {};    // once, after the lanes, when the drives never had gains
  HeapCount heap{};
  OperatorSocket* operator_socket = nullptr;  // the port of it, or of who records it; null: none
  DeviceCounts* devices = nullptr;            // null: there are no drivers whose counters could be told
  recording::Recorder* recorder = nullptr;    // has begun, and stands before the ports; null: nothing is recorded
  MailboxWriter* mailbox = nullptr;           // is open; null: there is none
  RowHook* hook = nullptr;                    // of a test's build
};

struct Outcome {
  ExitCode code = ExitCode::kAsked;
  std::string why;                // one sentence
  bool threads_hang = false;      // a lane's or maintain()'s still run: the process can only be left by _Exit
  std::string recording_failure;  // one sentence; empty when all was recorded, or nothing was to be
  ModuleView module;              // at the end
  std::uint64_t cycles = 0;       // of control
  std::uint64_t overruns = 0, skipped = 0, caught_up = 0;  // of all lanes
  std::uint64_t heap_calls = 0;
  std::uint64_t page_faults = 0;  // of the lanes' threads, from their first cycle on
  std::uint64_t wake_max_ns = 0;  // from a cycle's due time to its tick
  std::size_t stack_bytes = 0;    // the most that a lane used
  struct LateRow {
    std::uint64_t overruns = 0, longest_ns = 0;
  };
  std::array<LateRow, kSchedule.size()> rows{};
};
// A line for each row that overran, "row surfaces budget_us=840 overruns=3 longest_us=1203"; last one of all,
// "stopped state=... cycles=...". Each with its end.
[[nodiscard]] std::string text_of(const Outcome& outcome);

class Service {
 public:
  // All of them outlive it; the module is made here and runs in run().
  Service(const DaemonConfig& config, ServiceParts parts, const StopSignals& signals, Notifier& notifier);
  ~Service();
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  [[nodiscard]] Outcome run();

  struct Decision {
    ExitCode code;
    const char* why;
  };
  // Of who was asked to stop; empty: a foot has yet to come down.
  [[nodiscard]] static std::optional<Decision> decision_when_asked(const ModuleView& view) noexcept;

 private:
  struct LaneRun;
  class Tasks;

  // May block, and does not hold up the end for longer than a moment.
  struct Helper {
    LaneThread thread;
    std::atomic<bool> runs{false};
    std::atomic<bool> has_ended{false};
    [[nodiscard]] bool ends_before(std::int64_t until_ns) const noexcept;
  };

  // Each: empty, or why there is no real time. What it has started by then the destructor ends.
  [[nodiscard]] std::string start();
  [[nodiscard]] std::string lock_memory() const;
  [[nodiscard]] std::string start_lanes();
  [[nodiscard]] std::string start_helpers();
  [[nodiscard]] std::string start_helper(Helper& helper, void* (*function)(void*), const char* purpose);
  template <const auto& Table, std::size_t Lane>
  void run_lane(LaneRun& lane) noexcept;
  // Until it is decided how this ends.
  [[nodiscard]] Decision watch();
  void maintain() noexcept;
  void write_recording() noexcept;
  [[nodiscard]] std::optional<Decision> decide(std::int64_t now_ns);
  [[nodiscard]] bool lanes_move(std::int64_t now_ns) noexcept;
  void tell(std::int64_t now_ns) noexcept;
  void log_changes() noexcept;
  // What went wrong since it was said last, at most once a second: rows over their budget, and the drivers' counters.
  void log_trouble(std::int64_t now_ns) noexcept;
  [[nodiscard]] bool all_end_within(std::int64_t most_ns) const noexcept;  // the lanes
  void finish(Outcome& outcome);
  void finish_recording(Outcome& outcome, bool lanes_hang);

  const DaemonConfig& config_;
  ServiceParts parts_;
  const StopSignals& signals_;
  Notifier& notifier_;
  hal::PosixClock clock_;
  StatusBoard board_;
  std::unique_ptr<Pipeline> pipeline_;
  std::unique_ptr<ServiceMailbox> mailbox_;
  std::unique_ptr<Tasks> tasks_;
  std::array<std::unique_ptr<LaneRun>, kLaneCount> lanes_;
  std::atomic<std::int64_t> first_due_ns_{0};  // 0: the lanes wait for it
  std::atomic<bool> ends_{false};
  Helper maintainer_, writer_;
  struct {
    std::int64_t asked_ns = -1, stopped_ns = -1;  // negative: not yet
    std::int64_t told_ns = 0, fed_ns = 0, moved_ns = 0, complained_ns = 0;
    std::array<std::uint64_t, kLaneCount> cycles{};
    std::array<std::uint64_t, kLaneCount> fed_cycles{};
    bool is_ready = false, recording_failed = false;
  } seen_;
  ModuleView logged_;
  RowOverruns logged_overruns_{};
};

}  // namespace polygmap::daemon
