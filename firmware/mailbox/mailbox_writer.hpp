// SPDX-License-Identifier: Apache-2.0
// Makes the mailbox and writes it. One process writes a mailbox: it holds a lock of the kernel on it, which ends with
// the process, however that ends.
#pragma once

#include <cstdint>
#include <string>

#include "firmware/mailbox/mailbox_layout.hpp"

namespace polygmap {

struct MailboxConfig {
  std::string name = POLYGMAP_MAILBOX_NAME;  // a slash and up to 200 characters without one
  std::string group;                         // who may read it beside its owner; empty: the process's own group
  std::uint32_t clock = POLYGMAP_MAILBOX_MONOTONIC;
};

class MailboxWriter {
 public:
  MailboxWriter() = default;
  MailboxWriter(const MailboxWriter&) = delete;
  MailboxWriter& operator=(const MailboxWriter&) = delete;
  ~MailboxWriter() { close(); }

  // Makes it anew, in the stead of one whose writer is gone. Empty, or one sentence. Calls the system; before the
  // lanes.
  [[nodiscard]] std::string open(const MailboxConfig& config);
  // Tells the readers that there is no writer any more, and takes the name away; writes then reach nobody.
  void tell_closed() noexcept;
  // No thread writes any more.
  void close() noexcept;
  [[nodiscard]] bool is_open() const noexcept { return box_ != nullptr; }

  // On one thread, in a cycle: a copy each, nobody is waited for, nothing is asked of the system. now_ns: the cycle's.
  void write(const polygmap_mailbox_pose& pose, std::int64_t now_ns) noexcept {
    write(box_->pose_lock, box_->pose, pose, now_ns);
  }
  void write(const polygmap_mailbox_status& status, std::int64_t now_ns) noexcept {
    write(box_->status_lock, box_->status, status, now_ns);
  }
  // with_polygons: the map has become another one.
  void write(const polygmap_plan& plan, bool with_polygons, std::int64_t now_ns) noexcept {
    const std::size_t polygons = with_polygons ? plan.polygon_count : 0;
    write(box_->plan_lock, &box_->plan, &plan, POLYGMAP_MAILBOX_PLAN_BYTES + polygons * sizeof(polygmap_polygon),
          now_ns);
  }
  void write(const polygmap_mailbox_timing& timing, std::int64_t now_ns) noexcept {
    write(box_->timing_lock, box_->timing, timing, now_ns);
  }
  void write(const polygmap_mailbox_events& events, std::int64_t now_ns) noexcept {
    write(box_->events_lock, box_->events, events, now_ns);
  }

 private:
  template <typename Section>
  static void write(polygmap_mailbox_lock& lock, Section& shared, const Section& own, std::int64_t now_ns) noexcept {
    write(lock, &shared, &own, sizeof own, now_ns);
  }
  static void write(polygmap_mailbox_lock& lock, void* shared, const void* own, std::size_t bytes,
                    std::int64_t now_ns) noexcept {
    const std::uint64_t sequence = lock.sequence;  // nobody else writes it
    __atomic_store_n(&lock.sequence, sequence + 1, __ATOMIC_RELAXED);
    polygmap_mailbox_copy_in(shared, own, bytes);
    __atomic_store_n(&lock.written_ns, now_ns, __ATOMIC_RELAXED);
    __atomic_store_n(&lock.sequence, sequence + 2, __ATOMIC_RELEASE);
  }
  // The mailbox of that name that no process writes, made anew; -1 with why_.
  [[nodiscard]] int take_name(const MailboxConfig& config);

  polygmap_mailbox* box_ = nullptr;
  int fd_ = -1;
  std::string name_, why_;
};

}  // namespace polygmap
