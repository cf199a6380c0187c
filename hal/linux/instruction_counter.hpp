// SPDX-License-Identifier: Apache-2.0
// Counts what the calling thread executes: the same call in an emulator, where it is exact, and on the robot.
#pragma once

#include <linux/perf_event.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>

namespace polygmap::hal {

struct InstructionCount {
  std::uint64_t user = 0;
  std::uint64_t kernel = 0;  // in system calls, and in interrupts that came while the thread ran
};
[[nodiscard]] constexpr InstructionCount operator-(const InstructionCount& a, const InstructionCount& b) noexcept {
  return {a.user - b.user, a.kernel - b.kernel};
}

class InstructionCounter {
 public:
  InstructionCounter() noexcept = default;
  InstructionCounter(const InstructionCounter&) = delete;
  InstructionCounter& operator=(const InstructionCounter&) = delete;
  ~InstructionCounter() {
    if (kernel_ >= 0) close(kernel_);
    if (user_ >= 0) close(user_);
  }

  // Counts the calling thread from now on. 0, or errno: ENOENT where the machine counts no instructions, EACCES where
  // kernel.perf_event_paranoid does not let this process. A kernel count that alone is refused stays zero.
  [[nodiscard]] int start() noexcept {
    user_ = open_event(false, -1);
    if (user_ < 0) return errno;
    kernel_ = open_event(true, user_);
    constexpr int kTries = 64;
    InstructionCount last = read();
    cost_ = {UINT64_MAX, UINT64_MAX};
    for (int i = 0; i < kTries; ++i) {
      const InstructionCount now = read();
      const InstructionCount spent = now - last;
      cost_ = {spent.user < cost_.user ? spent.user : cost_.user,
               spent.kernel < cost_.kernel ? spent.kernel : cost_.kernel};
      last = now;
    }
    return 0;
  }

  // Since start(). Zero before, and where the kernel gives no answer.
  [[nodiscard]] InstructionCount read() const noexcept {
    std::array<std::uint64_t, 3> group{};  // number of counters, then one value each
    if (user_ < 0 || ::read(user_, group.data(), sizeof group) < 0) return {};
    return {group[1], group[2]};
  }
  // What one read() adds to the counts itself, the least of many: to be taken off, once a read.
  [[nodiscard]] InstructionCount read_cost() const noexcept { return cost_; }

 private:
  static int open_event(bool kernel, int leader) noexcept {
    perf_event_attr attributes{};
    attributes.type = PERF_TYPE_HARDWARE;
    attributes.size = sizeof attributes;
    attributes.config = PERF_COUNT_HW_INSTRUCTIONS;
    attributes.exclude_user = kernel ? 1 : 0;
    attributes.exclude_kernel = kernel ? 0 : 1;
    attributes.exclude_hv = 1;
    attributes.read_format = PERF_FORMAT_GROUP;
    constexpr int kThisThread = 0, kAnyProcessor = -1;
    return static_cast<int>(
        syscall(SYS_perf_event_open, &attributes, kThisThread, kAnyProcessor, leader, PERF_FLAG_FD_CLOEXEC));
  }

  int user_ = -1, kernel_ = -1;
  InstructionCount cost_;
};

}  // namespace polygmap::hal
