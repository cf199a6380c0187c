// SPDX-License-Identifier: Apache-2.0
// Runs one lane of a schedule table, cycle by cycle. A template over the tasks, so the same code runs the
// module on the robot, in simulation and in tests.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>

#include "algorithms/core/work.hpp"
#include "hal/ports/clock.hpp"
#include "scheduler/cycle_monitor.hpp"
#include "scheduler/executive_event.hpp"
#include "scheduler/schedule_table.hpp"

namespace polygmap {

// What a tick did in one cycle: the recorder's entry. Masks have bit r for table row r.
struct CycleReport {
  std::uint64_t cycle = 0;  // cycles since start, skipped ones included
  std::int64_t due_ns = 0;
  std::size_t slot = 0;
  std::uint32_t ran = 0;             // rows called, idle ones included
  std::uint32_t shed = 0;            // rows given up for lack of time
  std::uint32_t deferred = 0;        // rows that paid back an overdraft
  std::uint32_t overran = 0;         // rows longer than their budget
  bool overrun = false;              // the cycle was longer than kCycle_us
  bool caught_up = false;            // the following one was due before it began
  std::uint64_t skipped_before = 0;  // cycles that slipped right before this one
  std::uint64_t time_ns = 0;
};

// run_row(row, cycle_ns, budget) does one slot's worth of table row `row`.
//   cycle_ns  the cycle's due time: the same for all rows of the cycle and free of the tick's jitter
//   budget    units to spend if the row is resumable, 0 units otherwise
//   returns   kIdle: had nothing to do; kBusy: goes on in the row's next slot; kDone: did it or finished it
// Lanes call it from their own threads, each for its own rows only.
template <typename T>
concept RunsRows = requires(T& tasks, std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) {
  { tasks.run_row(row, cycle_ns, budget) }
  noexcept->std::same_as<Progress>;
};

// Told of every cycle after its last row, on the lane's own thread. Who stands before the tasks hands it on: where it
// stops, nothing crosses from lane to lane.
template <typename T>
concept WatchesCycles = requires(T& tasks, std::size_t lane, const CycleReport& report) {
  { tasks.cycle_done(lane, report) }
  noexcept;
};

// Where an executive counts what happened to its lane; written on the lane's own thread.
template <typename T>
concept CountsExecutiveEvents = requires(T& counters, ExecutiveEvent event, std::int64_t now_ns, std::uint32_t times) {
  { counters.raise(event, now_ns, times) }
  noexcept;
};

// Late ticks: cycles whose successor is already due are caught up, at most kMaxCaughtUp of them per tick; older ones
// are skipped (slips), so the slot number stays tied to time. Rows that act on the world (newest_only) run in the
// newest cycle of a tick alone: a bus gets one command a tick, however late it comes. Shedding: (1) a sheddable row
// whose budget, with those of the rows that matter more, does not fit what is left of the cycle is given up; (2) after
// a cycle that overran or came late the rows of one more shed order are left out, and one less again after
// kRecoveryCycles cycles in time. Rows with shed order 0 always run. Overdrafts: a resumable row that spent more units
// than it was given is given less in its next slots until it is paid. Leftovers: a row that takes_leftover may spend
// what the resumable row before it did not, in the same cycle.
template <typename Tasks, const auto& Table, std::size_t Lane = 0, typename Counters = EventCounters<ExecutiveEvent>>
class CyclicExecutive {
  static constexpr std::size_t kRows = Table.size();
  static_assert(RunsRows<Tasks>, "Tasks needs: Progress run_row(std::size_t, std::int64_t, WorkBudget&) noexcept");
  static_assert(WatchesCycles<Tasks>, "Tasks needs: void cycle_done(std::size_t, const CycleReport&) noexcept");
  static_assert(CountsExecutiveEvents<Counters>, "Counters needs: raise(ExecutiveEvent, now_ns, times) noexcept");
  static_assert(kRows > 0 && kRows <= kMaxScheduleRows, "a schedule has 1 to kMaxScheduleRows rows");
  static_assert(Lane < lane_count(Table), "the schedule has no row in this lane");
  static_assert(worst_cycle_us(Table) <= kCycle_us, "the rows of a lane do not fit one cycle");
  static_assert(rows_without_unique_name(Table) == 0, "every schedule row needs a name of its own");
  static_assert(rows_without_slot(Table) == 0, "a schedule row runs in no slot");
  static_assert(rows_without_budget(Table) == 0, "a schedule row has no budget");
  static_assert(rows_without_unit(Table) == 0, "a resumable row is not paid a single unit per slot");
  static_assert(rows_shed_but_not_resumable(Table) == 0, "only a resumable row may have a shed order");
  static_assert(rows_newest_only_but_resumable(Table) == 0, "a resumable row runs in every cycle");
  static_assert(rows_out_of_lane_order(Table) == 0, "schedule rows stand in the order of their lanes, from 0");

 public:
  static constexpr std::int64_t kMaxCaughtUp = 2;
  static constexpr std::uint32_t kRecoveryCycles = kCyclesPerMajor;
  static constexpr std::int64_t kDispatch_ns = 20'000;  // the executive's own time: a full cycle is not shed for it

  CyclicExecutive(Tasks& tasks, const hal::Clock& clock, Counters& counters) noexcept
      : tasks_(tasks), clock_(clock), counters_(counters), scale_(clock.counts_per_us()) {}

  // The first cycle, in slot 0, is due at first_due_ns. Lanes that share data start at the same time.
  void start(std::int64_t first_due_ns) noexcept {
    start_ns_ = first_due_ns;
    next_cycle_ = 0;
    started_ = true;
    if (!CounterScale::valid(clock_.counts_per_us())) counters_.raise(ExecutiveEvent::kClockRate, first_due_ns, 1);
  }

  // Runs what is due at now_ns, at most kMaxCaughtUp + 1 cycles; returns how many cycles ran.
  std::size_t tick(std::int64_t now_ns) noexcept {
    if (!started_ || now_ns < next_due_ns()) {
      count_up(lane_.early);
      return 0;
    }
    lane_.lateness.add(static_cast<std::uint64_t>(now_ns - next_due_ns()));
    const std::int64_t missed = (now_ns - next_due_ns()) / kCycle_ns;
    const std::int64_t caught_up = std::min(missed, kMaxCaughtUp);
    const auto skipped = static_cast<std::uint64_t>(missed - caught_up);
    if (skipped > 0) {
      lane_.slips += skipped;
      counters_.raise(ExecutiveEvent::kCycleSlip, now_ns, clamp_to_u32(skipped));
      next_cycle_ += skipped;
    }
    if (missed > 0) note_time_short();
    for (std::int64_t i = 0; i <= caught_up; ++i) {
      if (i < caught_up) {
        count_up(lane_.caught_up);
        counters_.raise(ExecutiveEvent::kCycleCaughtUp, now_ns, 1);
      }
      run_cycle(i == 0 ? skipped : 0, i == caught_up);
    }
    return static_cast<std::size_t>(caught_up) + 1;
  }

  // Gives up these rows in the next cycle as well, as far as they have a shed order: a replay repeats what was
  // recorded.
  void shed_in_next_cycle(std::uint32_t rows) noexcept { requested_shed_ |= rows; }

  [[nodiscard]] std::int64_t next_due_ns() const noexcept {
    return start_ns_ + static_cast<std::int64_t>(next_cycle_) * kCycle_ns;
  }
  // Rows with a shed order up to this one are left out for now; 0: none.
  [[nodiscard]] std::uint8_t shed_level() const noexcept { return shed_level_; }
  [[nodiscard]] const CycleReport& last_cycle() const noexcept { return report_; }
  [[nodiscard]] const LaneStatistics& lane_statistics() const noexcept { return lane_; }
  // Of the table's row; zero for the rows of other lanes.
  [[nodiscard]] const RowStatistics& row_statistics(std::size_t row) const noexcept { return rows_[row]; }

 private:
  static constexpr std::uint8_t kMaxShedOrder = [] {
    std::uint8_t order = 0;
    for (const ScheduleRow& row : Table) order = row.lane == Lane ? std::max(order, row.shed_order) : order;
    return order;
  }();

  static constexpr std::uint32_t clamp_to_u32(std::uint64_t x) noexcept {
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(x, UINT32_MAX));
  }

  void run_cycle(std::uint64_t skipped_before, bool newest) noexcept {
    report_ = {.cycle = next_cycle_,
               .due_ns = next_due_ns(),
               .slot = static_cast<std::size_t>(next_cycle_ % kCyclesPerMajor),
               .caught_up = !newest,
               .skipped_before = skipped_before};
    const std::uint64_t begin_count = clock_.count();
    leftover_ = 0;
    for (std::size_t row = 0; row < kRows; ++row) {
      if (Table[row].lane != Lane || !Table[row].runs_in(report_.slot)) continue;
      if (Table[row].newest_only && !newest) continue;
      const std::uint64_t elapsed_ns = scale_.to_ns(clock_.count() - begin_count);
      if (must_shed(row, elapsed_ns)) {
        pay_overdraft(row, Table[row].units_per_slot());
        count_up(rows_[row].shed);
        report_.shed |= 1U << row;
        counters_.raise(ExecutiveEvent::kRowShed, report_.due_ns, 1);
      } else {
        run_row(row);
      }
    }
    report_.time_ns = scale_.to_ns(clock_.count() - begin_count);
    finish_cycle();
  }

  void run_row(std::size_t row) noexcept {
    RowStatistics& statistics = rows_[row];
    const std::int32_t more = Table[row].takes_leftover ? leftover_ : 0;
    const std::int32_t units = Table[row].units_per_slot() + more, allowance = units - overdraft_[row];
    pay_overdraft(row, units);
    if (Table[row].resumable()) leftover_ = 0;
    if (Table[row].resumable() && allowance <= 0) {
      count_up(statistics.deferred);
      report_.deferred |= 1U << row;
      counters_.raise(ExecutiveEvent::kRowDeferred, report_.due_ns, 1);
      return;
    }
    WorkBudget budget(allowance);
    const std::uint64_t begin_count = clock_.count();
    const Progress progress = tasks_.run_row(row, report_.due_ns, budget);
    const std::uint64_t time_ns = scale_.to_ns(clock_.count() - begin_count);
    report_.ran |= 1U << row;
    const std::int64_t budget_ns =
        std::int64_t{Table[row].budget_us} * 1000 + std::int64_t{more} * Table[row].unit_cost_ns;
    if (progress == Progress::kIdle) {
      count_up(statistics.idle);
    } else {
      const std::int64_t slack_ns = budget_ns - static_cast<std::int64_t>(time_ns);
      count_up(statistics.runs);
      statistics.time.add(time_ns);
      statistics.slack_min_ns = std::min(statistics.slack_min_ns, slack_ns);
      statistics.slack_sum_ns += slack_ns;
    }
    if (Table[row].resumable()) {
      statistics.units += static_cast<std::uint64_t>(std::max(allowance - budget.left(), 0));
      leftover_ = std::max(budget.left(), 0);
      if (budget.left() < 0) {
        count_up(statistics.overdrawn);
        overdraft_[row] = -budget.left();
      }
    }
    if (time_ns > static_cast<std::uint64_t>(budget_ns)) {
      count_up(statistics.overruns);
      statistics.overrun_max_ns = std::max(statistics.overrun_max_ns, time_ns);
      report_.overran |= 1U << row;
      counters_.raise(ExecutiveEvent::kRowOverrun, report_.due_ns, 1);
    }
  }

  // Work that was done ahead of its time is paid by the slots that pass, used or not.
  void pay_overdraft(std::size_t row, std::int32_t units) noexcept {
    overdraft_[row] = std::max(overdraft_[row] - units, 0);
  }

  // What is left of the cycle must hold this row and the later rows that matter at least as much.
  [[nodiscard]] bool must_shed(std::size_t row, std::uint64_t elapsed_ns) const noexcept {
    const std::uint8_t order = Table[row].shed_order;
    if (order == 0) return false;
    if (order <= shed_level_ || ((requested_shed_ >> row) & 1U) != 0) return true;
    std::int64_t needed_us = Table[row].budget_us;
    for (std::size_t later = row + 1; later < kRows; ++later) {
      const ScheduleRow& other = Table[later];
      if (other.lane != Lane || !other.runs_in(report_.slot)) continue;
      if (other.shed_order == 0 || other.shed_order > order) needed_us += other.budget_us;
    }
    return static_cast<std::int64_t>(elapsed_ns) + needed_us * 1000 > kCycle_ns + kDispatch_ns;
  }

  void finish_cycle() noexcept {
    requested_shed_ = 0;
    count_up(lane_.cycles);
    lane_.slot_time[report_.slot].add(report_.time_ns);
    report_.overrun = report_.time_ns > static_cast<std::uint64_t>(kCycle_ns);
    if (report_.overrun) {
      count_up(lane_.overruns);
      counters_.raise(ExecutiveEvent::kCycleOverrun, report_.due_ns, 1);
      note_time_short();
    } else if (shed_level_ > 0 && ++cycles_in_time_ >= kRecoveryCycles) {
      --shed_level_;
      cycles_in_time_ = 0;
    }
    ++next_cycle_;
    tasks_.cycle_done(Lane, report_);
  }

  void note_time_short() noexcept {
    if (shed_level_ < kMaxShedOrder) ++shed_level_;
    cycles_in_time_ = 0;
  }

  Tasks& tasks_;
  const hal::Clock& clock_;
  Counters& counters_;
  CounterScale scale_;
  std::int64_t start_ns_ = 0;
  std::uint64_t next_cycle_ = 0;
  std::int32_t leftover_ = 0;  // units of this cycle
  std::uint32_t requested_shed_ = 0;
  std::uint32_t cycles_in_time_ = 0;
  std::uint8_t shed_level_ = 0;
  bool started_ = false;
  CycleReport report_;
  LaneStatistics lane_;
  std::array<RowStatistics, kRows> rows_{};
  std::array<std::int32_t, kRows> overdraft_{};
};

}  // namespace polygmap
