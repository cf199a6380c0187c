// SPDX-License-Identifier: Apache-2.0
// What is in the file when not everything can be: frames and pictures that found no room, a process that was killed, a
// disk that is not there.
#include "firmware/recording/recorder.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "firmware/recording/recording_file.hpp"
#include "tests/firmware/recording/mcap_bytes.hpp"
#include "tests/firmware/recording/recorded_run.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap::recording {
namespace {

constexpr int kQuarterSecond = 125, kSecond = 500;  // ticks

std::uint32_t times_lost(const Pipeline& module) { return module.health().count(Limit::kRecordingLost).count; }

// What the file says of the frames that are not in it, and how many cycles of control are in it behind the gap.
struct Gap {
  std::array<std::uint64_t, kLaneCount> lost{};
  std::uint64_t cycles_before = 0, cycles_after = 0;
};
Gap gap_in(const std::string& path) {
  Gap told;
  RecordingFile file;
  EXPECT_TRUE(file.open(path)) << file.complaint();
  const auto record = std::make_unique<Record>();
  while (file.read(*record) == RecordingFile::Found::kRecord) {
    if (record->kind == RecordKind::kLost) told.lost[record->lost_lane] += record->lost_frames;
    if (record->kind != RecordKind::kCycle || record->cycle_lane != kControlLane) continue;
    ++(told.lost[0] + told.lost[1] == 0 ? told.cycles_before : told.cycles_after);
  }
  return told;
}

// The recorder's memory is a quarter of a second; nobody writes for a second.
TEST(Recorder, QueueThatIsFull_FramesAreCountedAndLaterOnesRecorded) {
  const RecordingFolder folder("full");
  RecordedRun run(folder.file());
  run.run(100);
  for (int i = 0; i < kSecond; ++i) {
    run.robot.advance();
    run.tick();
  }
  EXPECT_GT(times_lost(*run.module), 0U);
  run.flush();
  const std::uint64_t lost = run.recorder->lost_frames(), pictures = run.recorder->lost_pictures();
  run.run(200);
  EXPECT_EQ(run.recorder->lost_frames(), lost) << "there is room again";
  EXPECT_EQ(times_lost(*run.module), lost + pictures);
  EXPECT_EQ(run.recorder->finish(), "The recording \"" + folder.file() + "\" lacks " + std::to_string(lost) +
                                        " frames and " + std::to_string(pictures) +
                                        " pictures: the disk was too slow for its memory.");
  EXPECT_FALSE(run.recorder->failed());
  EXPECT_EQ(run.robot.camera.still_kept(), 0);

  const Gap told = gap_in(folder.file());
  EXPECT_EQ(told.lost[kControlLane] + told.lost[kPerceptionLane], lost);
  EXPECT_GT(told.lost[kControlLane], 100U);
  EXPECT_GE(told.cycles_before, 100U + kQuarterSecond);
  EXPECT_GE(told.cycles_after, 200U);
  EXPECT_EQ(told.cycles_before + told.cycles_after + told.lost[kControlLane], 100U + kSecond + 200U);

  const ReplayResult result = replay(folder.file());
  EXPECT_EQ(result.verdict, ReplayVerdict::kUnfinished) << text_of(result);
  EXPECT_EQ(result.differ, 0U);
  EXPECT_GE(result.ticks, 100U + kQuarterSecond);
  EXPECT_TRUE(text_of(result).find("found no room in it.\nreplay: ") != std::string::npos) << text_of(result);
}

// A frame that saw a lost one cannot be lived again; it is no damage.
TEST(Recorder, QueueOfOneOfTwoLanesFull_ReplaysUpToThere) {
  const RecordingFolder folder("full_lanes");
  RecordedModule run(folder.file());
  run.robot.picture_ticks = 150;  // of a slow camera all pictures are kept, so that perception is not just believed
  LanePair<RecordedTasks<Pipeline>> lanes(run, run.tasks);
  constexpr int kBefore = test::kSlowMachine ? 300 : 900;  // perception has much to tell control by then
  for (int i = 0; i < kBefore + kSecond + 200; ++i) {
    run.robot.advance();
    lanes.control.tick(run.robot.clock.now_ns());
    lanes.perception.tick(run.robot.clock.now_ns());
    if (i < kBefore || i >= kBefore + kSecond) run.write_out();
  }
  EXPECT_GT(times_lost(*run.module), 0U);
  EXPECT_NE(run.recorder->finish(), "");
  const ReplayResult result = replay(folder.file());
  EXPECT_EQ(result.verdict, ReplayVerdict::kUnfinished) << text_of(result);
  EXPECT_EQ(result.differ, 0U);
  EXPECT_GE(result.ticks, static_cast<std::uint64_t>(kBefore + kQuarterSecond));
}

TEST(Recorder, PictureThatIsNotKept_IsCountedAndPerceptionBelievedFromThere) {
  const RecordingFolder folder("unkept");
  RecordedRun run(folder.file());
  run.run(300);
  EXPECT_EQ(times_lost(*run.module), 0U);
  run.robot.camera.keeps.fail_next(2);
  run.run(300);
  EXPECT_EQ(times_lost(*run.module), 2U);
  EXPECT_EQ(run.recorder->lost_pictures(), 2U);
  EXPECT_EQ(run.recorder->finish(), "The recording \"" + folder.file() +
                                        "\" lacks 0 frames and 2 pictures: the disk was too slow for its memory.");
  const ReplayResult result = replay(folder.file());
  EXPECT_EQ(result.verdict, ReplayVerdict::kSame) << text_of(result);
  EXPECT_TRUE(result.without_perception);
  EXPECT_EQ(result.ticks, 600U);
}

// Pictures of half a second, which nobody writes: the driver spares four.
TEST(Recorder, PicturesThatNobodyWrites_AreFourAndTheRestCounted) {
  const RecordingFolder folder("unwritten");
  RecordedRun run(folder.file());
  for (int i = 0; i < kQuarterSecond; ++i) {
    run.robot.advance();
    run.tick();
    ASSERT_LE(run.robot.camera.still_kept(), 4);
  }
  if (!test::kSlowMachine) {
    EXPECT_EQ(run.robot.camera.still_kept(), 4);
    EXPECT_GE(run.recorder->lost_pictures(), 1U);
  }
  EXPECT_EQ(run.recorder->lost_frames(), 0U);
  (void)run.recorder->finish();
  EXPECT_EQ(run.robot.camera.still_kept(), 0);
}

// A long run's next file is read on, if it is of that run.
TEST(Recorder, FileWhoseIndexIsFull_TheNextOneIsReplayedToo) {
  const RecordingFolder folder("parts");
  RecordedRun run(folder.file());
  run.run(100);
  // Messages so far apart are in a chunk each.
  std::int64_t t_ns = run.robot.clock.now_ns();
  const std::array<std::byte, 8> message{std::byte{0}, std::byte{1}};
  for (std::size_t i = 0; i < mcap::McapWriter::kMaxChunks; ++i) {
    t_ns += mcap::McapWriter::kChunk_ns;
    run.recorder->write(Topic::kTruth, t_ns, t_ns, message);
  }
  run.run(100);
  run.finish();
  const std::filesystem::path next = folder.path() / "run-1.mcap";
  ASSERT_TRUE(std::filesystem::exists(next));
  expect_same(folder.file(), 200);

  const Bytes bytes = read_file(next);
  const auto expect_cut = [&folder] {
    const ReplayResult result = replay(folder.file());
    EXPECT_EQ(result.verdict, ReplayVerdict::kUnfinished) << text_of(result);
    EXPECT_GE(result.ticks, 100U);
    EXPECT_EQ(result.differ, 0U);
  };
  std::filesystem::remove(next);
  expect_cut();
  {
    RecordedModule another((folder.path() / "run-1.mcap").string());  // of run 7, too, but no part of it
    another.recorder->begin(next.string(), {}, 8);
    EXPECT_EQ(another.recorder->finish(), "");
  }
  expect_cut();
  write_file(next, bytes);
  expect_same(folder.file(), 200);
}

// In a process of its own, at the robot's pace, until it is killed: what was handed over half a second before is there.
void expect_half_a_second_lost_at_most(RecordedModule::Pictures pictures) {
  const RecordingFolder folder("killed");
  void* const memory =
      ::mmap(nullptr, sizeof(std::atomic<int>), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  ASSERT_NE(memory, MAP_FAILED);
  auto* const ticks = new (memory) std::atomic<int>(0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    ::alarm(120);
    RecordedRun run(folder.file(), {}, pictures);
    for (auto next = std::chrono::steady_clock::now();; next += std::chrono::nanoseconds(kCycle_ns)) {
      std::this_thread::sleep_until(next);
      run.run(1);
      ++*ticks;
    }
  }
  while (*ticks < 1100 && ::waitpid(child, nullptr, WNOHANG) == 0)
    std::this_thread::sleep_for(std::chrono::milliseconds(7));
  ::kill(child, SIGKILL);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL);
  const int lived = *ticks;
  ::munmap(memory, sizeof(std::atomic<int>));

  const ReplayResult result = replay(folder.file());
  EXPECT_EQ(result.verdict, ReplayVerdict::kUnfinished) << text_of(result);
  EXPECT_EQ(result.differ, 0U);
  EXPECT_EQ(result.ends, "it was cut off");
  EXPECT_GE(result.ticks + kSecond / 2, static_cast<std::uint64_t>(lived)) << "more than half a second was lost";
  EXPECT_LE(result.ticks, static_cast<std::uint64_t>(lived) + 1);
}
TEST(Recorder, Killed_LosesHalfASecondAtMost) {
  expect_half_a_second_lost_at_most(RecordedModule::Pictures::kAll);
  expect_half_a_second_lost_at_most(RecordedModule::Pictures::kNone);
}

TEST(Recorder, FileThatCannotBeMade_SaysSoAndTheModuleRunsOn) {
  RecordedRun run("/there/is/none/run.mcap");
  EXPECT_TRUE(run.recorder->failed());
  run.run(20);
  EXPECT_EQ(run.recorder->finish(), "Cannot write \"/there/is/none/run.mcap\": No such file or directory.");
}

TEST(Recorder, DiskThatIsFull_SaysSoAndTheModuleRunsOn) {
  RecordedRun run("/dev/full");
  run.run(20);
  EXPECT_EQ(run.recorder->finish(), "Cannot write \"/dev/full\": No space left on device.");
  EXPECT_EQ(run.robot.camera.still_kept(), 0);
}

}  // namespace
}  // namespace polygmap::recording
