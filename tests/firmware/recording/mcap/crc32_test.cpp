// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/mcap/crc32.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string_view>
#include <vector>

namespace polygmap::mcap {
namespace {

std::uint32_t crc_of(std::string_view text) { return Crc32::of(std::as_bytes(std::span(text))); }

TEST(Crc32, KnownTexts_HaveTheirPublishedValues) {
  EXPECT_EQ(crc_of(""), 0U);
  EXPECT_EQ(crc_of("a"), 0xE8B7BE43U);
  EXPECT_EQ(crc_of("123456789"), 0xCBF43926U);
  EXPECT_EQ(crc_of("The quick brown fox jumps over the lazy dog"), 0x414FA339U);
}

// Bit by bit, as the polynomial says it.
std::uint32_t plain_crc(std::span<const std::byte> bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const std::byte byte : bytes) {
    crc ^= static_cast<std::uint32_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~crc;
}

TEST(Crc32, AnyBytesInAnyPieces_AreAsBitByBit) {
  std::mt19937 random(1);
  for (int run = 0; run < 300; ++run) {
    std::vector<std::byte> bytes(random() % 200);
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
    Crc32 crc;
    for (std::span<const std::byte> left = bytes; !left.empty();) {
      const std::size_t piece = 1 + random() % left.size();
      crc.add(left.first(piece));
      left = left.subspan(piece);
    }
    ASSERT_EQ(crc.value(), plain_crc(bytes)) << bytes.size();
  }
}

}  // namespace
}  // namespace polygmap::mcap
