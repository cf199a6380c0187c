// SPDX-License-Identifier: Apache-2.0
// SIGTERM, SIGINT and SIGHUP as something to wait for, instead of something that interrupts.
#pragma once

#include <pthread.h>
#include <signal.h>

#include <cstdint>
#include <ctime>

namespace polygmap::daemon {

// Made before any other thread: all threads are to have these signals blocked. SIGPIPE is ignored from then on.
class StopSignals {
 public:
  StopSignals() noexcept {
    ::sigemptyset(&signals_);
    for (const int number : {SIGTERM, SIGINT, SIGHUP}) ::sigaddset(&signals_, number);
    ::pthread_sigmask(SIG_BLOCK, &signals_, &before_);
    ::signal(SIGPIPE, SIG_IGN);
  }
  ~StopSignals() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  // The signal that came within this time, 0 for none.
  [[nodiscard]] int wait(std::int64_t most_ns) const noexcept {
    constexpr std::int64_t kNsPerSecond = 1'000'000'000;
    const timespec most{most_ns / kNsPerSecond, most_ns % kNsPerSecond};
    const int number = ::sigtimedwait(&signals_, nullptr, &most);
    return number > 0 ? number : 0;
  }

 private:
  sigset_t signals_{}, before_{};
};

}  // namespace polygmap::daemon
