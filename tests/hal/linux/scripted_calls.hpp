// SPDX-License-Identifier: Apache-2.0
// System calls that fail when told to, and otherwise go on to the kernel or to a device made up by a test. One lives at
// a time.
#pragma once

#include <sys/mman.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <type_traits>

#include "hal/linux/system/system_calls.hpp"
#include "sim_stub/heap_trap.hpp"

namespace polygmap::test {

enum class Call : std::size_t {
  kOpen,
  kClose,
  kIoctl,
  kRead,
  kMmap,
  kMunmap,
  kSocket,
  kBind,
  kSetsockopt,
  kRecvmmsg,
  kSendmmsg,
  kTcgetattr,
  kTcsetattr,
  kClockGettime,
  kCount
};

class ScriptedCalls {
 public:
  explicit ScriptedCalls(const hal::SystemCalls& below = hal::kernel_calls()) : below_(below) { active() = this; }
  ~ScriptedCalls() { active() = nullptr; }
  ScriptedCalls(const ScriptedCalls&) = delete;
  ScriptedCalls& operator=(const ScriptedCalls&) = delete;

  // The next `count` calls of this kind after `skip` others answer with this errno.
  void fail(Call call, int error_number, std::size_t count = 1, std::size_t skip = 0) {
    Fault& f = faults_[static_cast<std::size_t>(call)];
    f = {error_number, calls(call) + skip, calls(call) + skip + count};
  }
  // The same of call number nth (from 0) of any kind.
  void fail_any(std::size_t nth, int error_number) { any_ = {error_number, nth, nth + 1}; }
  std::function<void(mmsghdr*, int)> after_recvmmsg;              // may change what arrived
  std::function<void(unsigned long request, void*)> after_ioctl;  // of one that succeeded
  std::size_t most_read_bytes = std::numeric_limits<std::size_t>::max();

  [[nodiscard]] const hal::SystemCalls& table() const;
  [[nodiscard]] std::size_t calls(Call call) const { return made_[static_cast<std::size_t>(call)]; }
  [[nodiscard]] std::size_t all_calls() const { return all_made_; }
  [[nodiscard]] std::optional<Call> failed_any() const { return failed_any_; }  // the kind that fail_any hit
  [[nodiscard]] int open_descriptors() const { return descriptors_; }
  [[nodiscard]] int mappings() const { return mappings_; }

 private:
  struct Fault {
    int error_number = 0;
    std::size_t begin = 0, end = 0;
  };
  static ScriptedCalls*& active() {
    static ScriptedCalls* one = nullptr;
    return one;
  }
  [[nodiscard]] bool fails(Call call) {
    const std::size_t nth = made_[static_cast<std::size_t>(call)]++;
    const std::size_t nth_of_all = all_made_++;
    const Fault& f = faults_[static_cast<std::size_t>(call)];
    if (nth >= f.begin && nth < f.end) return errno = f.error_number, true;
    if (nth_of_all >= any_.begin && nth_of_all < any_.end) {
      failed_any_ = call;
      errno = any_.error_number;
      return true;
    }
    return false;
  }
  template <Call kCall, auto kMember, typename R, typename... A>
  static R forward(A... a) noexcept {
    const heap::HostCall host;  // a device made up by a test may use the heap
    ScriptedCalls& self = *active();
    // A close that fails has closed; an unmap has not failed before.
    const bool failing = self.fails(kCall);
    const int error_number = errno;
    if (failing && kCall != Call::kClose && kCall != Call::kMunmap) {
      if constexpr (std::is_pointer_v<R>) return MAP_FAILED;
      if constexpr (!std::is_pointer_v<R>) return R{-1};
    }
    const R answer = (self.below_.*kMember)(a...);
    if constexpr (kCall == Call::kOpen || kCall == Call::kSocket) self.descriptors_ += answer >= 0 ? 1 : 0;
    if constexpr (kCall == Call::kClose) --self.descriptors_;
    if constexpr (kCall == Call::kMmap) self.mappings_ += answer != MAP_FAILED ? 1 : 0;
    if constexpr (kCall == Call::kMunmap) --self.mappings_;
    if constexpr (std::is_same_v<R, int>) {
      if (failing) return errno = error_number, -1;
    }
    return answer;
  }
  template <Call kCall, auto kMember, typename R, typename... A>
  static constexpr auto forwarder(R (*hal::SystemCalls::*)(A...) noexcept) {
    return &forward<kCall, kMember, R, A...>;
  }

  const hal::SystemCalls& below_;
  std::array<Fault, static_cast<std::size_t>(Call::kCount)> faults_{};
  Fault any_;
  std::optional<Call> failed_any_;
  std::array<std::size_t, static_cast<std::size_t>(Call::kCount)> made_{};
  std::size_t all_made_ = 0;
  int descriptors_ = 0;
  int mappings_ = 0;
};

inline const hal::SystemCalls& ScriptedCalls::table() const {
  using S = hal::SystemCalls;
  static constexpr S kTable{
      .open = forwarder<Call::kOpen, &S::open>(&S::open),
      .close = forwarder<Call::kClose, &S::close>(&S::close),
      .ioctl =
          [](int fd, unsigned long request, void* argument) noexcept {
            const int answer = forward<Call::kIoctl, &S::ioctl, int>(fd, request, argument);
            const int error_number = errno;
            const heap::HostCall host;
            if (answer == 0 && active()->after_ioctl) active()->after_ioctl(request, argument);
            return errno = error_number, answer;
          },
      .read =
          [](int fd, void* buffer, std::size_t size) noexcept {
            return forward<Call::kRead, &S::read, ssize_t>(fd, buffer, std::min(size, active()->most_read_bytes));
          },
      .mmap = forwarder<Call::kMmap, &S::mmap>(&S::mmap),
      .munmap = forwarder<Call::kMunmap, &S::munmap>(&S::munmap),
      .socket = forwarder<Call::kSocket, &S::socket>(&S::socket),
      .bind = forwarder<Call::kBind, &S::bind>(&S::bind),
      .setsockopt = forwarder<Call::kSetsockopt, &S::setsockopt>(&S::setsockopt),
      .recvmmsg =
          [](int fd, mmsghdr* messages, unsigned count, int flags) noexcept {
            const int n = forward<Call::kRecvmmsg, &S::recvmmsg, int>(fd, messages, count, flags);
            const heap::HostCall host;
            if (n > 0 && active()->after_recvmmsg) active()->after_recvmmsg(messages, n);
            return n;
          },
      .sendmmsg = forwarder<Call::kSendmmsg, &S::sendmmsg>(&S::sendmmsg),
      .tcgetattr = forwarder<Call::kTcgetattr, &S::tcgetattr>(&S::tcgetattr),
      .tcsetattr = forwarder<Call::kTcsetattr, &S::tcsetattr>(&S::tcsetattr),
      .clock_gettime = forwarder<Call::kClockGettime, &S::clock_gettime>(&S::clock_gettime),
  };
  return kTable;
}

// The faults that every driver is tried with at each of its calls.
inline constexpr std::array<int, 10> kErrors{EINTR, EAGAIN, ENOBUFS, ENETDOWN, ENODEV,
                                             EIO,   EBADF,  EINVAL,  ENOMEM,   ENXIO};

}  // namespace polygmap::test
