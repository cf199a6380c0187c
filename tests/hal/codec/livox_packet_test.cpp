// SPDX-License-Identifier: Apache-2.0
#include "hal/codec/livox_packet.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/hal/codec/fuzz.hpp"
#include "tests/support/for_a_minute.hpp"

namespace polygmap::codec {
namespace livox_packet_test {  // files are compiled together
namespace {

using PacketBytes = std::array<std::uint8_t, kLivoxImuPacket_bytes>;

constexpr LivoxImuPacket kPacket{.udp_count = 0x0102,
                                 .time = LivoxTime::kPtp,
                                 .stamp_ns = 0x0102030405060708,
                                 .gyro_radps = {0.25F, -0.5F, 1.0F},
                                 .accel_mps2 = {0.0F, kStandardGravity_mps2, -2.0F * kStandardGravity_mps2}};

[[nodiscard]] constexpr PacketBytes bytes_of(const LivoxImuPacket& packet) {
  PacketBytes bytes{};
  encode(packet, bytes);
  return bytes;
}
void seal(std::span<std::uint8_t> bytes) { store_le(bytes, 24, crc32(Bytes(bytes).subspan(28))); }

[[nodiscard]] constexpr bool round_trip() {
  LivoxImuPacket read;
  return decode(bytes_of(kPacket), true, read) == LivoxDecode::kGood && read == kPacket;
}
static_assert(round_trip(), "encode and decode are constant expressions");

TEST(LivoxPacket, Encode_Fields_LieWhereTheTableSays) {
  const PacketBytes bytes = bytes_of(kPacket);
  EXPECT_EQ(bytes[0], 0);
  EXPECT_EQ(bytes[1], 60);
  EXPECT_EQ(bytes[5], 1);
  EXPECT_EQ(bytes[7], 2);
  EXPECT_EQ(bytes[8], 1);
  EXPECT_EQ(bytes[10], 0);
  EXPECT_EQ(bytes[11], 1);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(bytes[28 + i], 8 - i);
  EXPECT_EQ(load_f32(bytes, 36), 0.25F);
  EXPECT_EQ(load_f32(bytes, 52), 1.0F) << "acceleration is in standard gravity";
}

TEST(LivoxPacket, Decode_EachDefect_IsNamedAndThePacketLeftAlone) {
  const auto verdict = [](const auto& change, std::size_t size = kLivoxImuPacket_bytes, bool sealed = true,
                          bool check_crc = true) {
    std::vector<std::uint8_t> bytes(kLivoxImuPacket_bytes);
    const PacketBytes good = bytes_of(kPacket);
    std::copy(good.begin(), good.end(), bytes.begin());
    change(bytes);
    if (sealed) seal(bytes);
    bytes.resize(size);
    LivoxImuPacket packet{.udp_count = 99};
    const LivoxDecode answer = decode(bytes, check_crc, packet);
    EXPECT_EQ(packet.udp_count == 99, answer != LivoxDecode::kGood);
    return answer;
  };
  const auto nothing = [](auto&) {};
  EXPECT_EQ(verdict(nothing), LivoxDecode::kGood);
  for (const std::size_t size : {0U, 35U, 36U, 59U}) EXPECT_EQ(verdict(nothing, size), LivoxDecode::kShort) << size;
  EXPECT_EQ(verdict(nothing, 61), LivoxDecode::kLong);
  EXPECT_EQ(verdict([](auto& b) { b[0] = 1; }), LivoxDecode::kForeign);
  EXPECT_EQ(verdict([](auto& b) { b[10] = 1; }, 36 + 96), LivoxDecode::kForeign) << "points";
  EXPECT_EQ(verdict([](auto& b) { b[1] = 59; }), LivoxDecode::kInvalid);
  EXPECT_EQ(verdict([](auto& b) { b[5] = 2; }), LivoxDecode::kInvalid);
  EXPECT_EQ(verdict([](auto& b) { b[11] = 3; }), LivoxDecode::kInvalid);
  EXPECT_EQ(verdict([](auto& b) { b[35] = 0x40; }), LivoxDecode::kInvalid) << "a stamp of 2^62";
  for (std::size_t at = 24; at < kLivoxImuPacket_bytes; ++at) {
    EXPECT_EQ(verdict([at](auto& b) { b[at] ^= 1; }, 60, false), LivoxDecode::kCorrupted) << at;
  }
  EXPECT_EQ(verdict([](auto& b) { b[24] ^= 1; }, 60, false, false), LivoxDecode::kGood);
  for (std::size_t at = 36; at < 60; at += 4) {
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 3e38F, -101.0F}) {
      EXPECT_EQ(verdict([=](auto& b) { store_f32(b, at, bad); }), LivoxDecode::kInvalid) << at << " " << bad;
    }
  }
}

void fuzz_decode(int runs, unsigned seed) {
  int good = 0;
  test::fuzz(bytes_of(kPacket), runs, seed, [&good, seed](Bytes bytes) {
    LivoxImuPacket packet;
    if (decode(bytes, seed % 2 == 1, packet) != LivoxDecode::kGood) return;
    ++good;
    for (std::size_t i = 0; i < 3; ++i) {
      ASSERT_LE(std::abs(packet.gyro_radps[i]), 100.0F);
      ASSERT_LE(std::abs(packet.accel_mps2[i]), 500.1F);
    }
    ASSERT_GE(packet.stamp_ns, 0);
  });
  EXPECT_GT(good, 0);
}
TEST(LivoxPacket, Decode_AnyBytes_GivesGoodValuesOrARefusal) {
  fuzz_decode(100'000, 1);
  fuzz_decode(100'000, 2);
}
TEST(LongFuzzLivoxPacket, Decode_AnyBytes_GivesGoodValuesOrARefusal) {
  test::for_a_minute(3, [](unsigned seed) { fuzz_decode(1'000'000, seed); });
}

}  // namespace
}  // namespace livox_packet_test
}  // namespace polygmap::codec
