// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/service/status_board.hpp"

#include <cinttypes>

namespace polygmap::daemon {
namespace {

void add_text(StatusText& out, const char* before, std::string_view text) noexcept {
  out.add("%s%.*s", before, static_cast<int>(text.size()), text.data());
}

void add_joints(StatusText& out, const char* what, JointSet joints) noexcept {
  if (joints.is_empty()) return;
  out.add("%s", what);
  const char* between = " ";
  for (std::size_t n = 0; n < kJointCount; ++n) {
    if (!joints.contains(n)) continue;
    add_text(out, between, kJointNames[n]);
    between = ", ";
  }
}

void add_wait(StatusText& out, const ArmingWait& wait) noexcept {
  if (wait.what == ArmingWait::For::kNothing) return;
  add_text(out, ", ", "");
  if (wait.leans()) out.add("%u ", wait.lean_deg);
  add_text(out, "", text_of(wait.what));
  add_joints(out, "", wait.joints);
}

}  // namespace

void write_late_rows(StatusText& out, const StatusBoard& board) noexcept {
  const char* before = "; rows over their budget: ";
  for (std::size_t row = 0; row < kSchedule.size(); ++row) {
    const std::uint64_t overruns = board.rows[row].overruns.load(std::memory_order_relaxed);
    if (overruns == 0) continue;
    out.add("%s%s %" PRIu64 " (up to %" PRIu64 " us)", before, kSchedule[row].task.data(), overruns,
            board.rows[row].longest_ns.load(std::memory_order_relaxed) / 1000);
    before = ", ";
  }
}

void write_more_late_rows(StatusText& out, const StatusBoard& board, RowOverruns& told) noexcept {
  const char* before = "rows over their budget: ";
  for (std::size_t row = 0; row < kSchedule.size(); ++row) {
    const std::uint64_t overruns = board.rows[row].overruns.load(std::memory_order_relaxed);
    if (overruns == told[row]) continue;
    out.add("%s%s %" PRIu64 " (+%" PRIu64 ", up to %" PRIu64 " us of %d)", before, kSchedule[row].task.data(), overruns,
            overruns - told[row], board.rows[row].longest_ns.load(std::memory_order_relaxed) / 1000,
            kSchedule[row].budget_us);
    told[row] = overruns;
    before = ", ";
  }
}

void write_module(StatusText& out, const ModuleView& view) noexcept {
  add_text(out, "", name_of(view.state));
  if (view.state == ModuleState::kArming) {
    add_wait(out, view.waits_for);
  } else if (view.state != ModuleState::kOff) {
    add_text(out, ", ", name_of(view.phase));
    if (view.state == ModuleState::kSafeStop) add_text(out, ": ", text_of(view.reason));
    out.add(", %u treads", view.treads);
    add_joints(out, ", silent:", view.silent);
    add_joints(out, ", too hot:", view.hot);
  }
}

void write_status(StatusText& out, const StatusBoard& board, std::size_t lanes, std::uint64_t heap_calls) noexcept {
  write_module(out, board.module());
  std::uint64_t overruns = 0, skipped = 0;
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    overruns += board.lanes[lane].overruns.load(std::memory_order_relaxed);
    skipped += board.lanes[lane].skipped.load(std::memory_order_relaxed);
  }
  out.add("; cycles %" PRIu64 ", overruns %" PRIu64 ", skipped %" PRIu64 ", heap calls %" PRIu64,
          board.lanes[0].cycles.load(std::memory_order_relaxed), overruns, skipped, heap_calls);
  write_late_rows(out, board);
  const char* before = "; faults ";
  for (std::size_t i = 0; i < kFaultTable.size(); ++i) {
    if (board.fault(i) == 0) continue;
    add_text(out, before, kFaultTable[i].name);
    out.add(" %u", board.fault(i));
    before = ", ";
  }
}

}  // namespace polygmap::daemon
