// SPDX-License-Identifier: Apache-2.0
// Looks at the machine and says what hinders the daemon, each finding with what to do about it.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/daemon/config/daemon_config.hpp"
#include "firmware/daemon/doctor/can_link.hpp"
#include "firmware/daemon/system/lane_thread.hpp"
#include "firmware/lane_link.hpp"

namespace polygmap::daemon {

enum class Verdict : std::uint8_t {
  kGood,
  kWarning,  // the daemon runs, and may be late
  kBad,      // it does not start, or cannot work
};

struct Finding {
  std::string name;  // "kernel"
  Verdict verdict = Verdict::kGood;
  std::string what;   // one sentence
  std::string to_do;  // empty when it is good
};

struct ProcessLimits {
  static constexpr std::uint64_t kUnlimited = ~std::uint64_t{0};
  std::uint64_t rt_priority = 0;
  std::uint64_t locked_bytes = 0;
  bool may_have_any_priority = false;  // CAP_SYS_NICE
  bool may_lock_any_memory = false;    // CAP_IPC_LOCK
};
// Of this process; its capabilities from proc's status.
[[nodiscard]] ProcessLimits limits_of_this_process(const std::string& proc);

// All that mlockall() holds: the program, the module, stacks, pictures.
[[nodiscard]] std::uint64_t needed_memory_bytes();

// What is looked at; a test gives folders of its own.
struct DoctorInput {
  std::string proc = "/proc", sys = "/sys";
  ProcessLimits limits;
  std::uint64_t needed_bytes = needed_memory_bytes();
  std::function<std::optional<CanLink>(const std::string&)> can_link = ask_can_link;
  std::vector<std::string> buses;  // interfaces; empty: those that the machine has
  std::uint32_t bitrate_bps = 0;   // that the buses are to have; 0: any
  std::string camera;              // its path; empty: any
  std::vector<int> processors;     // of the lanes
  std::uint64_t priority = 80;     // the lanes' highest
  std::size_t lanes = kLaneCount;
  std::vector<std::string> warnings;  // of the daemon's file
};

[[nodiscard]] std::vector<Finding> examine(const DoctorInput& input);

// How late a thread wakes that is due every cycle, as a lane is.
struct WakeUps {
  static constexpr std::size_t kBuckets = 10;
  // Bucket b counts what was later than those before it and below this; the last one all the rest.
  [[nodiscard]] static constexpr std::uint32_t below_us(std::size_t bucket) noexcept { return 5U << bucket; }
  std::array<std::uint32_t, kBuckets> counts{};
  std::uint32_t woken = 0;
  std::uint64_t max_ns = 0;
  bool was_real_time = false;
  bool lacks_processor = false;  // the machine does: no right would help

  void add(std::uint64_t late_ns) noexcept;
};
struct LaneWakeUps {
  std::string lane;  // "control"; empty: of no lane, where no file says how they run
  LaneThread::Placement placement;
  WakeUps wake_ups;
};
// As a daemon's file places them.
[[nodiscard]] std::vector<LaneWakeUps> lanes_of(const DaemonConfig& config);
// Each on a thread of its own, all at once, as the lanes run. Without the right to a priority, or with a processor that
// the machine lacks, on an ordinary one.
void measure_wake_ups(std::vector<LaneWakeUps>& lanes, std::uint32_t cycles);
// What a lane's rows leave of a cycle at their budgets: who wakes later than that gives work up, or overruns.
[[nodiscard]] std::uint64_t slack_ns(std::size_t lanes) noexcept;
// Good up to half of the slack, since two seconds show less than an hour; bad beyond all of it.
[[nodiscard]] Finding finding_of(const LaneWakeUps& lane, std::uint64_t slack_ns);

[[nodiscard]] std::string text_of(const std::vector<Finding>& findings, const std::vector<LaneWakeUps>& lanes);
[[nodiscard]] std::string json_of(const std::vector<Finding>& findings, const std::vector<LaneWakeUps>& lanes);

// Of polygmapd --doctor: prints it all. With a daemon's file, it looks at the devices and processors that it names.
// Returns 0: nothing is bad; 1: something is, or with strict a warning; 2: the file cannot be used.
[[nodiscard]] int run_doctor(const std::string& config_path, bool json, bool strict);

}  // namespace polygmap::daemon
