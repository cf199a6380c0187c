// SPDX-License-Identifier: Apache-2.0
// Buses that are as full as a cycle's reads can take: every drive's reply again and again, the feet's, and frames of
// nobody and of no sense. In memory, so that the module's own instructions are counted and no kernel's.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "firmware/config/bus_file.hpp"
#include "hal/can/can_joint_bus.hpp"

namespace polygmap::vm {

class BabblingChannel final : public hal::CanChannel {
 public:
  BabblingChannel() { frames_.reserve(2 * kJointCount + 2); }
  // What read() gives over and over: more than a cycle takes.
  [[nodiscard]] std::vector<hal::CanFrame>& frames() noexcept { return frames_; }
  [[nodiscard]] std::size_t read(std::span<hal::CanFrame> frames) noexcept override {
    if (frames_.empty()) return 0;
    for (hal::CanFrame& frame : frames) frame = frames_[next_++ % frames_.size()];
    return frames.size();
  }
  [[nodiscard]] std::size_t write(std::span<const hal::CanFrame> frames) noexcept override { return frames.size(); }
  [[nodiscard]] hal::CanChannelStatus status() const noexcept override { return {}; }

 private:
  std::vector<hal::CanFrame> frames_;
  std::size_t next_ = 0;
};

// Between the module and joints without buses: feedback comes as the frames of drives, commands go to both.
class BabblingBus final : public hal::JointBus {
 public:
  // joints outlives this.
  BabblingBus(const config::BusFile& file, hal::JointBus& joints)
      : file_(file), joints_(joints), channels_(file.buses.size()), wires_(file.table, pointers()) {}

  // Before each tick.
  void advance() {
    JointFeedback feedback;
    for (BabblingChannel& channel : channels_) channel.frames().clear();
    if (!joints_.try_read(feedback)) return;
    for (std::size_t bus = 0; bus < channels_.size(); ++bus) babble(bus, feedback, channels_[bus].frames());
  }
  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override { return wires_.try_read(feedback); }
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override {
    static_cast<void>(wires_.try_write(command));
    return joints_.try_write(command);
  }
  [[nodiscard]] hal::JointBusStatus status() const noexcept override { return wires_.status(); }

 private:
  [[nodiscard]] std::vector<hal::CanChannel*> pointers() {
    std::vector<hal::CanChannel*> all;
    for (BabblingChannel& channel : channels_) all.push_back(&channel);
    return all;
  }
  static hal::CanFrame frame_of(std::uint32_t id, std::span<const std::uint8_t> bytes) {
    hal::CanFrame frame;
    frame.id = id;
    frame.length = static_cast<std::uint8_t>(bytes.size());
    std::ranges::copy(bytes, frame.data.begin());
    return frame;
  }
  void babble(std::size_t bus, const JointFeedback& feedback, std::vector<hal::CanFrame>& frames) const {
    const hal::DriveTable& table = file_.table;
    for (std::size_t n = 0; n < kJointCount; ++n) {
      const hal::CanDrive& drive = table.drives[n];
      if (drive.bus != bus) continue;
      const auto i = static_cast<Eigen::Index>(n);
      hal::MitReply reply;
      reply.p_rad = feedback.q_rad[i];
      reply.v_radps = feedback.dq_radps[i];
      reply.t_nm = feedback.tau_nm[i];
      reply.status = drive.reply == hal::MitReplyRule::kStatusNibble ? 1 : 0;  // in motor mode
      const hal::MitBytes bytes = reply_frame(reply, drive.id, drive.ranges, drive.reply);
      frames.push_back(frame_of(drive.reply_id, bytes));
      frames.push_back(frame_of(drive.reply_id, std::span(bytes).first(5)));
    }
    if (table.feet.present && table.feet.bus == bus) {
      frames.push_back(frame_of(table.feet.id, hal::feet_frame(feedback.foot_force_n, table.feet.unit_n)));
    }
    const std::array<std::uint8_t, 8> nothing{};
    frames.push_back(frame_of(hal::kMaxCanId, nothing));
  }

  config::BusFile file_;
  hal::JointBus& joints_;
  std::vector<BabblingChannel> channels_;
  hal::CanJointBus wires_;
};

}  // namespace polygmap::vm
