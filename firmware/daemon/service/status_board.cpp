// SPDX-License-Identifier: Apache-2.0
#include "firmware/daemon/service/status_board.hpp"

#include <algorithm>
#include <cinttypes>
#include <cstdarg>
#include <cstdio>
#include <string_view>

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

}  // namespace

void StatusText::add(const char* format, ...) noexcept {
  va_list arguments;
  va_start(arguments, format);
  const int wanted = std::vsnprintf(text.data() + length, text.size() - length, format, arguments);
  va_end(arguments);
  if (wanted > 0) length = std::min(length + static_cast<std::size_t>(wanted), text.size() - 1);
}

void write_status(StatusText& out, const StatusBoard& board, std::size_t lanes, std::uint64_t heap_calls) noexcept {
  const ModuleView view = board.module();
  add_text(out, "", name_of(view.state));
  if (view.state == ModuleState::kArming) {
    add_joints(out, ", no answer yet from", view.unheard);
  } else {
    add_text(out, ", ", name_of(view.phase));
    if (view.state == ModuleState::kSafeStop) add_text(out, ": ", text_of(view.reason));
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
  const char* before = "; faults ";
  for (std::size_t i = 0; i < kFaultTable.size(); ++i) {
    if (board.fault(i) == 0) continue;
    add_text(out, before, kFaultTable[i].name);
    out.add(" %u", board.fault(i));
    before = ", ";
  }
}

}  // namespace polygmap::daemon
