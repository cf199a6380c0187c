// SPDX-License-Identifier: Apache-2.0
// What every implementation of hal::CanChannel must do (port_contract.hpp says how an implementation takes part).
//
//   hal::CanChannel& port();
//   void arrive(const hal::CanFrame&);        // another node of the bus sends this
//   std::vector<hal::CanFrame> sent();        // what reached the bus since the last call
//   optional const char* absent(), void refuse_after(std::size_t frames): the queue has room for so many more
//   optional static constexpr bool kFd = true: the bus carries CAN FD
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "hal/ports/can_channel.hpp"

namespace polygmap::contract {

[[nodiscard]] inline hal::CanFrame can_frame(std::uint32_t id, std::uint8_t length = 8, bool extended = false) {
  hal::CanFrame frame{.id = id, .length = length, .extended = extended};
  for (std::uint8_t i = 0; i < length; ++i) frame.data[i] = static_cast<std::uint8_t>(id * 16 + i);
  return frame;
}
inline void expect_same(const hal::CanFrame& a, const hal::CanFrame& b) {
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.length, b.length);
  EXPECT_EQ(a.extended, b.extended);
  EXPECT_EQ(a.fd, b.fd);
  EXPECT_EQ(a.error, b.error);
  EXPECT_TRUE(std::equal(a.data.begin(), a.data.begin() + a.length, b.data.begin()));
}

template <typename Harness>
class CanChannelContract : public ::testing::Test {
 protected:
  void SetUp() override {
    if constexpr (requires { harness.absent(); }) {
      if (const char* why = harness.absent()) GTEST_SKIP() << why;
    }
  }
  std::vector<hal::CanFrame> read(std::size_t most) {
    std::vector<hal::CanFrame> frames(most);
    frames.resize(harness.port().read(frames));
    return frames;
  }
  Harness harness;
};
TYPED_TEST_SUITE_P(CanChannelContract);

TYPED_TEST_P(CanChannelContract, Read_NothingArrived_IsNone) {
  EXPECT_EQ(this->read(4).size(), 0U);
  EXPECT_EQ(this->harness.port().read({}), 0U);
  EXPECT_EQ(this->harness.port().status().received, 0U);
}
TYPED_TEST_P(CanChannelContract, Read_MoreThanTheSpanHolds_OldestFirstEachOnce) {
  for (std::uint32_t i = 0; i < 100; ++i) this->harness.arrive(can_frame(0x100 + i, static_cast<std::uint8_t>(i % 9)));
  std::uint32_t next = 0;
  for (const std::size_t most : {1U, 7U, 40U, 100U}) {
    for (const hal::CanFrame& frame : this->read(most)) {
      expect_same(frame, can_frame(0x100 + next, static_cast<std::uint8_t>(next % 9)));
      ++next;
    }
  }
  EXPECT_EQ(next, 100U);
  EXPECT_EQ(this->read(4).size(), 0U);
  EXPECT_EQ(this->harness.port().status().received, 100U);
}
TYPED_TEST_P(CanChannelContract, Write_Frames_ReachTheBusInOrderUnchanged) {
  std::vector<hal::CanFrame> frames;
  for (std::uint32_t i = 0; i < 50; ++i) frames.push_back(can_frame(0x10 + i, static_cast<std::uint8_t>(i % 9)));
  EXPECT_EQ(this->harness.port().write(frames), frames.size());
  const std::vector<hal::CanFrame> sent = this->harness.sent();
  ASSERT_EQ(sent.size(), frames.size());
  for (std::size_t i = 0; i < sent.size(); ++i) expect_same(sent[i], frames[i]);
  EXPECT_EQ(this->harness.port().status().sent, 50U);
  EXPECT_EQ(this->harness.port().write({}), 0U);
  EXPECT_EQ(this->read(4).size(), 0U) << "what a node sends it does not receive";
}
TYPED_TEST_P(CanChannelContract, ReadAndWrite_ExtendedIds_AreKeptApartFromStandardOnes) {
  const std::array<hal::CanFrame, 2> frames{can_frame(0x123, 8, true), can_frame(0x1ABCDEF0, 3, true)};
  for (const hal::CanFrame& frame : frames) this->harness.arrive(frame);
  const auto read = this->read(4);
  ASSERT_EQ(read.size(), 2U);
  EXPECT_EQ(this->harness.port().write(frames), 2U);
  const auto sent = this->harness.sent();
  ASSERT_EQ(sent.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    expect_same(read[i], frames[i]);
    expect_same(sent[i], frames[i]);
  }
}
TYPED_TEST_P(CanChannelContract, Write_FrameThatNoBusCarries_IsNotTaken) {
  std::array<hal::CanFrame, 3> frames{can_frame(1), can_frame(0x800), can_frame(2)};
  EXPECT_EQ(this->harness.port().write(frames), 1U) << "an id of twelve bits";
  frames[1] = can_frame(3);
  frames[1].length = 9;
  EXPECT_EQ(this->harness.port().write(frames), 1U) << "nine bytes in a classic frame";
  EXPECT_EQ(this->harness.sent().size(), 2U);
}
TYPED_TEST_P(CanChannelContract, Write_QueueFull_TakesWhatFitsAndCountsTheRest) {
  if constexpr (requires { this->harness.refuse_after(1); }) {
    this->harness.refuse_after(3);
    const std::array<hal::CanFrame, 5> frames{can_frame(1), can_frame(2), can_frame(3), can_frame(4), can_frame(5)};
    EXPECT_EQ(this->harness.port().write(frames), 3U);
    EXPECT_EQ(this->harness.port().status().refused, 2U);
    EXPECT_EQ(this->harness.port().status().sent, 3U);
    EXPECT_EQ(this->harness.port().status().failed_calls, 0U);
    EXPECT_EQ(this->harness.sent().size(), 3U);
    this->harness.refuse_after(10);
    EXPECT_EQ(this->harness.port().write(frames), 5U);
  } else {
    GTEST_SKIP() << "this queue has no end that a test could set";
  }
}
TYPED_TEST_P(CanChannelContract, ReadAndWrite_FdFrame_KeepsItsBytes) {
  if constexpr (requires { requires TypeParam::kFd; }) {
    hal::CanFrame frame = can_frame(0x55, 48);
    frame.fd = true;
    this->harness.arrive(frame);
    const auto read = this->read(2);
    ASSERT_EQ(read.size(), 1U);
    expect_same(read[0], frame);
    EXPECT_EQ(this->harness.port().write({&frame, 1}), 1U);
    const auto sent = this->harness.sent();
    ASSERT_EQ(sent.size(), 1U);
    expect_same(sent[0], frame);
    frame.length = 13;  // between two lengths that CAN FD has
    EXPECT_EQ(this->harness.port().write({&frame, 1}), 0U);
  } else {
    GTEST_SKIP() << "a classic bus";
  }
}
REGISTER_TYPED_TEST_SUITE_P(CanChannelContract, Read_NothingArrived_IsNone,
                            Read_MoreThanTheSpanHolds_OldestFirstEachOnce, Write_Frames_ReachTheBusInOrderUnchanged,
                            ReadAndWrite_ExtendedIds_AreKeptApartFromStandardOnes,
                            Write_FrameThatNoBusCarries_IsNotTaken, Write_QueueFull_TakesWhatFitsAndCountsTheRest,
                            ReadAndWrite_FdFrame_KeepsItsBytes);

}  // namespace polygmap::contract
