// SPDX-License-Identifier: Apache-2.0
// What a CAN controller tells of itself, which the kernel says over netlink only.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace polygmap::daemon {

struct CanLink {
  // As <linux/can/netlink.h> numbers them; none: a virtual interface has no controller.
  enum class State : std::uint8_t { kActive, kWarning, kPassive, kBusOff, kStopped, kSleeping };
  std::optional<State> state;
  std::uint32_t bitrate_bps = 0;  // 0: not told
  std::uint32_t restart_ms = 0;   // after bus-off; 0: it stays off
};
[[nodiscard]] std::string_view name_of(CanLink::State state) noexcept;

// Asks the kernel; none when it gives no answer of such an interface.
[[nodiscard]] std::optional<CanLink> ask_can_link(const std::string& interface);

}  // namespace polygmap::daemon
