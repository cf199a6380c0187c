// SPDX-License-Identifier: Apache-2.0
// A fake robot's module that is recorded: in one lane, or lane by lane.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "firmware/recording/recorder.hpp"
#include "firmware/recording/replay.hpp"
#include "sim_stub/heap_trap.hpp"
#include "tests/support/fake_robot.hpp"

namespace polygmap::recording {

using Bytes = std::vector<std::byte>;

inline Bytes read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const auto* const begin = reinterpret_cast<const std::byte*>(text.data());
  return {begin, begin + text.size()};
}
inline void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

// A folder that is there while the test is, and the recording in it.
class RecordingFolder {
 public:
  explicit RecordingFolder(const std::string& name)
      : path_(std::filesystem::path(testing::TempDir()) / ("polygmap_" + name + "_" + std::to_string(::getpid()))) {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
    std::filesystem::create_directories(path_, error);
  }
  RecordingFolder(const RecordingFolder&) = delete;
  RecordingFolder& operator=(const RecordingFolder&) = delete;
  ~RecordingFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::string file() const { return (path_ / "run.mcap").string(); }

 private:
  std::filesystem::path path_;
};

// A robot before stairs, and the module that drives it; whoever runs the lanes makes the executives.
struct RecordedModule {
  enum class Pictures { kAll, kNone };

  explicit RecordedModule(const std::string& path, const Params& params = {}, Pictures pictures = Pictures::kAll)
      : recorder(std::make_unique<Recorder>(robot.ports(), pictures == Pictures::kAll ? &robot.camera : nullptr)),
        module(std::make_unique<Pipeline>(recorder->ports(), params)),
        tasks(*module, recorder.get()) {
    recorder->begin(path, params, 7);
    recorder->watch(*module);
  }
  [[nodiscard]] std::int64_t first_cycle_ns() const { return robot.clock.now_ns() + kCycle_ns; }
  // The thread that writes makes no heap call either.
  void flush() {
    const heap::ModuleCall call("Recorder::flush");
    recorder->flush();
  }
  void write_out() {
    const heap::ModuleCall call("Recorder::write_out");
    recorder->write_out();
  }

  test::FakeRobot robot{0.062};
  std::unique_ptr<Recorder> recorder;
  std::unique_ptr<Pipeline> module;
  RecordedTasks<Pipeline> tasks;
};

// In one lane.
class RecordedRun : public RecordedModule {
 public:
  explicit RecordedRun(const std::string& path, const Params& params = {}, Pictures pictures = Pictures::kAll)
      : RecordedModule(path, params, pictures) {
    executive_.start(first_cycle_ns());
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      robot.advance();
      tick();
      flush();
    }
  }
  // Nobody writes it out.
  void tick() {
    const heap::ModuleCall call("recorded tick");
    executive_.tick(robot.clock.now_ns());
  }
  void finish() {
    EXPECT_EQ(recorder->finish(), "");
    EXPECT_EQ(robot.camera.still_kept(), 0);
  }

 private:
  OneLaneExecutive<RecordedTasks<Pipeline>> executive_{tasks, robot.clock, module->lane_health(0)};
};

// In two. Tasks: RecordedTasks, or who stands before them.
template <class Tasks>
struct LanePair {
  CyclicExecutive<Tasks, kSchedule, kControlLane, Health> control;
  CyclicExecutive<Tasks, kSchedule, kPerceptionLane, Health> perception;

  LanePair(RecordedModule& recorded, Tasks& tasks)
      : control(tasks, recorded.robot.clock, recorded.module->lane_health(kControlLane)),
        perception(tasks, recorded.robot.clock, recorded.module->lane_health(kPerceptionLane)) {
    control.start(recorded.first_cycle_ns());
    perception.start(recorded.first_cycle_ns());
  }
};

inline void expect_same(const std::string& path, std::uint64_t ticks) {
  const ReplayResult result = replay(path);
  EXPECT_EQ(result.verdict, ReplayVerdict::kSame) << text_of(result);
  EXPECT_EQ(result.ticks, ticks);
  EXPECT_EQ(text_of(result), "replay: " + std::to_string(ticks) + " ticks, 0 differ\n");
}

}  // namespace polygmap::recording
