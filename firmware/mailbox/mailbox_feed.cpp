// SPDX-License-Identifier: Apache-2.0
#include "firmware/mailbox/mailbox_feed.hpp"

#include "firmware/link/plan_reading.hpp"

namespace polygmap {

bool MailboxFeed::write_state(const ControlLane& control, const Telemetry& telemetry) noexcept {
  ++cycles_;
  polygmap_mailbox_pose pose;
  fill(pose, telemetry.state);
  mailbox_.write(pose, telemetry.now_ns);
  polygmap_mailbox_status status;
  fill(status, control, telemetry, cycles_);
  mailbox_.write(status, telemetry.now_ns);
  if (cycles_ % kSeldom_cycles != 1) return false;
  polygmap_mailbox_events events;
  fill(events, control.all_faults(), telemetry.now_ns);
  mailbox_.write(events, telemetry.now_ns);
  return true;
}

bool MailboxFeed::plan_is_due(const Telemetry& telemetry) const noexcept {
  const GaitStatus& gait = telemetry.gait;
  return cycles_ % kPlan_cycles == 0 || telemetry.map.stamp_ns != written_.map_ns || gait.phase != written_.phase ||
         gait.step.sequence != written_.step || gait.step.touch_down_stamp_ns != written_.touch_down_ns;
}

void MailboxFeed::write_plan(const ControlLane& control, const Telemetry& telemetry) noexcept {
  const GaitStatus& gait = telemetry.gait;
  const bool is_other_map = telemetry.map.stamp_ns != written_.map_ns;
  written_ = {gait.phase, gait.step.sequence, gait.step.touch_down_stamp_ns, telemetry.map.stamp_ns};
  const link::PlanSource source{control, telemetry.map, telemetry.now_ns};
  const link::InstanceClock clock = link::InstanceClock::of_module();
  link::read_steps(source, clock, plan_);
  if (is_other_map) link::read_polygons(source, clock, plan_);
  mailbox_.write(plan_, is_other_map, telemetry.now_ns);
}

}  // namespace polygmap
