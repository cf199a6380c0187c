// SPDX-License-Identifier: Apache-2.0
// CRC-32 of IEEE 802.3, zlib and PNG: polynomial 0x04C11DB7 reflected, initial value and final inversion 0xFFFFFFFF.
#pragma once

#include <array>
#include <cstdint>

#include "hal/codec/byte_order.hpp"

namespace polygmap::codec {

namespace detail {
[[nodiscard]] consteval std::array<std::uint32_t, 256> crc32_table() noexcept {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? (crc >> 1) ^ 0xEDB88320U : crc >> 1;
    table[byte] = crc;
  }
  return table;
}
inline constexpr std::array<std::uint32_t, 256> kCrc32Table = crc32_table();
}  // namespace detail

[[nodiscard]] constexpr std::uint32_t crc32(Bytes bytes) noexcept {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const std::uint8_t byte : bytes) crc = (crc >> 8) ^ detail::kCrc32Table[(crc ^ byte) & 0xFFU];
  return ~crc;
}

}  // namespace polygmap::codec
