// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/service/service_mailbox.hpp"

#include "firmware/mailbox/mailbox_sections.hpp"

namespace polygmap::daemon {

void ServiceMailbox::after_cycle(const Pipeline& pipeline, std::int64_t cycle_ns) noexcept {
  ++cycles_;
  const Telemetry telemetry = pipeline.telemetry(cycle_ns, perception_);
  polygmap_mailbox_pose pose;
  fill(pose, telemetry.state);
  mailbox_.write(pose, cycle_ns);
  polygmap_mailbox_status status;
  fill(status, pipeline.control(), telemetry, cycles_);
  mailbox_.write(status, cycle_ns);
  if (cycles_ % kMailboxSeldom_cycles != 1) return;
  polygmap_mailbox_events events;
  fill(events, pipeline.health(), cycle_ns);
  mailbox_.write(events, cycle_ns);
  write_timing(cycle_ns);
}

void ServiceMailbox::write_timing(std::int64_t cycle_ns) noexcept {
  polygmap_mailbox_timing timing{};
  timing.stamp_ns = cycle_ns;
  timing.row_count = static_cast<std::uint32_t>(kSchedule.size());
  timing.lane_count = static_cast<std::uint32_t>(lanes_);
  for (std::size_t row = 0; row < kSchedule.size(); ++row) board_.rows[row].load(timing.rows[row]);
  for (std::size_t lane = 0; lane < lanes_; ++lane) board_.lanes[lane].load(timing.lanes[lane]);
  mailbox_.write(timing, cycle_ns);
}

}  // namespace polygmap::daemon
