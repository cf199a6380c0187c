// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/live/climb_live.hpp"

#include <chrono>
#include <stdexcept>

#include "sim_stub/heap_trap.hpp"

namespace polygmap::sim {
namespace {

std::int64_t wall_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace

ClimbLive::ClimbLive(LiveDisplay* display, const std::string& mailbox, double pace) : display_(display), meter_(pace) {
  image_.is_virtual = true;
  fill(image_.names);
  if (mailbox.empty()) return;
  std::string wrong = mailbox_.open({.name = mailbox, .group = {}, .clock = POLYGMAP_MAILBOX_VIRTUAL});
  if (wrong.empty()) feed_ = std::make_unique<MailboxFeed>(mailbox_);
  if (wrong.empty()) return;
  wrong.front() = 'T';  // a sentence of its own: "the mailbox ..."
  throw std::runtime_error(wrong + ".");
}

void ClimbLive::after_cycle(const ControlLane& control, const Telemetry& telemetry,
                            const std::function<polygmap_mailbox_timing()>& timing) {
  ++cycles_;
  if (feed_) {
    const heap::ModuleCall call("MailboxFeed::after_cycle");
    if (feed_->after_cycle(control, telemetry)) feed_->write_timing(timing());
  }
  if (display_ != nullptr && display_->is_due(telemetry.now_ns, wall_ns())) show(control, telemetry, timing());
}

void ClimbLive::end(const ControlLane& control, const Telemetry& telemetry,
                    const std::function<polygmap_mailbox_timing()>& timing) {
  if (display_ != nullptr) show(control, telemetry, timing());
}

void ClimbLive::show(const ControlLane& control, const Telemetry& telemetry, const polygmap_mailbox_timing& timing) {
  fill(image_.status, control, telemetry, cycles_);
  fill(image_.events, control.all_faults(), telemetry.now_ns);
  image_.timing = timing;
  display_->show(meter_.view(image_, telemetry.now_ns, wall_ns()), telemetry.now_ns, wall_ns());
}

}  // namespace polygmap::sim
