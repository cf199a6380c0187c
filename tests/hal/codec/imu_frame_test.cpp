// SPDX-License-Identifier: Apache-2.0
#include "hal/codec/imu_frame.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/hal/codec/fuzz.hpp"
#include "tests/support/for_a_minute.hpp"

namespace polygmap::codec {
namespace imu_frame_test {  // files are compiled together
namespace {

using FrameBytes = std::array<std::uint8_t, kImuFrame_bytes>;

constexpr ImuFrame kFrame{.sequence = 0x01020304,
                          .stamp_ns = 0x0102030405060708,
                          .gyro_radps = {0.25F, -0.5F, 100.0F},
                          .accel_mps2 = {0.0F, 9.81F, -500.0F}};

[[nodiscard]] constexpr FrameBytes bytes_of(const ImuFrame& frame) {
  FrameBytes bytes{};
  encode(frame, bytes);
  return bytes;
}
[[nodiscard]] std::vector<ImuFrame> frames_in(ImuFrameFinder& finder, Bytes bytes) {
  std::vector<ImuFrame> frames;
  for (const std::uint8_t byte : bytes) {
    ImuFrame frame;
    if (finder.push(byte, frame)) frames.push_back(frame);
  }
  return frames;
}

[[nodiscard]] constexpr bool round_trip() {
  ImuFrameFinder finder;
  ImuFrame read;
  bool found = false;
  for (const std::uint8_t byte : bytes_of(kFrame)) found = finder.push(byte, read);
  return found && read == kFrame;
}
static_assert(round_trip(), "encoding and finding are constant expressions");

TEST(ImuFrame, Encode_Fields_LieWhereTheTableSays) {
  const FrameBytes bytes = bytes_of(kFrame);
  EXPECT_EQ(bytes[0], 0xA5);
  EXPECT_EQ(bytes[1], 0x5A);
  EXPECT_EQ(bytes[2], 1);
  EXPECT_EQ(bytes[3], 44);
  EXPECT_EQ(bytes[4], 4);
  EXPECT_EQ(bytes[8], 8);
  EXPECT_EQ(load_f32(bytes, 16), 0.25F);
  EXPECT_EQ(load_f32(bytes, 32), 9.81F);
}

TEST(ImuFrameFinder, Push_FrameCutAnywhere_TheNextOneIsFound) {
  for (std::size_t cut = 0; cut < kImuFrame_bytes; ++cut) {
    ImuFrameFinder finder;
    std::vector<std::uint8_t> stream;
    const FrameBytes first = bytes_of({.sequence = 1}), second = bytes_of({.sequence = 2});
    stream.insert(stream.end(), first.begin(), first.begin() + static_cast<std::ptrdiff_t>(cut));
    stream.insert(stream.end(), second.begin(), second.end());
    const auto frames = frames_in(finder, stream);
    ASSERT_EQ(frames.size(), 1U) << cut;
    EXPECT_EQ(frames[0].sequence, 2U);
    EXPECT_EQ(finder.counters().garbage_bytes, cut);
  }
}

TEST(ImuFrameFinder, Push_BitFlippedAnywhere_OnlyThatFrameIsLost) {
  const FrameBytes good = bytes_of(kFrame);
  for (std::size_t bit = 0; bit < 8 * kImuFrame_bytes; ++bit) {
    ImuFrameFinder finder;
    std::vector<std::uint8_t> stream;
    for (int i = 0; i < 3; ++i) stream.insert(stream.end(), good.begin(), good.end());
    stream[kImuFrame_bytes + bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    EXPECT_EQ(frames_in(finder, stream).size(), 2U) << bit;
    EXPECT_EQ(finder.counters().garbage_bytes, kImuFrame_bytes) << bit;
  }
}

TEST(ImuFrameFinder, Push_ValuesOutOfRange_CountedAsInvalid) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 501.0F}) {
    ImuFrameFinder finder;
    ImuFrame frame = kFrame;
    frame.accel_mps2[1] = bad;
    EXPECT_TRUE(frames_in(finder, bytes_of(frame)).empty());
    EXPECT_EQ(finder.counters().invalid, 1U);
    EXPECT_EQ(finder.counters().corrupted, 0U);
  }
}

void fuzz_stream(int runs, unsigned seed) {
  ImuFrameFinder finder;
  std::uint64_t bytes_pushed = 0, found = 0;
  test::fuzz(bytes_of(kFrame), runs, seed, [&](Bytes bytes) {
    bytes_pushed += bytes.size();
    for (const ImuFrame& frame : frames_in(finder, bytes)) {
      ++found;
      for (std::size_t i = 0; i < 3; ++i) {
        ASSERT_LE(std::abs(frame.gyro_radps[i]), 100.0F);
        ASSERT_LE(std::abs(frame.accel_mps2[i]), 500.0F);
      }
    }
  });
  EXPECT_GT(found, static_cast<std::uint64_t>(runs) / 10);
  const std::uint64_t whole = kImuFrame_bytes * (found + finder.counters().invalid);
  EXPECT_LT(bytes_pushed - whole - finder.counters().garbage_bytes, kImuFrame_bytes) << "every byte is accounted for";
}
TEST(ImuFrameFinder, Push_AnyBytes_GivesGoodValuesAndAccountsForEach) { fuzz_stream(100'000, 1); }
TEST(LongFuzzImuFrameFinder, Push_AnyBytes_GivesGoodValuesAndAccountsForEach) {
  test::for_a_minute(2, [](unsigned seed) { fuzz_stream(1'000'000, seed); });
}

}  // namespace
}  // namespace imu_frame_test
}  // namespace polygmap::codec
