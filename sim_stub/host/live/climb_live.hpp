// SPDX-License-Identifier: Apache-2.0
// A simulated climb for those that look on while it goes: a person at a display, programs at the mailbox.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "firmware/live/live_display.hpp"
#include "firmware/live/live_view.hpp"
#include "firmware/mailbox/mailbox_feed.hpp"
#include "firmware/pipeline.hpp"

namespace polygmap::sim {

class ClimbLive {
 public:
  // display: null, nobody looks on. mailbox: its name; empty, there is none. pace: that was asked for, 0: none. Throws
  // std::runtime_error with a sentence where the mailbox cannot be made.
  ClimbLive(LiveDisplay* display, const std::string& mailbox, double pace);

  // After each of the module's cycles. timing: how long rows took, asked for when it is needed.
  void after_cycle(const ControlLane& control, const Telemetry& telemetry,
                   const std::function<polygmap_mailbox_timing()>& timing);
  // The last cycle was the last: its view is shown, due or not.
  void end(const ControlLane& control, const Telemetry& telemetry,
           const std::function<polygmap_mailbox_timing()>& timing);

 private:
  void show(const ControlLane& control, const Telemetry& telemetry, const polygmap_mailbox_timing& timing);

  LiveDisplay* display_;
  MailboxWriter mailbox_;
  std::unique_ptr<MailboxFeed> feed_;  // null: there is no mailbox
  LiveMeter meter_;
  MailboxImage image_;
  std::uint64_t cycles_ = 0;
};

}  // namespace polygmap::sim
