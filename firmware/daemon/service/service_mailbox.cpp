// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/service/service_mailbox.hpp"

namespace polygmap::daemon {

void ServiceMailbox::after_cycle(const Pipeline& pipeline, std::int64_t cycle_ns) noexcept {
  if (feed_.after_cycle(pipeline.control(), pipeline.telemetry(cycle_ns, perception_))) write_timing(cycle_ns);
}

void ServiceMailbox::write_timing(std::int64_t cycle_ns) noexcept {
  polygmap_mailbox_timing timing{};
  timing.stamp_ns = cycle_ns;
  timing.row_count = static_cast<std::uint32_t>(kSchedule.size());
  timing.lane_count = static_cast<std::uint32_t>(lanes_);
  for (std::size_t row = 0; row < kSchedule.size(); ++row) board_.rows[row].load(timing.rows[row]);
  for (std::size_t lane = 0; lane < lanes_; ++lane) board_.lanes[lane].load(timing.lanes[lane]);
  feed_.write_timing(timing);
}

}  // namespace polygmap::daemon
