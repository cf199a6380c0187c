// SPDX-License-Identifier: Apache-2.0
// A module that walks up to stairs and sees them, recorded: what toolchain/checks/instructions counts is what the
// recording takes of its cycles, without the writer's thread and without the robot's ports, which are asked in any
// case.
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "firmware/recording/recorder.hpp"
#include "tests/benchmarks/build_name.hpp"
#include "tests/support/fake_robot.hpp"

namespace polygmap::bench {
namespace {

using recording::Recorder;

}  // namespace

// Called apart, so that callgrind tells them from the module's own work.
[[gnu::noinline]] void stage_record(Recorder& recorder, std::size_t row, std::int64_t cycle_ns,
                                    const WorkBudget& budget) {
  recorder.begin_row(row, cycle_ns, budget);
}
[[gnu::noinline]] void stage_record(Recorder& recorder, std::size_t row, Progress progress, const WorkBudget& budget) {
  recorder.end_row(row, progress, budget);
}
[[gnu::noinline]] void stage_record(Recorder& recorder, const CycleReport& report) { recorder.cycle_done(0, report); }
[[gnu::noinline]] bool stage_record(Recorder& recorder, ImuSample& sample) { return recorder.try_read(sample); }
[[gnu::noinline]] bool stage_record(Recorder& recorder, JointFeedback& sample) { return recorder.try_read(sample); }
[[gnu::noinline]] bool stage_record(Recorder& recorder, LioSample& sample) { return recorder.try_read(sample); }
[[gnu::noinline]] bool stage_record(Recorder& recorder, DepthFrameView& frame) { return recorder.try_acquire(frame); }
[[gnu::noinline]] hal::JointBusStatus stage_record(const Recorder& recorder) { return recorder.status(); }
[[gnu::noinline]] JointSet stage_record(Recorder& recorder, const JointCommand& command) {
  return recorder.try_write(command);
}

// The robot's ports: what they take is taken off.
[[gnu::noinline]] bool but_not_record(hal::Imu& port, ImuSample& sample) { return port.try_read(sample); }
[[gnu::noinline]] bool but_not_record(hal::JointBus& port, JointFeedback& sample) { return port.try_read(sample); }
[[gnu::noinline]] bool but_not_record(hal::LidarOdometry& port, LioSample& sample) { return port.try_read(sample); }
[[gnu::noinline]] bool but_not_record(hal::DepthCamera& port, DepthFrameView& frame) { return port.try_acquire(frame); }
[[gnu::noinline]] hal::JointBusStatus but_not_record(const hal::JointBus& port) { return port.status(); }
[[gnu::noinline]] JointSet but_not_record(hal::JointBus& port, const JointCommand& command) {
  return port.try_write(command);
}

namespace {

class RobotPorts final : public hal::DepthCamera, public hal::Imu, public hal::JointBus, public hal::LidarOdometry {
 public:
  explicit RobotPorts(const Ports& robot) noexcept : robot_(robot) {}
  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return robot_.camera.intrinsics(); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override {
    return but_not_record(robot_.camera, frame);
  }
  void release() noexcept override { robot_.camera.release(); }
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override { return but_not_record(robot_.imu, sample); }
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override {
    return but_not_record(robot_.joints, feedback);
  }
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override { return but_not_record(robot_.lio, sample); }
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override {
    return but_not_record(robot_.joints, command);
  }
  [[nodiscard]] hal::JointBusStatus status() const noexcept override { return but_not_record(robot_.joints); }

 private:
  Ports robot_;
};

class CountedPorts final : public hal::DepthCamera, public hal::Imu, public hal::JointBus, public hal::LidarOdometry {
 public:
  explicit CountedPorts(Recorder& recorder) noexcept : recorder_(recorder) {}
  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return recorder_.intrinsics(); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override { return stage_record(recorder_, frame); }
  void release() noexcept override { recorder_.release(); }
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override { return stage_record(recorder_, sample); }
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override { return stage_record(recorder_, feedback); }
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override { return stage_record(recorder_, sample); }
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override {
    return stage_record(recorder_, command);
  }
  [[nodiscard]] hal::JointBusStatus status() const noexcept override { return stage_record(recorder_); }

 private:
  Recorder& recorder_;
};

struct CountedTasks {
  Pipeline& pipeline;
  Recorder& recorder;
  Progress run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) noexcept {
    stage_record(recorder, row, cycle_ns, budget);
    const Progress progress = pipeline.run_row(row, cycle_ns, budget);
    stage_record(recorder, row, progress, budget);
    return progress;
  }
  void cycle_done(std::size_t lane, const CycleReport& report) noexcept {
    stage_record(recorder, report);
    pipeline.cycle_done(lane, report);
  }
};

int run() {
  constexpr int kTicks = 900;
  const char* scratch = std::getenv("TMPDIR");
  const std::string path = std::string(scratch != nullptr ? scratch : "/tmp") + "/polygmap_recording_instructions.mcap";
  test::FakeRobot robot(0.062);
  RobotPorts robot_ports(robot.ports());
  const auto recorder = std::make_unique<Recorder>(Ports{robot_ports, robot_ports, robot_ports, robot_ports});
  CountedPorts ports(*recorder);
  const auto module = std::make_unique<Pipeline>(Ports{ports, ports, ports, ports}, Params{});
  recorder->begin(path, Params{}, 1);
  recorder->watch(*module);
  CountedTasks tasks{*module, *recorder};
  OneLaneExecutive<CountedTasks> executive(tasks, robot.clock, module->lane_health(0));
  executive.start(robot.clock.now_ns() + kCycle_ns);
  for (int i = 0; i < kTicks; ++i) {
    robot.advance();
    executive.tick(robot.clock.now_ns());
    recorder->write_out();
  }
  const std::string wrong = recorder->finish();
  (void)std::remove(path.c_str());
  if (!wrong.empty() || module->perception().extractor().counters().frames == 0) {
    std::fprintf(stderr, "recording_instructions: %s\n", wrong.empty() ? "it saw nothing" : wrong.c_str());
    return 1;
  }
  std::printf("build %s\nruns %d\n", build_name().c_str(), kTicks);
  return 0;
}

}  // namespace
}  // namespace polygmap::bench

int main() { return polygmap::bench::run(); }
