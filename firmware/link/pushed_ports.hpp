// SPDX-License-Identifier: Apache-2.0
// The module's ports where a caller pushes what its sensors say, and fetches what the drives are to be told. Stamps are
// the caller's until the module reads them.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>

#include "algorithms/core/containers/ring_buffer.hpp"
#include "firmware/link/instance_clock.hpp"
#include "hal/ports/depth_camera.hpp"
#include "hal/ports/imu.hpp"
#include "hal/ports/joint_bus.hpp"
#include "hal/ports/lidar_odometry.hpp"
#include "hal/ports/operator_input.hpp"
#include "scheduler/cycle_monitor.hpp"

namespace polygmap::link {

// In which order one kind of sample may come.
class StampOrder {
 public:
  [[nodiscard]] bool try_follow(const InstanceClock& clock, std::int64_t stamp_ns) noexcept {
    if ((any_ && stamp_ns <= last_ns_) || clock.is_far_ahead(stamp_ns)) return false;
    any_ = true;
    last_ns_ = stamp_ns;
    return true;
  }
  // When the first step has told the time: true when what was pushed before it is of another one.
  [[nodiscard]] bool try_forget(const InstanceClock& clock) noexcept {
    if (!any_ || !clock.is_far_ahead(last_ns_)) return false;
    any_ = false;
    return true;
  }

 private:
  bool any_ = false;
  std::int64_t last_ns_ = 0;
};

// Samples in their order; a full queue pushes out the oldest.
template <class Sample, std::size_t Capacity>
class SampleQueue {
 public:
  explicit SampleQueue(const InstanceClock& clock) noexcept : clock_(clock) {}
  [[nodiscard]] bool try_push(const Sample& sample) noexcept {
    if (!order_.try_follow(clock_, sample.stamp_ns)) return false;
    if (samples_.full()) count_up(dropped_);
    samples_.push_overwrite(sample);
    return true;
  }
  [[nodiscard]] bool try_pop(Sample& sample) noexcept {
    if (!samples_.try_pop(sample)) return false;
    sample.stamp_ns = clock_.to_module(sample.stamp_ns);
    return true;
  }
  void begin() noexcept {
    if (!order_.try_forget(clock_)) return;
    dropped_ += static_cast<std::uint32_t>(samples_.size());
    samples_.clear();
  }
  [[nodiscard]] std::uint32_t dropped() const noexcept { return dropped_; }

 private:
  const InstanceClock& clock_;
  StampOrder order_;
  RingBuffer<Sample, Capacity> samples_;
  std::uint32_t dropped_ = 0;
};

class PushedImu final : public hal::Imu {
 public:
  explicit PushedImu(const InstanceClock& clock) noexcept : queue(clock) {}
  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override { return queue.try_pop(sample); }
  SampleQueue<ImuSample, 64> queue;
};

class PushedLio final : public hal::LidarOdometry {
 public:
  explicit PushedLio(const InstanceClock& clock) noexcept : queue(clock) {}
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override { return queue.try_pop(sample); }
  SampleQueue<LioSample, 16> queue;
};

class PushedJoints final : public hal::JointBus {
 public:
  // What the drives tell beside their joints' motion.
  struct Drives {
    JointSet errors;
    JointSet refused;  // of the command that was fetched last
    std::array<std::int16_t, kJointCount> degc = hal::all_not_told_degc();
  };

  explicit PushedJoints(const InstanceClock& clock) noexcept : clock_(clock) {}
  [[nodiscard]] bool try_push(const JointFeedback& feedback, const Drives& drives) noexcept {
    if (!order_.try_follow(clock_, feedback.stamp_ns)) return false;
    feedback_ = feedback;
    drives_ = drives;
    fresh_ = true;
    return true;
  }
  void begin() noexcept {
    if (order_.try_forget(clock_)) fresh_ = false;
  }
  // Before a cycle: it has made no command yet.
  void begin_cycle() noexcept { command_.stamp_ns = 0; }
  // Of the last cycle; null: none.
  [[nodiscard]] const JointCommand* command() const noexcept { return command_.stamp_ns == 0 ? nullptr : &command_; }

  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override {
    if (!fresh_) return false;
    fresh_ = false;
    feedback = feedback_;
    feedback.stamp_ns = clock_.to_module(feedback_.stamp_ns);
    status_.drive_errors = drives_.errors;
    status_.drive_degc = drives_.degc;
    status_.drive_error_replies += static_cast<std::uint32_t>(std::popcount(drives_.errors.bits()));
    return true;
  }
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override {
    command_ = command;
    const auto refused = static_cast<std::uint32_t>(drives_.refused.bits());
    if (refused != 0) count_up(status_.refused);
    drives_.refused = {};
    return JointSet::of_bits(~refused);
  }
  [[nodiscard]] hal::JointBusStatus status() const noexcept override { return status_; }

 private:
  const InstanceClock& clock_;
  StampOrder order_;
  bool fresh_ = false;
  JointFeedback feedback_;
  Drives drives_;
  hal::JointBusStatus status_;
  JointCommand command_;
};

// Two pictures: the one that the module works on, and the newest that waits.
class PushedDepth final : public hal::DepthCamera {
 public:
  explicit PushedDepth(const InstanceClock& clock) noexcept : clock_(clock) {}
  void set_intrinsics(const CameraIntrinsics& intrinsics) noexcept { intrinsics_ = intrinsics; }
  // picture: of the camera's size; its pixels are copied.
  [[nodiscard]] bool try_push(const DepthFrameView& picture) noexcept {
    if (!order_.try_follow(clock_, picture.stamp_ns)) return false;
    if (waits_) count_up(dropped_);
    Pixels& pixels = pixels_[1 - held_slot_];
    std::copy_n(picture.depth, std::ptrdiff_t{picture.width_px} * picture.height_px, pixels.begin());
    waiting_ = picture;
    waiting_.depth = pixels.data();
    waits_ = true;
    return true;
  }
  void begin() noexcept {
    if (!order_.try_forget(clock_)) return;
    waits_ = false;
    count_up(dropped_);
  }
  [[nodiscard]] std::uint32_t dropped() const noexcept { return dropped_; }

  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return intrinsics_; }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override {
    if (!waits_ || holds_) return false;
    frame = waiting_;
    frame.stamp_ns = clock_.to_module(waiting_.stamp_ns);
    held_slot_ = 1 - held_slot_;
    holds_ = true;
    waits_ = false;
    return true;
  }
  void release() noexcept override { holds_ = false; }

 private:
  using Pixels = std::array<std::uint16_t, static_cast<std::size_t>(kDepthWidth_px) * kDepthHeight_px>;

  const InstanceClock& clock_;
  StampOrder order_;
  CameraIntrinsics intrinsics_;
  DepthFrameView waiting_;
  std::size_t held_slot_ = 0;  // of the picture that is held or was last
  bool waits_ = false, holds_ = false;
  std::uint32_t dropped_ = 0;
  std::array<Pixels, 2> pixels_;  // not set: nobody looks at what was not pushed
};

class PushedOperator final : public hal::OperatorInput {
 public:
  struct Answered {
    std::uint32_t count = 0;
    OperatorCommand command{};  // the last one, if there was any
    OperatorAnswer answer;
  };
  [[nodiscard]] bool try_push(const OperatorRequest& request) noexcept { return requests_.try_push(request); }
  [[nodiscard]] const Answered& answered() const noexcept { return answered_; }

  [[nodiscard]] bool try_read(OperatorRequest& request) noexcept override {
    if (!requests_.try_pop(request)) return false;
    answered_.command = request.command;
    return true;
  }
  void answer(const OperatorAnswer& answer) noexcept override {
    count_up(answered_.count);
    answered_.answer = answer;
  }

 private:
  RingBuffer<OperatorRequest, 8> requests_;
  Answered answered_;
};

}  // namespace polygmap::link
