// SPDX-License-Identifier: Apache-2.0
#include "firmware/recording/mcap/cdr.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "firmware/recording/mcap/cdr_parts.hpp"

namespace polygmap::mcap {
namespace {

std::string hex_of(std::span<const std::byte> bytes) {
  std::string text;
  for (const std::byte byte : bytes) {
    std::array<char, 4> pair{};
    std::snprintf(pair.data(), pair.size(), "%02x", static_cast<unsigned>(byte));
    text += pair.data();
  }
  return text;
}

// As XCDR1 has it: each number at a multiple of its size, counted from behind the four bytes of the encoding.
TEST(CdrWriter, NumbersAfterSmallerOnes_AreAligned) {
  std::array<std::byte, 100> memory{};
  CdrWriter out(memory);
  out.put(std::uint8_t{1});
  out.put(std::uint16_t{2});
  out.put(std::uint8_t{3});
  out.put(std::uint32_t{4});
  out.put(std::uint8_t{5});
  out.put(1.0);
  EXPECT_EQ(hex_of(out.bytes()),
            "00010000"
            "0100"
            "0200"
            "03000000"
            "04000000"
            "05000000"
            "000000000000f03f");
}

TEST(CdrWriter, TextsAndLists_HaveTheirLengthsBefore) {
  std::array<std::byte, 100> memory{};
  CdrWriter out(memory);
  out.put_text("ab");
  out.put_text("");
  const std::array<std::byte, 3> bytes{std::byte{7}, std::byte{8}, std::byte{9}};
  out.put_bytes(bytes);
  out.put_count(0);
  EXPECT_EQ(hex_of(out.bytes()),
            "00010000"
            "03000000"
            "616200"
            "00"
            "01000000"
            "00"
            "000000"
            "03000000"
            "070809"
            "00"
            "00000000");
}

TEST(CdrWriter, MoreThanItsMemory_IsFullAndWritesNotPastIt) {
  std::array<std::byte, 13> memory{};
  memory.back() = std::byte{0xEE};
  CdrWriter out(std::span<std::byte>(memory).first(12));
  out.put(std::uint8_t{1});
  EXPECT_FALSE(out.full());
  out.put(2.0);
  EXPECT_TRUE(out.full());
  EXPECT_EQ(memory.back(), std::byte{0xEE});
}

TEST(CdrReader, WhatTheWriterWrote_ComesBack) {
  std::array<std::byte, 200> memory{};
  CdrWriter out(memory);
  out.put(true);
  out.put_text("left_knee");
  out.put(std::int64_t{-5});
  const std::array<std::byte, 2> bytes{std::byte{1}, std::byte{2}};
  out.put_bytes(bytes);
  out.put(0.25);
  CdrReader in(out.bytes());
  EXPECT_TRUE(in.get<bool>());
  EXPECT_EQ(in.get_text(), "left_knee");
  EXPECT_EQ(in.get<std::int64_t>(), -5);
  EXPECT_EQ(in.get_bytes().size(), 2U);
  EXPECT_EQ(in.get<double>(), 0.25);
  EXPECT_FALSE(in.failed());
  (void)in.get<std::uint8_t>();
  EXPECT_TRUE(in.failed()) << "there is no more";
}

TEST(CdrReader, BytesThatAreNone_Fail) {
  const auto fails = [](std::initializer_list<int> bytes, auto&& read) {
    std::vector<std::byte> message;
    for (const int byte : bytes) message.push_back(static_cast<std::byte>(byte));
    CdrReader in(message);
    read(in);
    return in.failed();
  };
  const auto nothing = [](CdrReader&) {};
  EXPECT_TRUE(fails({}, nothing));
  EXPECT_TRUE(fails({0, 1, 0}, nothing));
  EXPECT_TRUE(fails({0, 0, 0, 0}, nothing)) << "big-endian";
  EXPECT_FALSE(fails({0, 1, 0, 0}, nothing));
  const auto text = [](CdrReader& in) { (void)in.get_text(); };
  EXPECT_FALSE(fails({0, 1, 0, 0, 2, 0, 0, 0, 'a', 0}, text));
  EXPECT_TRUE(fails({0, 1, 0, 0, 2, 0, 0, 0, 'a', 'b'}, text)) << "a text without its end";
  const auto filled = [](CdrReader& in) { (void)in.get<std::uint8_t>(), (void)in.get<std::uint16_t>(); };
  EXPECT_FALSE(fails({0, 1, 0, 0, 7, 0, 7, 0}, filled));
  EXPECT_TRUE(fails({0, 1, 0, 0, 7, 1, 7, 0}, filled));
  EXPECT_TRUE(fails({0, 1, 0, 0, 0, 0, 0, 0}, text)) << "not even its end";
  EXPECT_TRUE(fails({0, 1, 0, 0, 9, 0, 0, 0, 65, 0}, text)) << "longer than the message";
  EXPECT_TRUE(fails({0, 1, 0, 0, 255, 255, 255, 255, 65, 0}, text));
  EXPECT_TRUE(fails({0, 1, 0, 0, 3, 0, 0, 0, 1, 2}, [](CdrReader& in) { (void)in.get_count(8); }));
}

TEST(CdrParts, Stamp_IsSecondsAndNanoseconds) {
  std::array<std::byte, 100> memory{};
  CdrWriter out(memory);
  put_stamp(out, 3'000'000'007);
  EXPECT_EQ(hex_of(out.bytes()),
            "00010000"
            "03000000"
            "07000000");
}

TEST(CdrParts, Rotation_IsAQuaternionWithItsScalarLast) {
  std::array<std::byte, 100> memory{};
  CdrWriter out(memory);
  put_rotation(out, Eigen::AngleAxisd(0.5 * kPi, Vec3::UnitZ()).toRotationMatrix());
  CdrReader in(out.bytes());
  EXPECT_EQ(in.get<double>(), 0.0);
  EXPECT_EQ(in.get<double>(), 0.0);
  EXPECT_NEAR(in.get<double>(), std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(in.get<double>(), std::sqrt(0.5), 1e-15);
}

}  // namespace
}  // namespace polygmap::mcap
