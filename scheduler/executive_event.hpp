// SPDX-License-Identifier: Apache-2.0
// What an executive counts of a lane.
#pragma once

#include "scheduler/event_counters.hpp"

namespace polygmap {

enum class ExecutiveEvent : std::uint8_t {
  kCycleOverrun = 1,
  kRowOverrun = 2,
  kCycleSlip = 3,
  kClockRate = 4,
  kRowShed = 5,
  kRowDeferred = 6,
  kCycleCaughtUp = 7,
};

template <>
inline constexpr std::array kEventTable<ExecutiveEvent> = std::to_array<EventInfo<ExecutiveEvent>>({
    {ExecutiveEvent::kCycleOverrun, "cycle_overrun", "A lane's cycle took longer than kCycle_us."},
    {ExecutiveEvent::kRowOverrun, "row_overrun", "A row took longer than its budget."},
    {ExecutiveEvent::kCycleSlip, "cycle_slip", "A tick came so late that cycles were skipped."},
    {ExecutiveEvent::kClockRate, "clock_rate", "The clock's counter has a rate that CounterScale cannot convert."},
    {ExecutiveEvent::kRowShed, "row_shed", "A slot was given up for lack of time."},
    {ExecutiveEvent::kRowDeferred, "row_deferred", "A slot paid back an overdraft of work units."},
    {ExecutiveEvent::kCycleCaughtUp, "cycle_caught_up", "A cycle was run late."},
});
static_assert(bad_event_lines<ExecutiveEvent>(1, 99) == 0);

}  // namespace polygmap
