// SPDX-License-Identifier: Apache-2.0
// How long a classic CAN frame is on the bus, in bits.
#pragma once

#include <cstddef>
#include <cstdint>

#include "hal/codec/can_frame.hpp"

namespace polygmap::hal {

// With the gap of three bits behind it. 11-bit identifiers.
inline constexpr std::size_t kCanFrameBits = 47;          // besides data and stuffing
inline constexpr std::size_t kCanStuffedHeaderBits = 34;  // of those, what is stuffed

// The longest that a frame of so many bytes can be: after the first five of equal bits, every fourth bit brings one
// more.
[[nodiscard]] constexpr std::size_t longest_frame_bits(std::size_t data_bytes) noexcept {
  const std::size_t stuffed = kCanStuffedHeaderBits + 8 * data_bytes;
  return kCanFrameBits + 8 * data_bytes + (stuffed - 1) / 4;
}

// As it is, its checksum and stuff bits counted.
[[nodiscard]] constexpr std::size_t frame_bits(const CanFrame& frame) noexcept {
  std::uint32_t crc = 0;
  std::size_t stuff = 0, run = 0;
  bool last = true;  // the bus is recessive before
  const auto send = [&](bool bit) {
    run = bit == last ? run + 1 : 1;
    last = bit;
    if (run < 5) return;
    ++stuff;
    last = !bit;
    run = 1;
  };
  const auto send_field = [&](std::uint32_t value, std::size_t bits) {
    for (std::size_t i = bits; i-- > 0;) {
      const bool bit = (value >> i & 1U) != 0;
      const bool carry = bit != ((crc >> 14U & 1U) != 0);
      crc = (crc << 1U & 0x7FFFU) ^ (carry ? 0x4599U : 0U);
      send(bit);
    }
  };
  const std::size_t data_bytes = frame.length > 8 ? 8 : frame.length;
  send_field(0, 1);                                       // start of frame
  send_field(frame.id & 0x7FFU, 11);                      // identifier
  send_field(0, 3);                                       // no remote request, 11-bit identifier, reserved
  send_field(static_cast<std::uint32_t>(data_bytes), 4);  // length
  for (std::size_t i = 0; i < data_bytes; ++i) send_field(frame.data[i], 8);
  const std::uint32_t sum = crc;
  for (std::size_t i = 15; i-- > 0;) send((sum >> i & 1U) != 0);
  return kCanFrameBits + 8 * data_bytes + stuff;
}

}  // namespace polygmap::hal
