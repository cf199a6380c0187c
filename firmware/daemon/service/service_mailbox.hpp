// SPDX-License-Identifier: Apache-2.0
// Writes the mailbox on control's thread, after each of its cycles. Allocates nothing there, waits for nobody, and
// calls no system.
#pragma once

#include <cstdint>

#include "firmware/daemon/service/status_board.hpp"
#include "firmware/mailbox/mailbox_feed.hpp"
#include "firmware/pipeline.hpp"

namespace polygmap::daemon {

class ServiceMailbox {
 public:
  // All of them outlive it. mailbox: is open. lanes: of the daemon.
  ServiceMailbox(MailboxWriter& mailbox, const StatusBoard& board, std::size_t lanes) noexcept
      : feed_(mailbox), board_(board), lanes_(lanes) {}

  // Before the first cycle: perception then copies what it finishes into memory of this.
  void watch(Pipeline& pipeline) noexcept { pipeline.watch(perception_); }
  // On control's thread.
  void after_cycle(const Pipeline& pipeline, std::int64_t cycle_ns) noexcept;

 private:
  void write_timing(std::int64_t cycle_ns) noexcept;

  MailboxFeed feed_;
  const StatusBoard& board_;
  std::size_t lanes_;
  PerceptionTelemetry perception_;
};

}  // namespace polygmap::daemon
