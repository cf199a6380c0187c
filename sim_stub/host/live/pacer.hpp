// SPDX-License-Identifier: Apache-2.0
// Keeps a simulation no faster than so many of its seconds in one of the wall clock's.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

namespace polygmap::sim {

class Pacer {
 public:
  // speed: 0 where nothing is waited for. interrupt: a signal's number ends every wait; null: none.
  explicit Pacer(double speed, const std::atomic<int>* interrupt = nullptr) noexcept
      : speed_(speed), interrupt_(interrupt) {}

  // Until the wall clock is where it is when now_ns, simulated, is due. Who falls behind is not rushed through what was
  // missed: that it is slower shows.
  void wait_for(std::int64_t now_ns);

 private:
  using Clock = std::chrono::steady_clock;
  [[nodiscard]] Clock::duration rest(std::int64_t now_ns) const;

  double speed_;
  const std::atomic<int>* interrupt_;
  bool has_begun_ = false;
  Clock::time_point begun_;
  std::int64_t begun_ns_ = 0;
};

}  // namespace polygmap::sim
