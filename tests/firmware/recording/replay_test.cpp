// SPDX-License-Identifier: Apache-2.0
// The module writes down what it lives through, and lives it once more.
#include "firmware/recording/replay.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <barrier>
#include <functional>
#include <string>
#include <thread>

#include "tests/firmware/recording/recorded_run.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap::recording {
namespace {

TEST(Replay, ModuleThatWalks_NothingDiffers) {
  constexpr int kTicks = test::kSlowMachine ? 900 : 2500;  // the first picture is looked at after some 700
  const RecordingFolder folder("walk");
  Params params;
  params.gait.planner.pattern = GaitPattern::kSingleStep;  // a replay has the recording's parameters
  params.tread_height_sigma_m = 0.0041;
  RecordedRun run(folder.file(), params);
  run.run(kTicks);
  run.finish();
  EXPECT_GT(run.module->perception().extractor().counters().frames, 0U);
  if (!test::kSlowMachine) {
    EXPECT_NE(run.module->control().gait_status().phase, GaitPhase::kStandstill);
  }
  expect_same(folder.file(), kTicks);
}

TEST(Replay, SilentSensorsRefusedWritesLateTicksShedRowsAndAStop_NothingDiffers) {
  const RecordingFolder folder("trouble");
  RecordedRun run(folder.file());
  std::uint64_t cycles = 0;
  const auto live = [&](int ticks) {
    run.run(ticks);
    cycles += static_cast<std::uint64_t>(ticks);
  };
  live(750);
  run.robot.imu_speaks = false;
  live(3);
  run.robot.imu_speaks = true;
  run.robot.joints_speak = false;
  live(2);
  run.robot.joints_speak = true;
  run.robot.joints.writes.fail_next(2);
  live(5);
  for (int i = 0; i < 2; ++i) run.robot.advance();  // two cycles late: caught up
  run.tick();
  run.flush();
  cycles += 2;
  for (int i = 0; i < 8; ++i) run.robot.advance();  // and more than can be caught up: skipped
  run.tick();
  run.flush();
  cycles += 3;
  live(20);
  run.recorder->request_stop();
  live(40);
  run.finish();
  const Health& health = run.module->health();
  for (const Fault fault :
       {Fault::kImuMissing, Fault::kJointFeedbackMissing, Fault::kJointCommandRefused, Fault::kCycleSlip}) {
    EXPECT_GT(health.count(fault).count, 0U) << name_of(fault);
  }
  for (const Limit limit : {Limit::kCycleCaughtUp, Limit::kRowShed})
    EXPECT_GT(health.count(limit).count, 0U) << name_of(limit);
  expect_same(folder.file(), cycles);
}

TEST(Replay, WithoutPictures_PerceptionIsBelieved) {
  constexpr int kTicks = test::kSlowMachine ? 900 : 1500;
  const RecordingFolder folder("without_pictures");
  RecordedRun run(folder.file(), {}, RecordedModule::Pictures::kNone);
  run.run(kTicks);
  run.finish();
  EXPECT_EQ(run.robot.camera.kept(), 0);
  const ReplayResult result = replay(folder.file());
  EXPECT_EQ(result.verdict, ReplayVerdict::kSame) << text_of(result);
  EXPECT_TRUE(result.without_perception);
  EXPECT_EQ(text_of(result),
            "There are no pictures in it: what perception had found was believed, and all else replayed.\n"
            "replay: " +
                std::to_string(kTicks) + " ticks, 0 differ\n");
}

// Two threads; now and then perception has not finished when control begins the next frame. `between` writes, or lets
// somebody write who is on a thread of his own.
template <class Between>
void run_in_two_lanes(RecordedModule& run, int frames, Between&& between) {
  LanePair<RecordedTasks<Pipeline>> lanes(run, run.tasks);
  std::barrier wake(2), asleep(2);
  std::thread other([&] {
    for (int i = 0; i < frames; ++i) {
      wake.arrive_and_wait();
      if (i % 50 < 48) lanes.perception.tick(run.robot.clock.now_ns());  // the 49th and 50th are run with the next
      asleep.arrive_and_wait();
    }
  });
  for (int i = 0; i < frames; ++i) {
    run.robot.advance();
    wake.arrive_and_wait();
    lanes.control.tick(run.robot.clock.now_ns());
    asleep.arrive_and_wait();
    between();
  }
  other.join();
}

TEST(Replay, TwoLanesOneOfThemBehind_NothingDiffers) {
  constexpr int kFrames = 1000;
  const RecordingFolder folder("lanes");
  RecordedModule run(folder.file());
  run_in_two_lanes(run, kFrames, [&run] { run.flush(); });
  EXPECT_EQ(run.recorder->finish(), "");
  // Once per gap control finds perception two cycles behind; whether also in the cycle after depends on the threads.
  EXPECT_GE(run.module->health().count(Fault::kLaneBehind).count, 20U);
  EXPECT_GT(run.module->perception().extractor().counters().frames, 0U);
  expect_same(folder.file(), kFrames);
}

// As the daemon has it: the lanes run on while another thread writes, pictures from where the driver has them.
TEST(Replay, LanesWrittenOutWhileTheyRun_NothingDiffers) {
  constexpr int kFrames = 1000;
  const RecordingFolder folder("running");
  RecordedModule run(folder.file());
  std::atomic<bool> ends{false};
  std::atomic<std::uint64_t> writes{0};
  std::thread writer([&] {
    for (; !ends; ++writes, std::this_thread::yield()) run.write_out();
  });
  // It is to keep up, wherever threads are few.
  run_in_two_lanes(run, kFrames, [&writes] {
    for (const std::uint64_t before = writes; writes < before + 2;) std::this_thread::yield();
  });
  ends = true;
  writer.join();
  EXPECT_EQ(run.recorder->finish(), "");
  EXPECT_GT(run.module->perception().extractor().counters().frames, 0U);
  EXPECT_GT(run.robot.camera.kept(), 10);
  EXPECT_EQ(run.robot.camera.still_kept(), 0);
  expect_same(folder.file(), kFrames);
}

std::size_t row_of(std::string_view task) {
  const auto place = std::ranges::find_if(kTasks, [task](const Task& t) { return t.row.task == task; });
  return static_cast<std::size_t>(place - kTasks.begin());
}

// Rows on their way to a lane that is held up before some of them, while the other lane runs on.
struct HeldTasks {
  RecordedTasks<Pipeline>& tasks;
  std::size_t held_row;
  std::function<void()> meanwhile = [] {};

  Progress run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) noexcept {
    if (row == held_row) meanwhile();
    return tasks.run_row(row, cycle_ns, budget);
  }
  void cycle_done(std::size_t lane, const CycleReport& report) noexcept { tasks.cycle_done(lane, report); }
};

// One lane is held up before `row` for longer than the exchanges have slots for, again and again.
void expect_same_though_held_before(std::size_t row, const std::string& name) {
  constexpr int kFrames = 300, kHeldFrames = 8;
  const RecordingFolder folder(name);
  RecordedModule run(folder.file());
  HeldTasks tasks{run.tasks, row};
  LanePair<HeldTasks> lanes(run, tasks);
  const bool control_is_held = kTasks[row].row.lane == kControlLane;
  const auto run_other = [&] {
    if (control_is_held) {
      lanes.perception.tick(run.robot.clock.now_ns());
    } else {
      lanes.control.tick(run.robot.clock.now_ns());
    }
    run.write_out();
  };
  int frames = 0, held = 0;
  tasks.meanwhile = [&] {
    if (frames % 50 != 0) return;
    ++held;
    for (int i = 0; i < kHeldFrames; ++i, ++frames) {
      run.robot.advance();
      run_other();
    }
  };
  for (; frames < kFrames; ++frames) {
    run.robot.advance();
    const std::int64_t now_ns = run.robot.clock.now_ns();
    run_other();
    if (control_is_held) {
      lanes.control.tick(now_ns);
    } else {
      lanes.perception.tick(now_ns);
    }
    run.write_out();
  }
  EXPECT_EQ(run.recorder->finish(), "");
  EXPECT_GT(held, 3);
  const ReplayResult result = replay(folder.file());
  EXPECT_EQ(result.verdict, ReplayVerdict::kSame) << text_of(result);
  EXPECT_GT(result.ticks, static_cast<std::uint64_t>(kFrames - held * (kHeldFrames + 1)));
  const bool looks_across = row == row_of("sense") || row == row_of("intake");
  EXPECT_EQ(run.module->health().count(Limit::kHandOverLost).count > 0, looks_across) << name;
}

// What the lane saw when its frame began is overwritten by the time that the frame is handed over.
TEST(Replay, LaneHeldUpWithinAFrame_NothingDiffers) {
  expect_same_though_held_before(row_of("surfaces"), "held_surfaces");
  expect_same_though_held_before(row_of("gait"), "held_gait");
}

// What the lane should have seen is overwritten before it looks.
TEST(Replay, LaneHeldUpBeforeItLooks_TheLossIsRepeated) {
  expect_same_though_held_before(row_of("sense"), "held_sense");
  expect_same_though_held_before(row_of("intake"), "held_intake");
}

}  // namespace
}  // namespace polygmap::recording
