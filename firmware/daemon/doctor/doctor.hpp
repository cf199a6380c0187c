// SPDX-License-Identifier: Apache-2.0
// Looks at the machine and says what hinders the daemon, each finding with what to do about it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace polygmap::daemon {

enum class Verdict : std::uint8_t { kGood, kWarning, kBad };

struct Finding {
  std::string name;     // "kernel"
  Verdict verdict = Verdict::kGood;
  std::string what;     // one sentence
  std::string to_do;    // empty when it is good
};

struct ProcessLimits {
  // Of this process; kUnlimited: none.
  static constexpr std::uint64_t kUnlimited = ~std::uint64_t{0};
  std::uint64_t rt_priority = 0;
  std::uint64_t locked_bytes = 0;
  bool may_have_any_priority = false;  // CAP_SYS_NICE
  bool may_lock_any_memory = false;    // CAP_IPC_LOCK
};

// What is looked at; a test gives folders of its own.
struct DoctorInput {
  std::string proc = "/proc", sys = "/sys", dev = "/dev";
  ProcessLimits limits;
  std::vector<std::string> buses;     // interfaces; empty: those that the machine has
  std::string camera;                 // its path; empty: any
  std::vector<int> processors;        // of the lanes
  int priority = 80;                  // of the lanes, the highest
};

[[nodiscard]] std::vector<Finding> examine(const DoctorInput& input);

// Wakes every cycle for some time, as a lane does, and says how late.
struct WakeUps {
  static constexpr std::size_t kBuckets = 8;
  static constexpr std::uint32_t kFirst_us = 10;  // bucket b: below 10, 20, 40, ... us; the last one all above
  std::uint32_t counts[kBuckets] = {};
  std::uint32_t woken = 0;
  std::uint64_t max_ns = 0;
  bool was_real_time = false;

  void add(std::uint64_t late_ns) noexcept;
};
[[nodiscard]] WakeUps measure_wake_ups(int processor, int priority, std::uint32_t cycles);
[[nodiscard]] Finding finding_of(const WakeUps& wake_ups);

[[nodiscard]] std::string text_of(const std::vector<Finding>& findings);
[[nodiscard]] std::string json_of(const std::vector<Finding>& findings, const WakeUps& wake_ups);

// Of polygmapd --doctor: prints it all. 0: nothing hinders; 1: something does; 2: the file cannot be used.
[[nodiscard]] int run_doctor(const std::string& config_path, bool json);

}  // namespace polygmap::daemon
