// SPDX-License-Identifier: Apache-2.0
// CRC-32 as MCAP, zip and Ethernet have it (reflected 0x04C11DB7), eight bytes at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace polygmap::mcap {

class Crc32 {
 public:
  void add(std::span<const std::byte> bytes) noexcept {
    while (bytes.size() >= 8) {
      std::uint32_t low = 0, high = 0;
      std::memcpy(&low, bytes.data(), 4);
      std::memcpy(&high, bytes.data() + 4, 4);
      low ^= state_;
      state_ = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        state_ ^= kTables[7 - i][(low >> (8 * i)) & 0xFFU] ^ kTables[3 - i][(high >> (8 * i)) & 0xFFU];
      }
      bytes = bytes.subspan(8);
    }
    for (const std::byte byte : bytes) {
      state_ = kTables[0][(state_ ^ static_cast<std::uint32_t>(byte)) & 0xFFU] ^ (state_ >> 8U);
    }
  }
  [[nodiscard]] std::uint32_t value() const noexcept { return ~state_; }
  [[nodiscard]] static std::uint32_t of(std::span<const std::byte> bytes) noexcept {
    Crc32 crc;
    crc.add(bytes);
    return crc.value();
  }

 private:
  // Table n: what a byte adds that has n more bytes behind it.
  static constexpr auto kTables = [] {
    std::array<std::array<std::uint32_t, 256>, 8> tables{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      std::uint32_t crc = i;
      for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
      tables[0][i] = crc;
    }
    for (std::size_t n = 1; n < tables.size(); ++n) {
      for (std::size_t i = 0; i < 256; ++i) {
        const std::uint32_t before = tables[n - 1][i];
        tables[n][i] = tables[0][before & 0xFFU] ^ (before >> 8U);
      }
    }
    return tables;
  }();

  std::uint32_t state_ = 0xFFFFFFFFU;
};

}  // namespace polygmap::mcap
