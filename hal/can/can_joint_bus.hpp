// SPDX-License-Identifier: Apache-2.0
// The joints behind CAN buses of MIT drives: one frame out and one in per drive and cycle. The simulation's bus and a
// robot's sockets run this same code.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "hal/can/drive_table.hpp"
#include "hal/ports/can_channel.hpp"
#include "hal/ports/joint_bus.hpp"

namespace polygmap::hal {

// Replies answer the last command: they get its stamp, and no clock is read. A drive that has never answered is sent
// the frame that enters motor mode and the command in turn; from its first answer on it is sent commands only.
class CanJointBus final : public JointBus {
 public:
  // channels: one for each bus of the table, in its order; they outlive this. Buses without one are silent.
  CanJointBus(const DriveTable& table, std::span<CanChannel* const> channels) noexcept;
  CanJointBus(const CanJointBus&) = delete;
  CanJointBus& operator=(const CanJointBus&) = delete;

  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override;
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override;
  [[nodiscard]] JointBusStatus status() const noexcept override;

  // Instead of a command to every drive: which were taken. kExit lets go of the joints; kZero moves their zero for
  // good.
  [[nodiscard]] JointSet send_to_all(MitSpecial special) noexcept;
  // Drives that have answered since the start.
  [[nodiscard]] JointSet heard() const noexcept { return heard_; }

 private:
  // The feet's forces hold for so long.
  static constexpr std::int64_t kFeetHold_ns = 5 * kBusCycle_ns;
  // Of one bus in one call: a backlog is worked off, a babbling node is not followed.
  static constexpr std::size_t kMaxFramesPerRead = 64;
  using JointFrames = std::array<MitBytes, kJointCount>;

  void take(std::size_t bus, const CanFrame& frame) noexcept;
  void take_feet(const CanFrame& frame) noexcept;
  void take_reply(std::size_t joint, const CanFrame& frame) noexcept;
  void count_bus_offs() noexcept;
  // joints: whose frame is to be sent.
  [[nodiscard]] JointSet send(const JointFrames& frames, JointSet joints) noexcept;

  DriveTable table_;
  std::array<CanChannel*, kMaxBuses> channels_{};
  JointFeedback feedback_;
  std::array<std::int64_t, kJointCount> replied_ns_{};  // stamp of the command that a joint's last reply answered
  JointSet heard_, replied_;                            // ever; since the last read
  std::int64_t command_ns_ = -1;                        // stamp of the last command; negative: none yet
  std::int64_t feet_ns_ = -1;                           // stamp of the command before the feet's last frame
  std::uint32_t writes_ = 0;
  std::array<bool, kMaxBuses> was_off_{};
  JointBusStatus status_;
};

}  // namespace polygmap::hal
