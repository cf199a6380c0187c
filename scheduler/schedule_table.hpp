// SPDX-License-Identifier: Apache-2.0
// One constexpr table says which task runs in which slot, on which lane, for how long, and what goes first when time is
// short. The build fails when the table cannot hold (the checks below, asserted by the executive).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "algorithms/core/work.hpp"

namespace polygmap {

inline constexpr std::int32_t kCycle_us = 2000;
inline constexpr std::int64_t kCycle_ns = std::int64_t{kCycle_us} * 1000;
inline constexpr std::size_t kCyclesPerMajor = 16;
inline constexpr std::size_t kMaxLanes = 4;
inline constexpr std::size_t kMaxScheduleRows = 32;  // rows fit the 32-bit masks of a CycleReport

using SlotMask = std::uint16_t;  // bit s: the row runs in cycle s of the major cycle
inline constexpr SlotMask kEverySlot = 0xFFFF;
static_assert(sizeof(SlotMask) * 8 == kCyclesPerMajor);

// Slots first, first + stride, ... of the major cycle.
[[nodiscard]] constexpr SlotMask slots_from(std::size_t first, std::size_t stride) noexcept {
  std::uint32_t mask = 0;
  for (std::size_t s = first; s < kCyclesPerMajor && stride > 0; s += stride) mask |= 1U << s;
  return static_cast<SlotMask>(mask);
}

struct ScheduleRow {
  std::string_view task;  // static string, unique
  std::uint8_t lane = 0;  // a lane is a core; lanes count from 0 without a gap
  SlotMask slots = kEverySlot;
  std::int32_t budget_us = 0;     // per slot, on the robot
  std::int32_t unit_cost_ns = 0;  // of one work unit, as measured; 0: the row is not resumable
  std::uint8_t shed_order = 0;    // 1 is shed first, then 2, ...; 0 is never shed (control, gait, health)
  bool newest_only = false;       // not run in a cycle that is caught up: it acts on the world, once a tick
  bool takes_leftover = false;    // spends also what the lane's resumable row before it left of this cycle
  std::int32_t instructions =
      0;  // of the processor per slot, at most, as measured; a resumable row's follow from units

  [[nodiscard]] constexpr bool resumable() const noexcept { return unit_cost_ns > 0; }
  [[nodiscard]] constexpr bool runs_in(std::size_t slot) const noexcept { return ((slots >> slot) & 1U) != 0; }
  // Work units that one slot pays for; 0 when the row is not resumable.
  [[nodiscard]] constexpr std::int32_t units_per_slot() const noexcept {
    return resumable() ? static_cast<std::int32_t>(std::int64_t{budget_us} * 1000 / unit_cost_ns) : 0;
  }
};

// Of the robot's processor, that a slot of the row is meant for.
[[nodiscard]] constexpr std::int64_t instructions_per_slot(const ScheduleRow& row) noexcept {
  return row.resumable() ? std::int64_t{row.units_per_slot()} * kInstructionsPerUnit : row.instructions;
}

// Rows of a slot run in table order.
template <std::size_t RowCount>
using ScheduleTable = std::array<ScheduleRow, RowCount>;

// The same rows, all on lane 0: simulation, CI and replay.
template <std::size_t RowCount>
[[nodiscard]] constexpr ScheduleTable<RowCount> in_one_lane(ScheduleTable<RowCount> table) noexcept {
  for (ScheduleRow& row : table) row.lane = 0;
  return table;
}

template <std::size_t RowCount>
[[nodiscard]] constexpr std::size_t lane_count(const ScheduleTable<RowCount>& table) noexcept {
  std::size_t count = 0;
  for (const ScheduleRow& row : table) count = std::max(count, std::size_t{row.lane} + 1);
  return count;
}

// Of the row with that name; RowCount when there is none.
template <std::size_t RowCount>
[[nodiscard]] constexpr std::size_t row_named(const ScheduleTable<RowCount>& table, std::string_view task) noexcept {
  std::size_t i = 0;
  while (i < RowCount && table[i].task != task) ++i;
  return i;
}

// Sum of the budgets of a lane's rows in one slot.
template <std::size_t RowCount>
[[nodiscard]] constexpr std::int64_t slot_load_us(const ScheduleTable<RowCount>& table, std::size_t lane,
                                                  std::size_t slot) noexcept {
  std::int64_t load_us = 0;
  for (const ScheduleRow& row : table) {
    if (row.lane == lane && row.runs_in(slot)) load_us += row.budget_us;
  }
  return load_us;
}

// Of the fullest slot of the fullest lane: what is left over by one row is spent by another, and adds nothing.
template <std::size_t RowCount>
[[nodiscard]] constexpr std::int64_t worst_cycle_instructions(const ScheduleTable<RowCount>& table) noexcept {
  std::int64_t worst = 0;
  for (std::size_t lane = 0; lane < lane_count(table); ++lane) {
    for (std::size_t slot = 0; slot < kCyclesPerMajor; ++slot) {
      std::int64_t load = 0;
      for (const ScheduleRow& row : table) {
        if (row.lane == lane && row.runs_in(slot)) load += instructions_per_slot(row);
      }
      worst = std::max(worst, load);
    }
  }
  return worst;
}

// The fullest slot of the fullest lane.
template <std::size_t RowCount>
[[nodiscard]] constexpr std::int64_t worst_cycle_us(const ScheduleTable<RowCount>& table) noexcept {
  std::int64_t worst_us = 0;
  for (std::size_t lane = 0; lane < lane_count(table); ++lane) {
    for (std::size_t slot = 0; slot < kCyclesPerMajor; ++slot) {
      worst_us = std::max(worst_us, slot_load_us(table, lane, slot));
    }
  }
  return worst_us;
}

// Checks for static_assert: each returns the number of rows that break its rule.

template <std::size_t RowCount>
[[nodiscard]] constexpr std::size_t rows_without_unique_name(const ScheduleTable<RowCount>& table) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < RowCount; ++i) {
    bool good = !table[i].task.empty();
    for (std::size_t j = 0; j < i; ++j) good = good && table[j].task != table[i].task;
    count += good ? 0 : 1;
  }
  return count;
}

template <std::size_t RowCount>
[[nodiscard]] constexpr std::size_t rows_without_slot(const ScheduleTable<RowCount>& table) noexcept {
  std::size_t count = 0;
  for (const ScheduleRow& row : table) count += row.slots == 0 ? 1 : 0;
  return count;
}

template <std::size_t RowCount>
[[nodiscard]] constexpr std::size_t rows_without_budget(const ScheduleTable<RowCount>& table) noexcept {
  std::size_t count = 0;
  for (const ScheduleRow& row : table) count += row.budget_us <= 0 ? 1 : 0;
  return count;
}

// A resumable row must be paid at least one unit per slot, or it would never finish.
template <std::size_t RowCount>
[[nodiscard]] constexpr std::size_t rows_without_unit(const ScheduleTable<RowCount>& table) noexcept {
  std::size_t count = 0;
  for (const ScheduleRow& row : table) {
    count += row.unit_cost_ns < 0 || (row.resumable() && row.units_per_slot() < 1) ? 1 : 0;
  }
  return count;
}

// Only resumable work may be shed: it goes on where it stopped. A control law that misses a tick does not.
template <std::size_t RowCount>
[[nodiscard]] constexpr std::size_t rows_shed_but_not_resumable(const ScheduleTable<RowCount>& table) noexcept {
  std::size_t count = 0;
  for (const ScheduleRow& row : table) count += row.shed_order > 0 && !row.resumable() ? 1 : 0;
  return count;
}

// Work that is handed out slot by slot is done in every slot.
template <std::size_t RowCount>
[[nodiscard]] constexpr std::size_t rows_newest_only_but_resumable(const ScheduleTable<RowCount>& table) noexcept {
  std::size_t count = 0;
  for (const ScheduleRow& row : table) count += row.newest_only && row.resumable() ? 1 : 0;
  return count;
}

// Lane 0 first, then 1, ...: then the order inside one lane is also the order of the same table run in one lane.
template <std::size_t RowCount>
[[nodiscard]] constexpr std::size_t rows_out_of_lane_order(const ScheduleTable<RowCount>& table) noexcept {
  std::size_t count = 0;
  std::size_t lane = 0;
  for (const ScheduleRow& row : table) {
    count += row.lane < lane || row.lane > lane + 1 || row.lane >= kMaxLanes || (&row == table.data() && row.lane != 0)
                 ? 1
                 : 0;
    lane = row.lane;
  }
  return count;
}

}  // namespace polygmap
