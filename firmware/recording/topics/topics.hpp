// SPDX-License-Identifier: Apache-2.0
// What records say, as the messages that common tools read. The recorder writes them, and a replay makes them once more
// to see that nobody changed one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/recording/mcap/cdr.hpp"
#include "firmware/recording/stream/row_outputs.hpp"
#include "firmware/recording/topics/schemas.hpp"

namespace polygmap::recording {

class MessageSink {
 public:
  // A message of so many bytes, valid during the call.
  virtual void take(Topic topic, std::int64_t log_ns, std::int64_t publish_ns,
                    std::span<const std::byte> message) noexcept = 0;

 protected:
  ~MessageSink() = default;
};

class Topics {
 public:
  // Where the camera sits, by the parameters: before the first record.
  void set_camera(const Transform& base_T_camera) noexcept { base_T_camera_ = base_T_camera; }
  // The messages of a record, in a fixed order. log_ns: of the frame that has it. Pictures are not among them.
  void write(const Record& record, MessageSink& sink) noexcept;
  // Before each picture: an Image up to its pixels, whose bytes follow.
  [[nodiscard]] std::span<const std::byte> image_head(const DepthFrameView& frame) noexcept;
  [[nodiscard]] std::span<const std::byte> camera_info(const CameraIntrinsics& camera, std::int64_t stamp_ns) noexcept;
  // Messages that were longer than there is memory for.
  [[nodiscard]] std::uint32_t too_long() const noexcept { return too_long_; }

 private:
  void write_row(const RowCall& row, MessageSink& sink) noexcept;
  void write_call(const PortCall& call, MessageSink& sink) noexcept;
  void write_outputs(const RowCall& row, MessageSink& sink) noexcept;
  void write_imu(const ImuSample& imu) noexcept;
  void write_joints(const JointFeedback& joints) noexcept;
  void write_foot(const JointFeedback& joints, Foot foot) noexcept;
  void write_lio(const LioSample& lio) noexcept;
  void write_command(const JointCommand& command) noexcept;
  void write_gains(const JointCommand& command) noexcept;
  void write_odometry() noexcept;
  void write_transforms() noexcept;
  void write_gait() noexcept;
  void write_faults(const HealthCounts& counts, std::int64_t now_ns) noexcept;
  void write_frame(std::uint8_t lane, const CycleReport& cycle) noexcept;
  void write_surfaces() noexcept;
  void write_map() noexcept;
  void write_footholds(std::int64_t now_ns) noexcept;
  void send(Topic topic, std::int64_t publish_ns, MessageSink& sink) noexcept;

  // Of 64 surfaces with their outlines.
  static constexpr std::size_t kMemory_bytes = 192U * 1024U;
  std::array<std::byte, kMemory_bytes> memory_;
  mcap::CdrWriter out_{memory_};
  Transform base_T_camera_;
  std::int64_t log_ns_ = 0;
  std::uint32_t too_long_ = 0;
  RowOutputs outputs_;
  std::array<std::int32_t, kTasks.size()> units_spent_{};
  std::uint32_t transform_skip_ = 0;
};

}  // namespace polygmap::recording
