// SPDX-License-Identifier: Apache-2.0
// The MIT codec: what it makes, what it refuses, and that no bytes are too strange for it.
#include "hal/codec/mit_codec.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "hal/codec/can_bits.hpp"
#include "tests/support/codec_properties.hpp"

namespace polygmap::hal {
namespace {

constexpr MitRanges kRanges{12.5, 8.0, 144.0, 500.0, 5.0};
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

constexpr auto kQuantise = [](double x, double least, double most, unsigned bits) {
  std::uint32_t clamped = 0;
  return detail::quantised(x, least, most, {0, bits}, clamped);
};
static_assert(codec_properties::rounds_to_nearest(kQuantise, -12.5, 12.5, 16));
static_assert(codec_properties::rounds_to_nearest(kQuantise, 0.0, 500.0, 12));

constexpr MitBytes encoded(const JointSetpoint& command) {
  MitBytes bytes{};
  std::uint32_t clamped = 0;
  (void)try_encode_command(command, kRanges, bytes, clamped);
  return bytes;
}
// At the middle of every range: by hand, 0x7FFF.8 rounded up.
static_assert(encoded({}) == MitBytes{0x80, 0x00, 0x80, 0x00, 0x00, 0x00, 0x08, 0x00});
static_assert(encoded({12.5, -8.0, 144.0, 500.0, 0.0}) == MitBytes{0xFF, 0xFF, 0x00, 0x0F, 0xFF, 0x00, 0x0F, 0xFF});

JointSetpoint random_command(std::mt19937_64& random, double beyond) {
  const auto within = [&](double least, double most) {
    const double middle = 0.5 * (least + most), half = 0.5 * (most - least) * beyond;
    return std::uniform_real_distribution<double>(middle - half, middle + half)(random);
  };
  return {within(-kRanges.p_rad, kRanges.p_rad), within(-kRanges.v_radps, kRanges.v_radps),
          within(-kRanges.t_nm, kRanges.t_nm), within(0, kRanges.kp_nmprad), within(0, kRanges.kd_nmsprad)};
}

TEST(MitCodec, RandomCommands_ComeBackWithinHalfAStep) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 100000; ++i) {
    const JointSetpoint sent = random_command(random, 1.0);
    MitBytes bytes{};
    std::uint32_t clamped = 0;
    ASSERT_TRUE(try_encode_command(sent, kRanges, bytes, clamped));
    ASSERT_EQ(clamped, 0U);
    JointSetpoint got;
    ASSERT_TRUE(try_decode_command(bytes, kRanges, got));
    constexpr double kHalf = 0.5 + 1e-9;
    EXPECT_LE(std::abs(got.q_rad - sent.q_rad), kHalf * 2 * kRanges.p_rad / 65535);
    EXPECT_LE(std::abs(got.dq_radps - sent.dq_radps), kHalf * 2 * kRanges.v_radps / 4095);
    EXPECT_LE(std::abs(got.kp_nmprad - sent.kp_nmprad), kHalf * kRanges.kp_nmprad / 4095);
    EXPECT_LE(std::abs(got.kd_nmsprad - sent.kd_nmsprad), kHalf * kRanges.kd_nmsprad / 4095);
    EXPECT_LE(std::abs(got.tau_ff_nm - sent.tau_ff_nm), kHalf * 2 * kRanges.t_nm / 4095);
    MitBytes again{};
    ASSERT_TRUE(try_encode_command(got, kRanges, again, clamped));
    ASSERT_EQ(again, bytes) << "what was on the bus is said in the same words";
  }
}

TEST(MitCodec, ValuesBeyondTheirRange_AreClampedAndCounted) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 20000; ++i) {
    const JointSetpoint sent = random_command(random, 3.0);
    std::uint32_t beyond = 0;
    beyond += std::abs(sent.q_rad) > kRanges.p_rad ? 1 : 0;
    beyond += std::abs(sent.dq_radps) > kRanges.v_radps ? 1 : 0;
    beyond += std::abs(sent.tau_ff_nm) > kRanges.t_nm ? 1 : 0;
    beyond += sent.kp_nmprad < 0 || sent.kp_nmprad > kRanges.kp_nmprad ? 1 : 0;
    beyond += sent.kd_nmsprad < 0 || sent.kd_nmsprad > kRanges.kd_nmsprad ? 1 : 0;
    MitBytes bytes{};
    std::uint32_t clamped = 7;
    ASSERT_TRUE(try_encode_command(sent, kRanges, bytes, clamped));
    ASSERT_EQ(clamped, 7 + beyond);
    JointSetpoint got;
    ASSERT_TRUE(try_decode_command(bytes, kRanges, got));
    ASSERT_LE(std::abs(got.q_rad), kRanges.p_rad);
    ASSERT_LE(got.kp_nmprad, kRanges.kp_nmprad);
    ASSERT_GE(got.kd_nmsprad, 0.0);
  }
}

TEST(MitCodec, NotFinite_IsRefusedAndLeavesTheBytes) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    for (int field = 0; field < 5; ++field) {
      JointSetpoint command;
      double* const values[] = {&command.q_rad, &command.dq_radps, &command.tau_ff_nm, &command.kp_nmprad,
                                &command.kd_nmsprad};
      *values[field] = bad;
      MitBytes bytes{1, 2, 3};
      std::uint32_t clamped = 0;
      EXPECT_FALSE(try_encode_command(command, kRanges, bytes, clamped)) << field << " " << bad;
      EXPECT_EQ(bytes, (MitBytes{1, 2, 3}));
      EXPECT_EQ(clamped, 0U);
    }
  }
}

TEST(MitCodec, CommandOfAllUpperEnds_IsNoSpecialFrame) {
  for (double t_nm = 143.0; t_nm <= 144.0; t_nm += 0.005) {
    const MitBytes bytes = encoded({12.5, 8.0, t_nm, 500.0, 5.0});
    EXPECT_FALSE(is_special_frame(bytes)) << t_nm;
    JointSetpoint got;
    ASSERT_TRUE(try_decode_command(bytes, kRanges, got));
    EXPECT_NEAR(got.kd_nmsprad, 5.0, 5.0 / 4095 + 1e-9);
    EXPECT_EQ(got.q_rad, 12.5);
  }
}

TEST(MitCodec, SpecialFrames_AreThemselvesAndNoCommands) {
  for (const MitSpecial special :
       {MitSpecial::kClearErrors, MitSpecial::kEnter, MitSpecial::kExit, MitSpecial::kZero}) {
    const MitBytes bytes = special_frame(special);
    EXPECT_TRUE(is_special_frame(bytes));
    EXPECT_EQ(bytes[0], 0xFF);
    JointSetpoint command;
    EXPECT_FALSE(try_decode_command(bytes, kRanges, command));
  }
  EXPECT_EQ(special_frame(MitSpecial::kEnter)[7], 0xFC);
  EXPECT_EQ(special_frame(MitSpecial::kExit)[7], 0xFD);
  EXPECT_EQ(special_frame(MitSpecial::kZero)[7], 0xFE);
  EXPECT_EQ(special_frame(MitSpecial::kClearErrors)[7], 0xFB);
}

TEST(MitCodec, RandomReplies_AreWithinTheRangesOrRefused) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 200000; ++i) {
    std::array<std::uint8_t, 64> bytes{};
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    const std::size_t length = random() % 65;
    const auto rule = i % 2 == 0 ? MitReplyRule::kId : MitReplyRule::kStatusNibble;
    const auto id = static_cast<std::uint32_t>(1 + random() % (rule == MitReplyRule::kId ? 255 : 15));
    if (i % 3 == 0) bytes[0] = static_cast<std::uint8_t>(id);
    MitReply reply{7.0, 7.0, 7.0};
    const bool taken = try_decode_reply({bytes.data(), length}, id, kRanges, rule, reply);
    const bool named = length > 0 && reply_name(bytes[0], rule) == reply_name(id, rule);
    ASSERT_EQ(taken, named && (length == 6 || length == 8));
    if (!taken) {
      ASSERT_EQ(reply.p_rad, 7.0);
      continue;
    }
    ASSERT_LE(std::abs(reply.p_rad), kRanges.p_rad);
    ASSERT_LE(std::abs(reply.v_radps), kRanges.v_radps);
    ASSERT_LE(std::abs(reply.t_nm), kRanges.t_nm);
  }
}

TEST(MitCodec, RandomReplyValues_ComeBackWithinHalfAStep) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 50000; ++i) {
    const JointSetpoint value = random_command(random, 1.0);
    const auto rule = i % 2 == 0 ? MitReplyRule::kId : MitReplyRule::kStatusNibble;
    MitReply sent{value.q_rad, value.dq_radps, value.tau_ff_nm};
    sent.status = rule == MitReplyRule::kId ? static_cast<std::uint8_t>(i % 5) : static_cast<std::uint8_t>(i % 16);
    const auto id = static_cast<std::uint32_t>(1 + i % 15);
    const MitBytes bytes = reply_frame(sent, id, kRanges, rule);
    MitReply got;
    ASSERT_TRUE(try_decode_reply(bytes, id, kRanges, rule, got));
    constexpr double kHalf = 0.5 + 1e-9;
    EXPECT_LE(std::abs(got.p_rad - sent.p_rad), kHalf * 2 * kRanges.p_rad / 65535);
    EXPECT_LE(std::abs(got.v_radps - sent.v_radps), kHalf * 2 * kRanges.v_radps / 4095);
    EXPECT_LE(std::abs(got.t_nm - sent.t_nm), kHalf * 2 * kRanges.t_nm / 4095);
    EXPECT_EQ(got.status, sent.status);
    EXPECT_EQ(got.error, rule == MitReplyRule::kId ? sent.status != 0 : sent.status >= 8);
    EXPECT_EQ(got.enabled, rule == MitReplyRule::kId || sent.status != 0);
    MitReply other;
    EXPECT_FALSE(try_decode_reply(bytes, id % 15 + 1, kRanges, rule, other)) << "another drive's";
    ASSERT_TRUE(try_decode_reply({bytes.data(), 6}, id, kRanges, rule, other));
    EXPECT_EQ(other.p_rad, got.p_rad);
  }
}

// Drive 17's byte 0, read by the rule of another make, would be drive 1 with status 1.
TEST(MitCodec, StatusNibble_IsReadByItsOwnRuleAlone) {
  const MitBytes bytes = reply_frame({1.0, 2.0, 3.0}, 17, kRanges, MitReplyRule::kId);
  MitReply reply;
  EXPECT_TRUE(try_decode_reply(bytes, 17, kRanges, MitReplyRule::kId, reply));
  EXPECT_FALSE(try_decode_reply(bytes, 1, kRanges, MitReplyRule::kId, reply));
}

TEST(MitCodec, Temperatures_AreTheMakersBytes) {
  std::array<std::uint8_t, 8> bytes{5, 0x80, 0, 0x80, 0x08, 0, 0xEC, 0x7D};
  MitReply reply;
  ASSERT_TRUE(try_decode_reply(bytes, 5, kRanges, MitReplyRule::kId, reply));
  EXPECT_EQ(reply.motor_degc, -20) << "it has a sign";
  EXPECT_EQ(reply.mos_degc, kNotTold_degc);
  EXPECT_EQ(reply.hottest_degc(), -20);
  EXPECT_EQ(reply.status, 0x7D);
  bytes[0] = 0x15;
  ASSERT_TRUE(try_decode_reply(bytes, 5, kRanges, MitReplyRule::kStatusNibble, reply));
  EXPECT_EQ(reply.mos_degc, 236) << "it has none";
  EXPECT_EQ(reply.motor_degc, 125);
  EXPECT_EQ(reply.hottest_degc(), 236);
  for (const auto rule : {MitReplyRule::kId, MitReplyRule::kStatusNibble}) {
    ASSERT_TRUE(try_decode_reply({bytes.data(), 6}, rule == MitReplyRule::kId ? 0x15 : 5, kRanges, rule, reply));
    EXPECT_EQ(reply.hottest_degc(), kNotTold_degc) << "a short reply tells none";
  }
}

TEST(MitCodec, EveryTemperature_ComesBackOrIsTheNearestEnd) {
  for (std::int16_t degc = -300; degc <= 300; ++degc) {
    for (const auto rule : {MitReplyRule::kId, MitReplyRule::kStatusNibble}) {
      const bool is_id = rule == MitReplyRule::kId;
      MitReply sent;
      sent.motor_degc = degc;
      sent.mos_degc = 30;
      MitReply got;
      ASSERT_TRUE(try_decode_reply(reply_frame(sent, 3, kRanges, rule), 3, kRanges, rule, got));
      EXPECT_EQ(got.motor_degc, std::clamp<int>(degc, is_id ? -128 : 0, is_id ? 127 : 255));
      EXPECT_EQ(got.mos_degc, is_id ? kNotTold_degc : 30);
    }
  }
}

TEST(FeetFrame, RandomForces_ComeBackWithinHalfAUnit) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 20000; ++i) {
    std::uniform_real_distribution<double> forces(0.0, 3000.0);
    const std::array<double, kFootCount> sent{forces(random), forces(random)};
    std::array<double, kFootCount> got{};
    ASSERT_TRUE(try_decode_feet(feet_frame(sent, 0.05), 0.05, got));
    for (std::size_t f = 0; f < kFootCount; ++f) ASSERT_LE(std::abs(got[f] - sent[f]), 0.025 + 1e-9);
  }
  std::array<double, kFootCount> got{};
  ASSERT_TRUE(try_decode_feet(feet_frame({-5.0, 1e9}, 0.05), 0.05, got));
  EXPECT_EQ(got[0], 0.0);
  EXPECT_NEAR(got[1], 65535 * 0.05, 1e-9);
  const std::array<std::uint8_t, 5> five{};
  for (const std::size_t length : {0U, 1U, 3U, 5U}) EXPECT_FALSE(try_decode_feet({five.data(), length}, 0.05, got));
}

TEST(CanBits, NoFrame_IsLongerThanTheLongest) {
  std::mt19937_64 random(6);
  std::size_t most = 0;
  for (int i = 0; i < 50000; ++i) {
    CanFrame frame;
    frame.id = static_cast<std::uint32_t>(random() % 0x800);
    frame.length = static_cast<std::uint8_t>(random() % 9);
    // Long runs are what is stuffed.
    for (std::uint8_t& byte : frame.data)
      byte = random() % 3 == 0 ? static_cast<std::uint8_t>(random()) : i % 2 == 0 ? 0xFF : 0x00;
    const std::size_t bits = frame_bits(frame);
    ASSERT_GE(bits, kCanFrameBits + 8U * frame.length);
    ASSERT_LE(bits, longest_frame_bits(frame.length));
    if (frame.length == 8) most = std::max(most, bits);
  }
  EXPECT_GE(most, 120U) << "and the bound is near";
  EXPECT_EQ(longest_frame_bits(8), 135U);
}

// 0x0F repeated over identifier and data: a known frame of alternating runs of four needs no stuffing in its data.
TEST(CanBits, RunsOfFour_NeedNoStuffing) {
  CanFrame frame;
  frame.id = 0x555;
  frame.length = 8;
  for (std::size_t i = 0; i < 8; ++i) frame.data[i] = 0xAA;
  EXPECT_LE(frame_bits(frame), kCanFrameBits + 64 + 5);
}

}  // namespace
}  // namespace polygmap::hal
