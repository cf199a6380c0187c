// SPDX-License-Identifier: Apache-2.0
#include "hal/codec/lio_packet.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "tests/hal/codec/fuzz.hpp"
#include "tests/support/for_a_minute.hpp"

namespace polygmap::codec {
namespace lio_packet_test {  // files are compiled together
namespace {

using PacketBytes = std::array<std::uint8_t, kLioPacket_bytes>;

constexpr LioPacket kPacket{.sequence = 0x01020304,
                            .stamp_ns = 0x0102030405060708,
                            .position_m = {1.5, -2.25, 1e5},
                            .rotation_wxyz = {0.5, -0.5, 0.5, -0.5},
                            .position_sigma_m = {0.01, 0.02, 0.03},
                            .rotation_sigma_rad = {1e-3, 2e-3, 100.0}};

[[nodiscard]] constexpr PacketBytes bytes_of(const LioPacket& packet) {
  PacketBytes bytes{};
  encode(packet, bytes);
  return bytes;
}
// The same bytes with a CRC that fits them.
void seal(std::span<std::uint8_t> bytes) { store_le(bytes, 128, crc32(Bytes(bytes).first(128))); }

[[nodiscard]] constexpr bool round_trip() {
  LioPacket read;
  return decode(bytes_of(kPacket), read) == LioDecode::kGood && read == kPacket;
}
static_assert(round_trip(), "encode and decode are constant expressions");

TEST(Crc32, KnownText_IsThePublishedCheckValue) {
  const std::string text = "123456789";
  EXPECT_EQ(crc32(Bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size())), 0xCBF43926U);
  EXPECT_EQ(crc32({}), 0U);
}

TEST(LioPacket, Encode_Fields_LieWhereTheTableSays) {
  const PacketBytes bytes = bytes_of(kPacket);
  EXPECT_EQ(std::string(bytes.begin(), bytes.begin() + 4), "PLIO");
  EXPECT_EQ(bytes[4], 1);
  EXPECT_EQ(bytes[6], 132);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(bytes[8 + i], 4 - i);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(bytes[16 + i], 8 - i);
  EXPECT_EQ(bytes[31], 0x3F);  // 1.5 is 0x3FF8000000000000
  EXPECT_EQ(bytes[30], 0xF8);
}

TEST(LioPacket, Decode_EachDefect_IsNamedAndThePacketLeftAlone) {
  const auto verdict = [](const auto& change, std::size_t size = kLioPacket_bytes, bool sealed = true) {
    std::vector<std::uint8_t> bytes(std::max(size, kLioPacket_bytes));
    const PacketBytes good = bytes_of(kPacket);
    std::copy(good.begin(), good.end(), bytes.begin());
    change(bytes);
    if (sealed) seal(bytes);
    LioPacket packet{.sequence = 99};
    const LioDecode answer = decode(Bytes(bytes).first(size), packet);
    EXPECT_EQ(packet.sequence == 99, answer != LioDecode::kGood);
    return answer;
  };
  const auto nothing = [](auto&) {};
  EXPECT_EQ(verdict(nothing), LioDecode::kGood);
  for (const std::size_t size : {0U, 3U, 7U, 8U, 131U}) EXPECT_EQ(verdict(nothing, size), LioDecode::kShort) << size;
  EXPECT_EQ(verdict(nothing, 133), LioDecode::kLong);
  EXPECT_EQ(verdict([](auto& b) { b[3] = 'X'; }), LioDecode::kForeign);
  EXPECT_EQ(verdict([](auto& b) { b[3] = 'X'; }, 20), LioDecode::kForeign);
  EXPECT_EQ(verdict([](auto& b) { b[4] = 2; }), LioDecode::kWrongVersion);
  EXPECT_EQ(verdict([](auto& b) { b[6] = 131; }), LioDecode::kInvalid);
  for (std::size_t at = 8; at < kLioPacket_bytes; ++at) {
    EXPECT_EQ(verdict([at](auto& b) { b[at] ^= 0x20; }, kLioPacket_bytes, false), LioDecode::kCorrupted) << at;
  }
  const auto with = [&](std::size_t at, double value) { return verdict([=](auto& b) { store_f64(b, at, value); }); };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinite = std::numeric_limits<double>::infinity();
  for (std::size_t at = 24; at < 128; at += 8) {
    for (const double bad : {kNan, kInfinite, -kInfinite, 1e300}) EXPECT_EQ(with(at, bad), LioDecode::kInvalid) << at;
  }
  EXPECT_EQ(with(24, 1.01e5), LioDecode::kInvalid);
  EXPECT_EQ(with(48, 0.52), LioDecode::kInvalid) << "no unit quaternion";
  EXPECT_EQ(with(80, 0.0), LioDecode::kInvalid) << "a sigma is above 0";
  EXPECT_EQ(with(104, -1.0), LioDecode::kInvalid);
  EXPECT_EQ(verdict([](auto& b) { b[23] = 0x80; }), LioDecode::kInvalid) << "a negative stamp";
}

void fuzz_decode(int runs, unsigned seed) {
  int good = 0;
  test::fuzz(bytes_of(kPacket), runs, seed, [&good, seed](Bytes bytes) {
    std::vector<std::uint8_t> sealed(bytes.begin(), bytes.end());
    if (sealed.size() == kLioPacket_bytes && seed % 2 == 0) seal(sealed);  // behind the CRC, too
    LioPacket packet;
    if (decode(sealed, packet) != LioDecode::kGood) return;
    ++good;
    PacketBytes again{};
    encode(packet, again);
    LioPacket twice;
    ASSERT_EQ(decode(again, twice), LioDecode::kGood);
    ASSERT_EQ(packet, twice);
    for (const double x : packet.position_m) ASSERT_TRUE(std::isfinite(x));
  });
  EXPECT_GT(good, 0);
}
TEST(LioPacket, Decode_AnyBytes_GivesGoodValuesOrARefusal) {
  fuzz_decode(100'000, 1);
  fuzz_decode(100'000, 2);
}
TEST(LongFuzzLioPacket, Decode_AnyBytes_GivesGoodValuesOrARefusal) {
  test::for_a_minute(3, [](unsigned seed) { fuzz_decode(1'000'000, seed); });
}

}  // namespace
}  // namespace lio_packet_test
}  // namespace polygmap::codec
