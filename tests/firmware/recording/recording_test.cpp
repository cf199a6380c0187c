// SPDX-License-Identifier: Apache-2.0
// The module writes down what it lives through, and lives it once more.
#include <gtest/gtest.h>

#include <atomic>
#include <barrier>
#include <deque>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "firmware/recording/recorder.hpp"
#include "firmware/recording/replay.hpp"
#include "sim_stub/heap_trap.hpp"
#include "tests/support/fake_robot.hpp"
#include "tests/support/slow_machine.hpp"

namespace polygmap::recording {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<char>;

Bytes read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}
void write_file(const fs::path& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// A directory that is there while the test is.
class Directory {
 public:
  explicit Directory(const std::string& name) : path_(fs::path(testing::TempDir()) / ("polygmap_recording_" + name)) {
    std::error_code error;
    fs::remove_all(path_, error);
    fs::create_directories(path_, error);
  }
  Directory(const Directory&) = delete;
  Directory& operator=(const Directory&) = delete;
  ~Directory() {
    std::error_code error;
    fs::remove_all(path_, error);
  }
  [[nodiscard]] fs::path file() const { return path_ / kFileName; }
  [[nodiscard]] fs::path pictures() const { return path_ / kPictureFileName; }
  [[nodiscard]] std::string text() const { return path_.string(); }

 private:
  fs::path path_;
};

// Collects what the hash of the fields is made of.
struct Names {
  std::vector<std::string> leaves, structs;
  void leaf(std::string_view name, int, const auto&) { leaves.emplace_back(name); }
  void enter(std::string_view name, int) { structs.emplace_back(name); }
  void leave() {}
  void names_only() const {}
  [[nodiscard]] bool have(std::string_view name) const {
    return std::ranges::count(leaves, name) + std::ranges::count(structs, name) > 0;
  }
};

TEST(HashOfFields, EveryKindOfRecordedField_IsInIt) {
  Names names;
  walk_recorded(names);
  for (const char* name :
       {"gyro_radps", "silent_cycles", "position_sigma_m", "tau_ff_nm",  // samples and commands
        "drive_errors", "bus_offs", "stale", "kd_nmsprad", "taken", "depth_unit_m", "oldest_input_ns", "outliers",
        "module_state", "treads_climbed", "p_star", "dropped", "height_m", "drift_m", "count"}) {
    EXPECT_TRUE(names.have(name)) << name;
  }
  EXPECT_EQ(std::ranges::count(names.leaves, "kp_nmprad"), static_cast<std::ptrdiff_t>(kJointCount) + 1)
      << "a command's and the limits'";
}

// A robot before stairs, and the module that drives it in one lane, recorded.
class RecordedRun {
 public:
  explicit RecordedRun(const Directory& directory, const Params& params = {})
      : recorder_(robot.ports()), module_(std::make_unique<Pipeline>(recorder_.ports(), params)) {
    recorder_.begin(directory.text(), params);
    recorder_.watch(*module_);
    executive_.start(robot.clock.now_ns() + kCycle_ns);
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      robot.advance();
      tick();
    }
  }
  void tick() {
    {
      const heap::ModuleCall call("recorded tick");
      executive_.tick(robot.clock.now_ns());
    }
    recorder_.flush();
  }
  void request_stop() { recorder_.request_stop(); }
  void finish() { EXPECT_EQ(recorder_.finish(), ""); }
  [[nodiscard]] const Pipeline& module() const { return *module_; }

  test::FakeRobot robot{0.062};

 private:
  Recorder recorder_;
  std::unique_ptr<Pipeline> module_;
  RecordedTasks<Pipeline> tasks_{*module_, &recorder_};
  OneLaneExecutive<RecordedTasks<Pipeline>> executive_{tasks_, robot.clock, module_->lane_health(0)};
};

// Keeps every picture as long as it is asked to: the fake robot draws the next one into the same memory.
struct KeptPictures final : PictureKeeper {
  int kept = 0, gone = 0;
  std::vector<std::uint16_t> pixels;
  [[nodiscard]] bool try_keep(DepthFrameView& frame) noexcept override {
    pixels.assign(frame.depth, frame.depth + frame.width_px * frame.height_px);
    frame.depth = pixels.data();
    ++kept;
    return true;
  }
  void let_go() noexcept override {
    pixels.assign(pixels.size(), 0);
    ++gone;
  }
};

void expect_same(const Directory& directory, std::uint64_t ticks) {
  const ReplayResult result = replay(directory.text());
  EXPECT_EQ(result.verdict, ReplayVerdict::kSame) << text_of(result);
  EXPECT_EQ(result.ticks, ticks);
  EXPECT_EQ(text_of(result), "replay: " + std::to_string(ticks) + " ticks, 0 differ\n");
}

TEST(Replay, ModuleThatWalks_NothingDiffers) {
  constexpr int kTicks = test::kSlowMachine ? 900 : 2500;  // the first picture is looked at after some 700
  const Directory directory("walk");
  Params params;
  params.gait.planner.pattern = GaitPattern::kSingleStep;  // a replay has the recording's parameters
  params.tread_height_sigma_m = 0.0041;
  RecordedRun run(directory, params);
  run.run(kTicks);
  run.finish();
  EXPECT_GT(run.module().perception().extractor().counters().frames, 0U);
  if (!test::kSlowMachine) {
    EXPECT_NE(run.module().control().gait_status().phase, GaitPhase::kStandstill);
  }
  expect_same(directory, kTicks);
}

TEST(Replay, SilentSensorsRefusedWritesLateTicksShedRowsAndAStop_NothingDiffers) {
  const Directory directory("trouble");
  RecordedRun run(directory);
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
  cycles += 2;
  for (int i = 0; i < 8; ++i) run.robot.advance();  // and more than can be caught up: skipped
  run.tick();
  cycles += 3;
  live(20);
  run.request_stop();
  live(40);
  run.finish();
  const Health& health = run.module().health();
  for (const Fault fault :
       {Fault::kImuMissing, Fault::kJointFeedbackMissing, Fault::kJointCommandRefused, Fault::kCycleSlip}) {
    EXPECT_GT(health.count(fault).count, 0U) << name_of(fault);
  }
  for (const Limit limit : {Limit::kCycleCaughtUp, Limit::kRowShed})
    EXPECT_GT(health.count(limit).count, 0U) << name_of(limit);
  expect_same(directory, cycles);
}

// Two threads; now and then perception has not finished when control begins the next frame.
TEST(Replay, TwoLanesOneOfThemBehind_NothingDiffers) {
  const Directory directory("lanes");
  test::FakeRobot robot(0.062);
  Recorder recorder(robot.ports());
  const auto module = std::make_unique<Pipeline>(recorder.ports(), Params{});
  recorder.begin(directory.text(), Params{});
  recorder.watch(*module);
  RecordedTasks<Pipeline> tasks(*module, &recorder);
  CyclicExecutive<RecordedTasks<Pipeline>, kSchedule, kControlLane, Health> control(tasks, robot.clock,
                                                                                    module->lane_health(kControlLane));
  CyclicExecutive<RecordedTasks<Pipeline>, kSchedule, kPerceptionLane, Health> perception(
      tasks, robot.clock, module->lane_health(kPerceptionLane));
  control.start(robot.clock.now_ns() + kCycle_ns);
  perception.start(robot.clock.now_ns() + kCycle_ns);
  constexpr int kFrames = 1000;
  std::barrier wake(2), asleep(2);
  std::thread other([&] {
    for (int i = 0; i < kFrames; ++i) {
      wake.arrive_and_wait();
      if (i % 50 < 48) perception.tick(robot.clock.now_ns());  // the 49th and 50th are run with the next
      asleep.arrive_and_wait();
    }
  });
  for (int i = 0; i < kFrames; ++i) {
    robot.advance();
    wake.arrive_and_wait();
    control.tick(robot.clock.now_ns());
    asleep.arrive_and_wait();
    recorder.flush();
  }
  other.join();
  EXPECT_EQ(recorder.finish(), "");
  // Once per gap control finds perception two cycles behind; whether also in the cycle after depends on the threads.
  EXPECT_GE(module->health().count(Fault::kLaneBehind).count, 20U);
  EXPECT_GT(module->perception().extractor().counters().frames, 0U);
  expect_same(directory, kFrames);
}

// As the daemon has it: the lanes run on while another thread writes, and pictures are copied piece by piece.
TEST(Replay, LanesWrittenOutWhileTheyRun_NothingDiffers) {
  const Directory directory("running");
  test::FakeRobot robot(0.062);
  KeptPictures keeper;
  Recorder recorder(robot.ports(), {.queue_bytes = 4U << 20U, .pictures = 8, .keeper = &keeper});
  const auto module = std::make_unique<Pipeline>(recorder.ports(), Params{});
  recorder.begin(directory.text(), Params{});
  recorder.watch(*module);
  RecordedTasks<Pipeline> tasks(*module, &recorder);
  CyclicExecutive<RecordedTasks<Pipeline>, kSchedule, kControlLane, Health> control(tasks, robot.clock,
                                                                                    module->lane_health(kControlLane));
  CyclicExecutive<RecordedTasks<Pipeline>, kSchedule, kPerceptionLane, Health> perception(
      tasks, robot.clock, module->lane_health(kPerceptionLane));
  control.start(robot.clock.now_ns() + kCycle_ns);
  perception.start(robot.clock.now_ns() + kCycle_ns);
  constexpr int kFrames = 1000;
  std::barrier wake(2), asleep(2);
  std::thread other([&] {
    for (int i = 0; i < kFrames; ++i) {
      wake.arrive_and_wait();
      if (i % 50 < 48) perception.tick(robot.clock.now_ns());  // the 49th and 50th are run with the next
      recorder.copy_piece();
      asleep.arrive_and_wait();
    }
  });
  std::atomic<bool> ends{false};
  std::thread writer([&] {
    while (!ends) recorder.write_out();
  });
  for (int i = 0; i < kFrames; ++i) {
    robot.advance();
    wake.arrive_and_wait();
    control.tick(robot.clock.now_ns());
    asleep.arrive_and_wait();
  }
  other.join();
  ends = true;
  writer.join();
  EXPECT_EQ(recorder.finish(), "");
  EXPECT_GT(module->perception().extractor().counters().frames, 0U);
  EXPECT_GT(keeper.kept, 10);
  EXPECT_EQ(keeper.kept, keeper.gone);
  expect_same(directory, kFrames);
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
  const Directory directory(name);
  test::FakeRobot robot(0.062);
  Recorder recorder(robot.ports());
  const auto module = std::make_unique<Pipeline>(recorder.ports(), Params{});
  recorder.begin(directory.text(), Params{});
  recorder.watch(*module);
  RecordedTasks<Pipeline> recorded(*module, &recorder);
  HeldTasks tasks{recorded, row};
  CyclicExecutive<HeldTasks, kSchedule, kControlLane, Health> control(tasks, robot.clock,
                                                                      module->lane_health(kControlLane));
  CyclicExecutive<HeldTasks, kSchedule, kPerceptionLane, Health> perception(tasks, robot.clock,
                                                                            module->lane_health(kPerceptionLane));
  const bool control_is_held = kTasks[row].row.lane == kControlLane;
  control.start(robot.clock.now_ns() + kCycle_ns);
  perception.start(robot.clock.now_ns() + kCycle_ns);
  const auto run_other = [&] {
    if (control_is_held) {
      perception.tick(robot.clock.now_ns());
    } else {
      control.tick(robot.clock.now_ns());
    }
    recorder.write_out();
  };
  int frames = 0, held = 0;
  tasks.meanwhile = [&] {
    if (frames % 50 != 0) return;
    ++held;
    for (int i = 0; i < kHeldFrames; ++i, ++frames) {
      robot.advance();
      run_other();
    }
  };
  for (; frames < kFrames; ++frames) {
    robot.advance();
    const std::int64_t now_ns = robot.clock.now_ns();
    run_other();
    if (control_is_held) {
      control.tick(now_ns);
    } else {
      perception.tick(now_ns);
    }
    recorder.write_out();
  }
  EXPECT_EQ(recorder.finish(), "");
  EXPECT_GT(held, 3);
  const ReplayResult result = replay(directory.text());
  EXPECT_EQ(result.verdict, ReplayVerdict::kSame) << text_of(result);
  EXPECT_GT(result.ticks, static_cast<std::uint64_t>(kFrames - held * (kHeldFrames + 1)));
  const bool looks_across = row == row_of("sense") || row == row_of("intake");
  EXPECT_EQ(module->health().count(Limit::kHandOverLost).count > 0, looks_across) << name;
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

// Nobody writes: the first cycle or picture that finds no room ends the recording, the module runs on, and what there
// was before is whole.
void expect_early_end(const Recorder::Capacity& capacity, const std::string& name, const std::string& why) {
  const Directory directory(name);
  test::FakeRobot robot(0.062);
  Recorder recorder(robot.ports(), capacity);
  const auto module = std::make_unique<Pipeline>(recorder.ports(), Params{});
  recorder.begin(directory.text(), Params{});
  recorder.watch(*module);
  RecordedTasks<Pipeline> tasks(*module, &recorder);
  OneLaneExecutive<RecordedTasks<Pipeline>> executive(tasks, robot.clock, module->lane_health(0));
  executive.start(robot.clock.now_ns() + kCycle_ns);
  for (int i = 0; i < 100; ++i) {
    robot.advance();
    const heap::ModuleCall call("recorded tick");
    executive.tick(robot.clock.now_ns());
  }
  EXPECT_TRUE(recorder.failed());
  EXPECT_EQ(recorder.finish(), "The recording in \"" + directory.text() + "\" ends early: " + why);
  EXPECT_TRUE(module->control().last_command().stamp_ns > 0);
  const ReplayResult result = replay(directory.text());
  EXPECT_EQ(result.verdict, ReplayVerdict::kUnreadable);
  EXPECT_GT(result.ticks, 5U);
  EXPECT_TRUE(result.difference.empty()) << result.difference;
  EXPECT_NE(result.complaint.find("ends within"), std::string::npos) << result.complaint;
}
TEST(Recorder, QueueThatIsFull_EndsTheRecordingAndSaysSo) {
  expect_early_end({.queue_bytes = 64U << 10U, .pictures = 8}, "full", "its queue was full.");
}
TEST(Recorder, PicturesThatNobodyWrites_EndTheRecordingAndSaySo) {
  expect_early_end({.queue_bytes = 4U << 20U, .pictures = 2}, "full_pictures", "its queue of pictures was full.");
}

TEST(BlockQueue, BlocksAroundTheEnd_ComeOutAsTheyWentInAndNoneTooMany) {
  BlockQueue queue(100);
  std::array<std::byte, 64> memory{};
  EXPECT_TRUE(queue.pop(memory).empty());
  std::mt19937 random(5);
  std::deque<std::vector<std::byte>> inside;
  std::size_t used = 0;
  for (int i = 0; i < 10'000; ++i) {
    std::vector<std::byte> block(1 + random() % 40);
    for (std::byte& byte : block) byte = static_cast<std::byte>(random());
    const std::size_t head = random() % block.size();
    const std::span<const std::byte> bytes(block);
    const bool fits = used + 4 + block.size() <= 100;
    ASSERT_EQ(queue.try_push(bytes.first(head), bytes.subspan(head)), fits);
    if (fits) {
      used += 4 + block.size();
      inside.push_back(block);
    }
    if (random() % 2 == 0 || inside.empty()) continue;
    const std::span<std::byte> out = queue.pop(memory);
    ASSERT_TRUE(std::ranges::equal(out, inside.front()));
    used -= 4 + inside.front().size();
    inside.pop_front();
  }
}

// A recording of few ticks, for changes.
class ShortRecording : public testing::Test {
 protected:
  ShortRecording() {
    Params params;
    params.estimator.rest_ns = 0;  // the joints are read for something from the first tick on
    RecordedRun run(directory_, params);
    run.run(kTicks);
    run.finish();
    bytes_ = read_file(directory_.file());
  }
  // Where the n-th call of that row has its first port call.
  [[nodiscard]] std::size_t first_call(std::uint8_t row, int n) const {
    std::size_t at = header_bytes();
    for (int found = -1; at + 5 < bytes_.size();) {
      std::uint32_t length = 0;
      std::memcpy(&length, &bytes_[at + 1], sizeof length);
      if (bytes_[at] == 'R' && bytes_[at + 5] == static_cast<char>(row) && ++found == n)
        return at + 5 + 1 + 8 + 4 + 8 + 2;
      at += 5 + length;
    }
    return 0;
  }
  // The camera's seven numbers and the drives' gains come last.
  [[nodiscard]] std::size_t header_bytes() const {
    const std::string last = "footholds";
    const auto name = std::search(bytes_.begin(), bytes_.end(), last.begin(), last.end());
    std::size_t at = 0;
    for (auto it = name; it != bytes_.end(); it = std::search(it + 1, bytes_.end(), last.begin(), last.end())) {
      const auto place = static_cast<std::size_t>(it - bytes_.begin());
      if (bytes_[place - 2] == 9 && bytes_[place - 1] == 0)
        at = place + last.size() + 12 + (8 + 5 * 8) + kJointCount * 2 * 8;
      if (at != 0) break;
    }
    return at;
  }
  [[nodiscard]] ReplayResult replay_of(const Bytes& bytes) const {
    write_file(directory_.file(), bytes);
    return replay(directory_.text());
  }
  void expect_unreadable(const ReplayResult& result, const std::string& words) const {
    EXPECT_EQ(result.verdict, ReplayVerdict::kUnreadable);
    EXPECT_NE(result.complaint.find(words), std::string::npos) << result.complaint;
    EXPECT_NE(result.complaint.find("byte "), std::string::npos) << result.complaint;
    EXPECT_EQ(result.complaint.find('\n'), std::string::npos);
    EXPECT_EQ(result.complaint.back(), '.');
  }

  static constexpr int kTicks = 40;  // with a picture, which nobody can place yet
  const Directory directory_{testing::UnitTest::GetInstance()->current_test_info()->name()};
  Bytes bytes_;
};

TEST_F(ShortRecording, Unchanged_Replays) { expect_same(directory_, kTicks); }

TEST_F(ShortRecording, OneBitOfAnInputFlipped_TickStageAndFieldAreNamed) {
  for (const int bit : {0, 20, 51, 63}) {
    Bytes flipped = bytes_;
    const std::size_t knee = first_call(0, 30) + (2 + 56) + 2 + (2 + 8 + 3 * 8);  // the IMU's sample, no other, joints
    flipped[knee + static_cast<std::size_t>(bit / 8)] ^= static_cast<char>(1 << (bit % 8));
    const ReplayResult result = replay_of(flipped);
    EXPECT_EQ(result.verdict, ReplayVerdict::kDiffers) << bit;
    EXPECT_GT(result.differ, 0U);
    EXPECT_EQ(result.ticks, static_cast<std::uint64_t>(kTicks));
    EXPECT_EQ(result.difference.find("tick 30, estimate, "), 0U) << result.difference;
    EXPECT_NE(result.difference.find(": recorded 0x"), std::string::npos) << result.difference;
  }
}

TEST_F(ShortRecording, SampleThatNeverCame_IsAnotherOrderOfCallsOrAnotherResult) {
  Bytes changed = bytes_;
  changed[first_call(0, 20)] = 2;  // the IMU's sample is said to be the joints', which is longer
  const ReplayResult result = replay_of(changed);
  EXPECT_NE(result.verdict, ReplayVerdict::kSame);
}

TEST_F(ShortRecording, PixelChanged_PictureIsNotTheRecordedOne) {
  Bytes pictures = read_file(directory_.pictures());
  ASSERT_GT(pictures.size(), 600'000U);
  pictures[300'001] ^= 4;
  write_file(directory_.pictures(), pictures);
  expect_unreadable(replay(directory_.text()), "pictures.bin\", byte 20: picture 0 is not the one that was recorded");
  pictures.resize(300'000);
  write_file(directory_.pictures(), pictures);
  expect_unreadable(replay(directory_.text()), "the file ends within picture 0");
  pictures.resize(10);
  write_file(directory_.pictures(), pictures);
  expect_unreadable(replay(directory_.text()), "the file ends within its header");
}

TEST(Replay, DirectoryWithoutARecording_IsNamedWithTheFileThatIsMissing) {
  const Directory directory("none");
  const auto expect_none = [&](const std::string& path, const std::string& why) {
    const ReplayResult result = replay(path);
    EXPECT_EQ(result.verdict, ReplayVerdict::kUnreadable);
    EXPECT_EQ(result.complaint, "\"" + path + "\" is no recording: " + why);
  };
  expect_none("/there/is/none", "there is no such directory.");
  expect_none("/dev/null", "it is no directory, and climb --record writes one.");
  expect_none(directory.text(), "there is no file recording.bin in it.");
  write_file(directory.file(), {'x'});
  expect_none(directory.text(), "there is no file pictures.bin in it.");
  fs::create_directory(directory.pictures());
  expect_none(directory.text(), "pictures.bin in it is a directory.");
}

TEST_F(ShortRecording, ForeignOneOrAnotherVersion_OneSentenceWithFileAndByte) {
  expect_unreadable(replay_of({}), "byte 0: the file ends within its first bytes");
  Bytes foreign(100'000);
  std::mt19937 random(1);
  for (char& byte : foreign) byte = static_cast<char>(random());
  expect_unreadable(replay_of(foreign), "byte 0: this is no recording");
  Bytes changed = bytes_;
  changed[8] = 9;
  expect_unreadable(replay_of(changed), "byte 8: version 9, where this program reads " + std::to_string(kVersion));
  changed = bytes_;
  changed[12] ^= 1;
  expect_unreadable(replay_of(changed), "byte 12: it has the fields of another build");
}

TEST_F(ShortRecording, ParameterUnknownMissingOrOutOfRange_IsNamed) {
  const std::string name = "tread_height_sigma_m";
  const auto place = std::search(bytes_.begin(), bytes_.end(), name.begin(), name.end()) - bytes_.begin();
  Bytes changed = bytes_;
  changed[static_cast<std::size_t>(place)] = 'x';
  expect_unreadable(replay_of(changed), "this module has no parameter \"xread_height_sigma_m\"");
  changed = bytes_;
  const double wide = 0.2;
  std::memcpy(&changed[static_cast<std::size_t>(place) + name.size() + 5], &wide, sizeof wide);
  expect_unreadable(replay_of(changed), "parameter \"tread_height_sigma_m\" is outside its range");
}

TEST_F(ShortRecording, CutOffAnywhere_SaysWhere) {
  std::mt19937 random(2);
  for (int i = 0; i < (test::kSlowMachine ? 20 : 200); ++i) {
    const std::size_t size = i == 0 ? bytes_.size() - 1 : random() % bytes_.size();
    expect_unreadable(replay_of(Bytes(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(size))),
                      "ends within");
  }
}

// Bits flipped, bytes set, pieces doubled, moved and cut out: the same, another result or one sentence, and no crash.
TEST_F(ShortRecording, ThousandsOfMutations_EndInAVerdict) {
  constexpr int kMutations = test::kSlowMachine ? 100 : 3000;
  std::mt19937 random(3);
  std::array<int, 3> verdicts{};
  for (int i = 0; i < kMutations; ++i) {
    Bytes changed = bytes_;
    const auto place = [&] {
      return random() % (i % 3 == 0 ? std::min<std::size_t>(changed.size(), 30'000) : changed.size());
    };
    for (unsigned change = 0; change <= random() % 3; ++change) {
      const auto at = static_cast<std::ptrdiff_t>(place());
      const std::ptrdiff_t length =
          std::min<std::ptrdiff_t>(1 + random() % 64, static_cast<std::ptrdiff_t>(changed.size()) - at);
      switch (random() % 6) {
        case 0:
        case 1:
          changed[static_cast<std::size_t>(at)] ^= static_cast<char>(1U << (random() % 8));
          break;
        case 2:
          std::fill_n(changed.begin() + at, length, static_cast<char>(random() % 2 == 0 ? 0xFF : 0x7F));
          break;
        case 3: {
          const Bytes piece(changed.begin() + at, changed.begin() + at + length);
          changed.insert(changed.begin() + static_cast<std::ptrdiff_t>(place()), piece.begin(), piece.end());
          break;
        }
        case 4:
          changed.erase(changed.begin() + at, changed.begin() + at + length);
          break;
        default:
          for (std::ptrdiff_t k = at; k < at + length; ++k)
            changed[static_cast<std::size_t>(k)] = static_cast<char>(random());
      }
    }
    const ReplayResult result = replay_of(changed);
    ++verdicts[static_cast<std::size_t>(result.verdict)];
    if (result.verdict == ReplayVerdict::kUnreadable) {
      expect_unreadable(result, ".");
    } else {
      EXPECT_EQ(result.difference.empty(), result.verdict == ReplayVerdict::kSame);
    }
  }
  // Some change what nothing computes with: those may be the same.
  for (const ReplayVerdict verdict : {ReplayVerdict::kDiffers, ReplayVerdict::kUnreadable}) {
    EXPECT_GT(verdicts[static_cast<std::size_t>(verdict)], 0) << static_cast<int>(verdict);
  }
}

TEST(Recorder, DirectoryThatIsNone_SaysSoAndTheModuleRunsOn) {
  test::FakeRobot robot(0.062);
  Recorder recorder(robot.ports());
  const auto module = std::make_unique<Pipeline>(recorder.ports(), Params{});
  recorder.begin("/there/is/none", Params{});
  recorder.watch(*module);
  recorder.flush();
  EXPECT_EQ(recorder.finish().find("Cannot write \"/there/is/none/recording.bin\": "), 0U);
}

}  // namespace
}  // namespace polygmap::recording
