// SPDX-License-Identifier: Apache-2.0
// Time that passes by the tick.
#pragma once

#include <cstdint>

#include "algorithms/core/messages/samples.hpp"

namespace polygmap::sim {

class VirtualClock {
 public:
  static constexpr std::int64_t kTick_ns = 2 * kNsPerMs;
  // 0 means "never" in many stamps, so time starts later: at 32 whole major frames of 32 ms.
  static constexpr std::int64_t kStart_ns = 32 * 32 * kNsPerMs;
  static constexpr double kCountsPerUs = 1000.0;

  [[nodiscard]] std::int64_t tick() const noexcept { return tick_; }
  [[nodiscard]] static constexpr std::int64_t stamp_ns(std::int64_t tick) noexcept {
    return kStart_ns + tick * kTick_ns;
  }
  [[nodiscard]] std::int64_t now_ns() const noexcept { return stamp_ns(tick_); }
  // Stands still within a tick unless a test injects work, so a run is the same every time.
  [[nodiscard]] std::uint64_t count() const noexcept { return static_cast<std::uint64_t>(now_ns()) + injected_; }

  void advance() noexcept { ++tick_; }
  void inject_count(std::uint64_t counts) noexcept { injected_ += counts; }

 private:
  std::int64_t tick_ = 0;
  std::uint64_t injected_ = 0;
};

}  // namespace polygmap::sim
