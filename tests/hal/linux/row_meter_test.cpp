// SPDX-License-Identifier: Apache-2.0
#include "hal/linux/row_meter.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace polygmap::hal {
namespace {

constexpr std::uint64_t kReadUser = 3, kReadKernel = 500;

// Executes what it is told to, and counts its own reads as a real counter does.
struct FakeCounter {
  mutable InstructionCount count;
  [[nodiscard]] InstructionCount read() const noexcept {
    count.user += kReadUser;
    count.kernel += kReadKernel;
    return count;
  }
  [[nodiscard]] InstructionCount read_cost() const noexcept { return {kReadUser, kReadKernel}; }
};

struct FakeTasks {
  FakeCounter& counter;
  std::uint64_t user = 0, kernel = 0;  // of the next row
  std::int32_t units = 0;
  Progress progress = Progress::kDone;
  Progress run_row(std::size_t, std::int64_t, WorkBudget& budget) noexcept {
    counter.count.user += user;
    counter.count.kernel += kernel;
    budget.spend(units);
    return progress;
  }
  int cycles_done = 0;
  void cycle_done(std::size_t, int) noexcept { ++cycles_done; }
};

enum Row : std::size_t { kControl, kSurfaces, kMap, kRows };

class RowMeterTest : public testing::Test {
 protected:
  void run(Row row, std::uint64_t user, Progress progress = Progress::kDone, std::uint64_t kernel = 0) {
    tasks_.user = user;
    tasks_.kernel = kernel;
    tasks_.progress = progress;
    WorkBudget budget(10);
    EXPECT_EQ(meter_.run_row(row, 0, budget), progress);
  }
  void end_cycle() { meter_.cycle_done(0, 0); }

  FakeCounter counter_;
  FakeTasks tasks_{counter_};
  RowMeter<FakeTasks, kRows, FakeCounter> meter_{tasks_, 1U << kControl, 1U << kSurfaces | 1U << kMap};
};

TEST_F(RowMeterTest, CycleDone_CountedOrNot_IsHandedOn) {
  end_cycle();
  meter_.count_with(counter_);
  end_cycle();
  EXPECT_EQ(tasks_.cycles_done, 2);
}

TEST_F(RowMeterTest, Cycle_ThreeRows_EachIsCountedWithoutTheReads) {
  meter_.count_with(counter_);
  meter_.begin_cycle();
  tasks_.units = 4;
  run(kControl, 1000, Progress::kDone, 70);
  run(kSurfaces, 20'000, Progress::kBusy, 0);
  run(kMap, 300, Progress::kIdle, 5);
  end_cycle();
  EXPECT_EQ(meter_.row(kControl).max, 1000U);
  EXPECT_EQ(meter_.row(kSurfaces).max, 20'000U);
  EXPECT_EQ(meter_.row(kMap).count, 0U);  // it had nothing to do
  EXPECT_EQ(meter_.control().max, 1000U);
  EXPECT_EQ(meter_.cycle().max, 21'300U);
  EXPECT_EQ(meter_.kernel().max, 75U);
  EXPECT_EQ(meter_.units(kSurfaces), 4U);
}

TEST_F(RowMeterTest, Cycle_OneAfterTheOtherInATick_AreCountedApart) {
  meter_.count_with(counter_);
  meter_.begin_cycle();
  run(kControl, 1000);
  end_cycle();
  run(kControl, 3000);
  end_cycle();
  EXPECT_EQ(meter_.cycle().count, 2U);
  EXPECT_EQ(meter_.cycle().max, 3000U);
  EXPECT_EQ(meter_.cycle().mean(), 2000U);
}

TEST_F(RowMeterTest, Picture_NextOneIsExtractedWhileTheMapWorks_EachHasItsOwnParts) {
  meter_.count_with(counter_);
  const auto cycle = [&](std::uint64_t surfaces, Progress extracted, std::uint64_t map, Progress fused) {
    meter_.begin_cycle();
    run(kSurfaces, surfaces, extracted);
    run(kMap, map, fused);
    end_cycle();
  };
  cycle(100, Progress::kBusy, 0, Progress::kIdle);
  cycle(200, Progress::kDone, 10, Progress::kBusy);   // the first picture's surfaces: 300
  cycle(5000, Progress::kDone, 20, Progress::kBusy);  // the second's, before the first's map is done
  cycle(0, Progress::kIdle, 30, Progress::kDone);
  EXPECT_EQ(meter_.picture().count, 1U);
  EXPECT_EQ(meter_.picture().max, 360U);
  cycle(0, Progress::kIdle, 40, Progress::kDone);
  EXPECT_EQ(meter_.picture().count, 2U);
  EXPECT_EQ(meter_.picture().max, 5040U);
  EXPECT_EQ(meter_.job(kSurfaces).max, 5000U);
  EXPECT_EQ(meter_.job(kMap).sum, 100U);
}

TEST_F(RowMeterTest, Cycle_NoCounter_RunsTheRowsAndCountsNothing) {
  meter_.begin_cycle();
  run(kControl, 1000);
  end_cycle();
  EXPECT_EQ(meter_.cycle().count, 0U);
  EXPECT_EQ(meter_.row(kControl).count, 0U);
}

TEST(InstructionCounterTest, Read_MoreWork_CountsMore) {
  InstructionCounter counter;
  EXPECT_EQ(counter.read().user, 0U);  // not started
  if (const int error = counter.start(); error != 0)
    GTEST_SKIP() << "this machine counts no instructions: errno " << error;
  const auto spent = [&](int rounds) {
    const InstructionCount before = counter.read();
    for (int i = 0; i < rounds; ++i) {
      asm volatile("");  // or there is no loop
    }
    return (counter.read() - before).user;
  };
  const std::uint64_t few = spent(1000), many = spent(100'000);
  EXPECT_GT(few, 2000U);
  EXPECT_GT(many, 50 * few);
  EXPECT_LT(counter.read_cost().user, 1000U);
}

}  // namespace
}  // namespace polygmap::hal
