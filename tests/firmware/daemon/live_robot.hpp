// SPDX-License-Identifier: Apache-2.0
// The fake robot in real time: it lives 2 ms whenever the machine's clock has moved by so much and the module reads its
// IMU. Its ports are for one lane.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <vector>

#include "tests/support/fake_robot.hpp"

namespace polygmap::test {

class LiveRobot final : public hal::Imu, public hal::JointBus, public hal::DepthCamera, public hal::LidarOdometry {
 public:
  LiveRobot() : robot(0.062) {
    robot.camera_speaks = true;
    DepthFrameView frame{};
    while (!robot.camera.try_acquire(frame)) robot.advance();
    seen_.assign(frame.depth, frame.depth + robot.camera.pixels());
    robot.camera.release();
    robot.camera_speaks = false;
  }
  [[nodiscard]] Ports ports() noexcept { return {*this, *this, *this, *this}; }

  FakeRobot robot;
  std::atomic<bool> drives_answer{true};
  std::atomic<bool> imu_speaks{true};
  // The same picture again and again, from where it stands at first: to render others takes longer than a cycle.
  std::atomic<bool> sees{false};
  std::function<void()> in_every_read;  // of the IMU

  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override {
    const heap::HostCall host;
    live();
    if (!robot.imu.try_read(sample) || !imu_speaks) return false;
    sample.stamp_ns += ahead_ns_;
    return true;
  }
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override {
    if (!drives_answer || !robot.joints.try_read(feedback)) return false;
    feedback.stamp_ns += ahead_ns_;
    return true;
  }
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override {
    JointCommand heard = command;
    heard.stamp_ns -= ahead_ns_;
    if (heard.joints[0].kp_nmprad > 0.0) has_gains = true;
    // Without gains a joint stays where it is; something else holds the robot.
    return has_gains ? robot.joints.try_write(heard) : JointSet::all();
  }
  [[nodiscard]] hal::JointBusStatus status() const noexcept override { return robot.joints.status(); }
  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return robot.camera.intrinsics(); }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override {
    if (!robot.camera.try_acquire(frame)) return false;
    frame.stamp_ns += ahead_ns_;
    return true;
  }
  void release() noexcept override { robot.camera.release(); }
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override {
    if (!robot.lidar.try_read(sample)) return false;
    sample.stamp_ns += ahead_ns_;
    return true;
  }
  std::atomic<bool> has_gains{false};

 private:
  void live() {
    if (in_every_read) in_every_read();
    const std::int64_t now_ns =
        std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
            .count();
    if (ahead_ns_ == 0) ahead_ns_ = now_ns - kCycle_ns - robot.clock.now_ns();
    while (robot.clock.now_ns() + ahead_ns_ + kCycle_ns <= now_ns) {
      robot.advance();
      if (sees && ++tick_ % kPictureTicks == 0) robot.camera.feed(robot.clock.now_ns(), seen_);
    }
  }
  static constexpr int kPictureTicks = 17;
  std::vector<std::uint16_t> seen_;
  int tick_ = 0;
  std::int64_t ahead_ns_ = 0;  // of the robot's clock
};

}  // namespace polygmap::test
