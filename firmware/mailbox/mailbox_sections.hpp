// SPDX-License-Identifier: Apache-2.0
// The module's values as the mailbox has them. On control's thread, after a cycle; nothing is allocated.
#pragma once

#include <array>
#include <cstdint>

#include "firmware/control_lane.hpp"
#include "firmware/mailbox/mailbox_layout.hpp"
#include "firmware/schedule.hpp"

namespace polygmap {

// What the numbers in the others are called; once.
void fill(polygmap_mailbox_names& names) noexcept;
void fill(polygmap_mailbox_pose& pose, const StateEstimate& state) noexcept;
// cycles: of control, since the start.
void fill(polygmap_mailbox_status& status, const ControlLane& control, const Telemetry& telemetry,
          std::uint64_t cycles) noexcept;
void fill(polygmap_mailbox_events& events, const Health& health, std::int64_t now_ns) noexcept;

}  // namespace polygmap
