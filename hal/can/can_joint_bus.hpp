// SPDX-License-Identifier: Apache-2.0
// The joints behind CAN buses of MIT drives: one frame out and one in per drive and cycle. The simulation's bus and a
// robot's sockets run this same code.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "algorithms/core/containers/static_vector.hpp"
#include "hal/can/drive_table.hpp"
#include "hal/ports/can_channel.hpp"
#include "hal/ports/joint_bus.hpp"

namespace polygmap::hal {

// Replies answer the last command: they get its stamp, and no clock is read. A reply with a stamp of its own, in the
// clock of the commands, that lies kStale_ns before that command has waited in a queue: it is counted and left out.
//
// A drive that has never answered is sent the frame that enters motor mode and the command in turn; from its first
// answer on it is sent commands. One that was silent for longer than kSilent_ns may have restarted, and is out of motor
// mode then: it is sent that frame once in kEnterPeriod writes, and while it answers again in turn with the command
// until an answer to that frame has come. While it tells of an error, the frame that clears errors goes first, where
// its dialect has one, and no oftener. So is a drive that tells of an error while its commands ask for nothing, since
// the module arms: it may have been so since before the start. One that carries is not brought back in mid-step.
class CanJointBus final : public JointBus {
 public:
  // channels: one for each bus of the table, in its order; they outlive this. Buses without one are silent.
  CanJointBus(const DriveTable& table, std::span<CanChannel* const> channels) noexcept;
  CanJointBus(const CanJointBus&) = delete;
  CanJointBus& operator=(const CanJointBus&) = delete;

  [[nodiscard]] bool try_read(JointFeedback& feedback) noexcept override;
  [[nodiscard]] JointSet try_write(const JointCommand& command) noexcept override;
  [[nodiscard]] JointBusStatus status() const noexcept override;

  // Drives that have answered since the start.
  [[nodiscard]] JointSet heard() const noexcept { return heard_; }

 private:
  // Drives and the feet's board are silent after so long; until then the feet's forces hold.
  static constexpr std::int64_t kSilent_ns = 5 * kBusCycle_ns;
  static constexpr std::int64_t kStale_ns = 2 * kBusCycle_ns;
  static constexpr std::uint32_t kEnterPeriod = 50;  // even
  // Of one bus in one call: a backlog is worked off, a babbling node is not followed.
  static constexpr std::size_t kMaxFramesPerRead = 64;
  using JointFrames = std::array<MitBytes, kJointCount>;
  struct Bus {
    CanChannel* channel = nullptr;
    StaticVector<std::uint8_t, kJointCount> joints;  // whose drives are on it
    bool was_off = false;
  };

  void take(std::size_t bus, const CanFrame& frame) noexcept;
  void take_feet(const CanFrame& frame) noexcept;
  void take_reply(std::size_t joint, const CanFrame& frame) noexcept;
  void count_bus_offs() noexcept;
  void note_feet_silent() noexcept;
  // Drives that have been silent for too long when the next command is made.
  void note_lapsed() noexcept;
  // A drive in error that nothing is asked of is brought back as one that lapsed.
  void note_error(std::size_t joint, const JointSetpoint& command) noexcept;
  // A lapsed drive answered: whether its reply counts, or it says that it is out of motor mode.
  [[nodiscard]] bool try_take_back(std::size_t joint, const MitReply& reply) noexcept;
  // In the stead of a joint's command, none when it gets the command; write: how many went before.
  [[nodiscard]] std::optional<MitSpecial> special_due(std::size_t joint, std::uint32_t write) const noexcept;
  // joints: whose frame is to be sent.
  [[nodiscard]] JointSet send(const JointFrames& frames, JointSet joints) noexcept;

  DriveTable table_;
  std::array<Bus, kMaxBuses> buses_{};
  JointFeedback feedback_;
  std::array<std::int64_t, kJointCount> replied_ns_{};  // stamp of the command that a joint's last reply answered
  JointSet heard_, replied_;                            // ever; since the last read
  JointSet lapsed_;    // heard once, silent for too long or in error since (note_error), not yet entered again
  JointSet returned_;  // of those, the ones that have answered since the last write
  JointSet entered_;   // sent the frame that enters motor mode by the last write
  std::int64_t command_ns_ = -1;  // stamp of the last command; negative: none yet
  std::int64_t feet_ns_ = -1;     // stamp of the command before the feet's last frame
  std::uint32_t writes_ = 0;
  JointBusStatus status_;
  // Buffers of one call each; kept, since clearing them in each call is work without a use.
  std::array<CanFrame, 16> read_frames_{};
  std::array<CanFrame, kJointCount> queue_{};
};

}  // namespace polygmap::hal
