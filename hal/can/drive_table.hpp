// SPDX-License-Identifier: Apache-2.0
// Which drive moves which joint: its bus, its identifiers, its ranges. Read from a bus file before the start.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "hal/codec/can_bits.hpp"
#include "hal/codec/mit_codec.hpp"

namespace polygmap::hal {

inline constexpr std::size_t kMaxBuses = 8;
inline constexpr std::uint32_t kMaxCanId = 0x7FF;
// Of the time of a bus, with every frame at its longest: what is left takes repetitions and error frames.
inline constexpr double kMaxBusLoad = 0.6;

struct CanDrive {
  std::uint8_t bus = 0;
  std::uint16_t id = 0;        // of its commands
  std::uint16_t reply_id = 0;  // of the frames it sends
  MitReplyRule reply = MitReplyRule::kId;
  MitRanges ranges;
};

struct CanFeet {
  bool present = false;  // else nothing senses the feet's forces
  std::uint8_t bus = 0;
  std::uint16_t id = 0;
  double unit_n = 0.0;
};

struct DriveTable {
  std::array<CanDrive, kJointCount> drives{};  // in the order of joint_index()
  CanFeet feet;
  std::uint32_t bitrate_bps = 1'000'000;
  std::uint8_t bus_count = 0;
};

// Share of the bus's time that a cycle's frames take at their longest.
[[nodiscard]] constexpr double bus_load(const DriveTable& table, std::size_t bus) noexcept {
  constexpr std::size_t kCommandAndReply_bits = longest_frame_bits(8) + longest_frame_bits(8);
  std::size_t bits = 0;
  for (const CanDrive& drive : table.drives) bits += drive.bus == bus ? kCommandAndReply_bits : 0;
  if (table.feet.present && table.feet.bus == bus) bits += longest_frame_bits(kFootFrame_bytes);
  return static_cast<double>(bits) / (table.bitrate_bps * seconds(kBusCycle_ns));
}
static_assert(longest_frame_bits(8) == 135);

}  // namespace polygmap::hal
