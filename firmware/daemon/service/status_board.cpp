// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/service/status_board.hpp"

#include <cinttypes>

namespace polygmap::daemon {
namespace {

void add_joints(StatusText& out, const char* what, JointSet joints) noexcept {
  if (joints.is_empty()) return;
  out.add("%s", what);
  const char* between = " ";
  for (std::size_t n = 0; n < kJointCount; ++n) {
    if (!joints.contains(n)) continue;
    out.add("%s%.*s", between, static_cast<int>(kJointNames[n].size()), kJointNames[n].data());
    between = ", ";
  }
}

}  // namespace

const char* name_of(GaitPhase phase) noexcept {
  switch (phase) {
    case GaitPhase::kStandstill:
      return "standing";
    case GaitPhase::kDoubleSupport:
      return "double support";
    case GaitPhase::kSwing:
      return "swing";
    case GaitPhase::kFinished:
      return "finished";
    case GaitPhase::kStopped:
      return "stopped";
  }
  return "unknown";
}

const char* name_of(StopReason reason) noexcept {
  constexpr std::array kNames{"no reason",
                              "nothing to step on is seen",
                              "no staircase is seen",
                              "on top",
                              "the next rise is too high",
                              "the next tread is too short",
                              "the stairs are too narrow",
                              "the map is too old",
                              "the next edge is not known well enough",
                              "something stands in the way",
                              "the legs cannot do the next step",
                              "what is seen keeps changing",
                              "it does not stand straight before the stairs",
                              "there was no ground under the foot",
                              "the body toppled",
                              "IMU or joints fell silent",
                              "asked to stop",
                              "a drive told of an error",
                              "control came late again and again",
                              "a bus took no commands"};
  static_assert(kNames.size() == static_cast<std::size_t>(StopReason::kCommandsRefused) + 1);
  const auto i = static_cast<std::size_t>(reason);
  return i < kNames.size() ? kNames[i] : "unknown";
}

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

void write_status(StatusText& out, const StatusBoard& board, std::size_t lanes, std::uint64_t heap_calls) noexcept {
  const ModuleView view = board.module();
  const std::string_view state = polygmap::name_of(view.state);
  out.add("%.*s", static_cast<int>(state.size()), state.data());
  if (view.state == ModuleState::kArming) {
    add_joints(out, ", no answer yet from", view.unheard);
  } else {
    out.add(", %s", name_of(view.phase));
    if (view.state == ModuleState::kSafeStop) out.add(": %s", name_of(view.reason));
    out.add(", %u treads", view.treads);
    add_joints(out, ", silent:", view.silent);
  }
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
    out.add("%s%.*s %u", before, static_cast<int>(kFaultTable[i].name.size()), kFaultTable[i].name.data(),
            board.fault(i));
    before = ", ";
  }
}

}  // namespace polygmap::daemon
