// SPDX-License-Identifier: Apache-2.0
// What is written into the mailbox, and when: on control's thread, after each of its cycles. Allocates nothing there,
// waits for nobody and calls no system.
#pragma once

#include <cstdint>

#include "firmware/control_lane.hpp"
#include "firmware/mailbox/mailbox_sections.hpp"
#include "firmware/mailbox/mailbox_writer.hpp"
#include "firmware/telemetry.hpp"

namespace polygmap {

// Pose and status are written in every cycle. The plan is when it has become another one, by a step, a phase or a
// picture in the map, and otherwise every tenth cycle, as its samples go on with time; its polygons with the map.
class MailboxFeed {
 public:
  static constexpr std::uint64_t kPlan_cycles = 10, kSeldom_cycles = 50;

  // mailbox: is open, and outlives it.
  explicit MailboxFeed(MailboxWriter& mailbox) noexcept : mailbox_(mailbox) {}

  // True, every kSeldom_cycles: it is time for write_timing(), too.
  bool after_cycle(const ControlLane& control, const Telemetry& telemetry) noexcept {
    const bool is_seldom = write_state(control, telemetry);
    if (plan_is_due(telemetry)) write_plan(control, telemetry);
    return is_seldom;
  }
  void write_timing(const polygmap_mailbox_timing& timing) noexcept { mailbox_.write(timing, timing.stamp_ns); }

  // Its parts, for who measures them.
  bool write_state(const ControlLane& control, const Telemetry& telemetry) noexcept;
  [[nodiscard]] bool plan_is_due(const Telemetry& telemetry) const noexcept;
  void write_plan(const ControlLane& control, const Telemetry& telemetry) noexcept;

 private:
  MailboxWriter& mailbox_;
  std::uint64_t cycles_ = 0;
  struct {
    GaitPhase phase = GaitPhase::kStandstill;
    std::uint32_t step = 0;
    std::int64_t touch_down_ns = 0, map_ns = -1;
  } written_;
  polygmap_plan plan_{};
};

}  // namespace polygmap
