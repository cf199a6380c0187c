// SPDX-License-Identifier: Apache-2.0
// The recorded climb as a robot: its ports say what the sensors said, and compare what is commanded.
#pragma once

#include <atomic>
#include <bit>
#include <span>
#include <vector>

#include "hal/ports/depth_camera.hpp"
#include "hal/ports/imu.hpp"
#include "hal/ports/joint_bus.hpp"
#include "hal/ports/lidar_odometry.hpp"
#include "tests/vm/climb_inputs.hpp"

namespace polygmap::vm {

inline constexpr std::int64_t kPictureLatency_ns = 30 * kNsPerMs;  // from exposure to arrival

struct Recording {
  CameraIntrinsics intrinsics;
  std::vector<TickInputs> ticks;
  std::span<const char> pictures;

  // false: the files are not a recording.
  [[nodiscard]] bool read(std::span<const char> inputs, std::span<const char> pixels) {
    Reader reader(inputs);
    std::uint64_t magic = 0;
    reader(magic);
    visit_fields(reader, intrinsics);
    while (magic == kInputsMagic && reader.good() && !reader.at_end()) {
      TickInputs tick;
      visit_fields(reader, tick);
      if (tick.imu_count > kMaxImuPerTick) return false;
      ticks.push_back(tick);
    }
    pictures = pixels;
    return reader.good() && !ticks.empty();
  }
  [[nodiscard]] std::size_t picture_bytes() const noexcept {
    return sizeof(std::uint16_t) * static_cast<std::size_t>(intrinsics.width_px) *
           static_cast<std::size_t>(intrinsics.height_px);
  }
};

// Control's ports; on control's thread.
class ReplayedSensors final : public hal::Imu, public hal::JointBus, public hal::LidarOdometry {
 public:
  explicit ReplayedSensors(const Recording& recording) noexcept : ticks_(recording.ticks) {}
  // The joints are behind these wires instead; what is commanded is compared all the same.
  void connect(hal::JointBus& wires) noexcept { wires_ = &wires; }

  // What has arrived until now_ns can be read from now on.
  void advance(std::int64_t now_ns) noexcept {
    while (next_ < ticks_.size() && ticks_[next_].now_ns <= now_ns) ++next_;
  }
  void set_silent(bool silent) noexcept { silent_ = silent; }

  [[nodiscard]] bool try_read(ImuSample& sample) noexcept override {
    for (; imu_tick_ < next_; ++imu_tick_, imu_ = 0) {
      if (imu_ >= ticks_[imu_tick_].imu_count || silent_) continue;
      sample = ticks_[imu_tick_].imu[imu_++];
      return true;
    }
    return false;
  }
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override {
    if (wires_ != nullptr) return wires_->try_read(feedback);
    if (next_ == joint_tick_ || silent_) return false;
    joint_tick_ = next_;
    if (ticks_[next_ - 1].has_joints == 0) return false;
    feedback = ticks_[next_ - 1].joints;
    return true;
  }
  [[nodiscard]] bool try_read(LioSample& sample) noexcept override {
    for (; lio_tick_ < next_; ++lio_tick_) {
      if (ticks_[lio_tick_].has_lio == 0) continue;
      sample = ticks_[lio_tick_++].lio;
      return true;
    }
    return false;
  }
  // A frame is a joint's command; it differs when a bit of it does, and when it was made in another tick.
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override {
    frames_ += kJointCount;
    while (compared_ < ticks_.size() && ticks_[compared_].command.stamp_ns < command.stamp_ns) ++compared_;
    const bool known = compared_ < ticks_.size() && ticks_[compared_].has_command != 0 &&
                       ticks_[compared_].command.stamp_ns == command.stamp_ns;
    for (std::size_t j = 0; j < kJointCount; ++j) {
      if (known && same(command.joints[j], ticks_[compared_].command.joints[j])) continue;
      ++differ_;
      if (first_difference_ns_ < 0) first_difference_ns_ = command.stamp_ns;
      if (known)
        far_rad_ = std::max(far_rad_, std::abs(command.joints[j].q_rad - ticks_[compared_].command.joints[j].q_rad));
    }
    return wires_ != nullptr ? wires_->try_write(command) : JointSet::all();
  }
  [[nodiscard]] hal::JointBusStatus status() const noexcept override {
    return wires_ != nullptr ? wires_->status() : hal::JointBusStatus{};
  }

  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }
  [[nodiscard]] std::uint64_t frames_differ() const noexcept { return differ_; }
  [[nodiscard]] std::int64_t first_difference_ns() const noexcept { return first_difference_ns_; }
  [[nodiscard]] double farthest_rad() const noexcept { return far_rad_; }

 private:
  static bool same(const JointSetpoint& a, const JointSetpoint& b) noexcept {
    const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
    return bits(a.q_rad) == bits(b.q_rad) && bits(a.dq_radps) == bits(b.dq_radps) &&
           bits(a.tau_ff_nm) == bits(b.tau_ff_nm) && bits(a.kp_nmprad) == bits(b.kp_nmprad) &&
           bits(a.kd_nmsprad) == bits(b.kd_nmsprad);
  }

  std::span<const TickInputs> ticks_;
  std::size_t next_ = 0;  // ticks before it have come
  std::size_t imu_tick_ = 0, imu_ = 0, joint_tick_ = 0, lio_tick_ = 0, compared_ = 0;
  bool silent_ = false;
  hal::JointBus* wires_ = nullptr;
  std::uint64_t frames_ = 0, differ_ = 0;
  std::int64_t first_difference_ns_ = -1;
  double far_rad_ = 0.0;
};

// Perception's port; on perception's thread. A picture that another one overtakes before it is acquired is lost.
class ReplayedCamera final : public hal::DepthCamera {
 public:
  explicit ReplayedCamera(const Recording& recording) : recording_(recording) {
    for (const TickInputs& tick : recording.ticks) {
      if (tick.has_picture == 0) continue;
      shots_.push_back({std::min(tick.now_ns, tick.picture_stamp_ns + kPictureLatency_ns), tick.picture_stamp_ns,
                        tick.picture_sequence});
    }
  }
  void advance(std::int64_t now_ns) noexcept {
    while (arrived_ < shots_.size() && shots_[arrived_].arrival_ns <= now_ns) ++arrived_;
  }
  [[nodiscard]] CameraIntrinsics intrinsics() const noexcept override { return recording_.intrinsics; }
  [[nodiscard]] bool try_acquire(DepthFrameView& frame) noexcept override {
    if (held_ || acquired_ == arrived_) return false;
    lost_ += arrived_ - 1 - acquired_;
    acquired_ = arrived_ - 1;
    const std::size_t at = acquired_ * recording_.picture_bytes();
    if (at + recording_.picture_bytes() > recording_.pictures.size()) return false;
    const Shot& shot = shots_[acquired_++];
    frame = {shot.stamp_ns, shot.sequence, recording_.intrinsics.width_px, recording_.intrinsics.height_px,
             reinterpret_cast<const std::uint16_t*>(recording_.pictures.data() + at)};
    held_ = true;
    return true;
  }
  void release() noexcept override { held_ = false; }
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_; }

 private:
  struct Shot {
    std::int64_t arrival_ns, stamp_ns;
    std::uint32_t sequence;
  };
  const Recording& recording_;
  std::vector<Shot> shots_;
  std::size_t arrived_ = 0, acquired_ = 0;
  std::uint64_t lost_ = 0;
  bool held_ = false;
};

}  // namespace polygmap::vm
