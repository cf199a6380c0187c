// SPDX-License-Identifier: Apache-2.0
// Counts the instructions of a schedule's rows, cycles and jobs on the way from the executive to its tasks.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "algorithms/core/work.hpp"
#include "hal/linux/instruction_counter.hpp"

namespace polygmap::hal {

struct InstructionStatistics {
  std::uint64_t count = 0;
  std::uint64_t sum = 0;
  std::uint64_t max = 0;

  constexpr void add(std::uint64_t instructions) noexcept {
    ++count;
    sum += instructions;
    max = std::max(max, instructions);
  }
  [[nodiscard]] constexpr std::uint64_t mean() const noexcept { return count == 0 ? 0 : sum / count; }
};

// Stands in for the tasks of one lane's executive; one counter is read before each row and after the last, so a row's
// count has the executive's own few instructions of that row in it. On the lane's thread only.
// A job is what a row does from its first busy call to its kDone. Rows that hand a picture on in table order (surfaces,
// map, footholds) are a chain: a picture's count is that of its jobs in all of them.
// Counter: read() and read_cost(), as InstructionCounter has them.
template <typename Tasks, std::size_t Rows, typename Counter = InstructionCounter>
class RowMeter {
 public:
  // Bit r of a mask: row r.
  RowMeter(Tasks& tasks, std::uint32_t control_rows, std::uint32_t chain_rows) noexcept
      : tasks_(tasks), control_rows_(control_rows), chain_rows_(chain_rows) {}

  // The counter of this thread, started; before that rows are run and not counted.
  void count_with(const Counter& counter) noexcept { counter_ = &counter; }

  // Before the tick, so that the cycle's count has the way to its first row in it.
  void begin_cycle() noexcept {
    if (counter_ == nullptr) return;
    begin_ = last_ = counter_->read();
    reads_ = 0;
    control_ = 0;
    row_ = Rows;
  }

  Progress run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) noexcept {
    close_row();
    const std::int32_t given = budget.left();
    const Progress progress = tasks_.run_row(row, cycle_ns, budget);
    row_ = row;
    progress_ = progress;
    units_[row] += static_cast<std::uint64_t>(std::max(given - budget.left(), 0));
    return progress;
  }
  // After the last row of a cycle: the executive calls it.
  template <typename Report>
  void cycle_done(std::size_t lane, const Report& report) noexcept {
    tasks_.cycle_done(lane, report);
    if (counter_ == nullptr) return;
    close_row();
    const InstructionCount spent = last_ - begin_;
    user_.add(less(spent.user, reads_ * counter_->read_cost().user));
    kernel_.add(less(spent.kernel, reads_ * counter_->read_cost().kernel));
    control_statistics_.add(control_);
    begin_cycle();  // of one that is caught up in the same tick
  }

  // User instructions, less what counting them takes.
  [[nodiscard]] const InstructionStatistics& row(std::size_t r) const noexcept { return rows_[r]; }  // calls with work
  [[nodiscard]] const InstructionStatistics& job(std::size_t r) const noexcept { return jobs_[r]; }
  [[nodiscard]] std::uint64_t units(std::size_t r) const noexcept { return units_[r]; }
  [[nodiscard]] const InstructionStatistics& picture() const noexcept { return pictures_; }
  [[nodiscard]] const InstructionStatistics& control() const noexcept { return control_statistics_; }
  [[nodiscard]] const InstructionStatistics& cycle() const noexcept { return user_; }
  [[nodiscard]] const InstructionStatistics& kernel() const noexcept { return kernel_; }

 private:
  static constexpr std::uint64_t less(std::uint64_t counted, std::uint64_t cost) noexcept {
    return counted > cost ? counted - cost : 0;
  }

  // What was executed since the last read belongs to the row that ran last.
  void close_row() noexcept {
    if (counter_ == nullptr) return;
    const InstructionCount now = counter_->read();
    const std::uint64_t spent = less((now - last_).user, counter_->read_cost().user);
    last_ = now;
    ++reads_;
    if (row_ == Rows) return;
    if (((control_rows_ >> row_) & 1U) != 0) control_ += spent;
    if (progress_ != Progress::kIdle) {
      rows_[row_].add(spent);
      if (((chain_rows_ >> row_) & 1U) != 0) add_to_job(spent);
    }
    row_ = Rows;
  }

  void add_to_job(std::uint64_t spent) noexcept {
    if (open_job_[row_] == 0) before_[row_] = handed_on_[row_];
    open_job_[row_] += spent;
    if (progress_ != Progress::kDone) return;
    const std::uint64_t picture = before_[row_] + open_job_[row_];
    jobs_[row_].add(open_job_[row_]);
    open_job_[row_] = 0;
    std::size_t next = row_ + 1;
    while (next < Rows && ((chain_rows_ >> next) & 1U) == 0) ++next;
    if (next < Rows) {
      handed_on_[next] = picture;
    } else {
      pictures_.add(picture);
    }
  }

  Tasks& tasks_;
  std::uint32_t control_rows_, chain_rows_;
  const Counter* counter_ = nullptr;
  InstructionCount begin_, last_;
  std::uint64_t reads_ = 0;  // since begin_; each costs from one to the next
  std::uint64_t control_ = 0;
  std::size_t row_ = Rows;  // the one that ran last; Rows: none
  Progress progress_ = Progress::kIdle;
  std::array<InstructionStatistics, Rows> rows_{}, jobs_{};
  std::array<std::uint64_t, Rows> units_{}, open_job_{}, before_{}, handed_on_{};
  InstructionStatistics pictures_, control_statistics_, user_, kernel_;
};

}  // namespace polygmap::hal
