// SPDX-License-Identifier: Apache-2.0
// The joint bus over CAN channels: whose replies count, what is counted, how old each joint's reading is.
#include "hal/can/can_joint_bus.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <random>
#include <vector>

namespace polygmap::hal {
namespace {

class FakeChannel final : public CanChannel {
 public:
  std::size_t read(std::span<CanFrame> frames) noexcept override {
    std::size_t n = 0;
    while (n < frames.size() && !incoming.empty()) {
      frames[n++] = incoming.front();
      incoming.pop_front();
    }
    return n;
  }
  std::size_t write(std::span<const CanFrame> frames) noexcept override {
    const std::size_t taken = std::min(frames.size(), room);
    sent.insert(sent.end(), frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(taken));
    return taken;
  }
  CanChannelStatus status() const noexcept override { return told; }

  std::deque<CanFrame> incoming;
  std::vector<CanFrame> sent;
  std::size_t room = 100;
  CanChannelStatus told;
};

constexpr MitRanges kRanges{12.5, 25.0, 200.0, 500.0, 5.0};

// Three drives to a bus, ids 1 to 12.
DriveTable table_of(MitReplyRule rule) {
  DriveTable table;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    table.drives[n] = {static_cast<std::uint8_t>(n / 3), static_cast<std::uint16_t>(n + 1),
                       static_cast<std::uint16_t>(rule == MitReplyRule::kId ? 0 : 0x11 + n), rule, kRanges};
  }
  table.feet = {true, 0, 0x60, 0.5};
  table.bus_count = 4;
  return table;
}

class CanJointBusTest : public testing::TestWithParam<MitReplyRule> {
 protected:
  CanJointBusTest() : table_(table_of(GetParam())) { bus_.emplace(table_, pointers_); }

  CanFrame reply_of(std::size_t joint, double q_rad, std::uint8_t status = 255) const {
    const CanDrive& drive = table_.drives[joint];
    MitReply reply{q_rad, 0.5, -3.0};
    const std::uint8_t good = drive.reply == MitReplyRule::kStatusNibble ? 1 : 0;
    reply.status = status == 255 ? good : status;
    CanFrame frame;
    frame.id = drive.reply_id;
    frame.length = 8;
    std::ranges::copy(reply_frame(reply, drive.id, drive.ranges, drive.reply), frame.data.begin());
    return frame;
  }
  void answer(std::size_t joint, double q_rad) {
    channels_[table_.drives[joint].bus].incoming.push_back(reply_of(joint, q_rad));
  }
  void answer_all(double q_rad) {
    for (std::size_t n = 0; n < kJointCount; ++n) answer(n, q_rad);
    CanFrame feet;
    feet.id = 0x60;
    feet.length = 4;
    std::ranges::copy(feet_frame({270.0, 280.0}, 0.5), feet.data.begin());
    channels_[0].incoming.push_back(feet);
  }
  JointSet write(double q_rad = 0.1) {
    JointCommand command;
    command.stamp_ns = now_ns_ += kBusCycle_ns;
    if (asks_) command.joints.fill({q_rad, 0.0, 1.0, 100.0, 1.0});
    return bus_->try_write(command);
  }

  // Writes and says, of each joint, which special frame it was sent: its last byte, 0 for a command.
  std::array<std::uint8_t, kJointCount> written() {
    for (FakeChannel& channel : channels_) channel.sent.clear();
    write();
    std::array<std::uint8_t, kJointCount> special{};
    for (const FakeChannel& channel : channels_) {
      for (const CanFrame& frame : channel.sent) {
        MitBytes bytes{};
        std::copy_n(frame.data.begin(), bytes.size(), bytes.begin());
        if (is_special_frame(bytes)) special[frame.id - 1] = bytes[7];
      }
    }
    return special;
  }

  DriveTable table_;
  std::array<FakeChannel, 4> channels_;
  std::array<CanChannel*, 4> pointers_{&channels_[0], &channels_[1], &channels_[2], &channels_[3]};
  std::optional<CanJointBus> bus_;
  std::int64_t now_ns_ = kNsPerS;
  bool asks_ = true;  // gains and torques of the drives
};

INSTANTIATE_TEST_SUITE_P(, CanJointBusTest, testing::Values(MitReplyRule::kId, MitReplyRule::kStatusNibble));

TEST_P(CanJointBusTest, FirstWrites_EnterMotorModeAndCommandInTurnUntilTheDriveAnswers) {
  EXPECT_TRUE(write().is_all());
  for (const FakeChannel& channel : channels_) {
    ASSERT_EQ(channel.sent.size(), 3U);
    for (const CanFrame& frame : channel.sent) EXPECT_EQ(frame.data[7], 0xFC);
  }
  EXPECT_TRUE(write().is_all());
  EXPECT_NE(channels_[0].sent[3].data[0], 0xFF) << "a drive that is in motor mode answers a command";
  answer(1, 0.2);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  for (FakeChannel& channel : channels_) channel.sent.clear();
  EXPECT_TRUE(write().is_all());
  EXPECT_EQ(channels_[0].sent[0].data[7], 0xFC);
  EXPECT_NE(channels_[0].sent[1].data[0], 0xFF) << "it has answered";
}

TEST_P(CanJointBusTest, Write_SendsEachDriveItsCommandOnItsBus) {
  write();
  answer_all(0.0);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  for (FakeChannel& channel : channels_) channel.sent.clear();
  EXPECT_TRUE(write(0.3).is_all());
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const CanFrame& frame = channels_[n / 3].sent[n % 3];
    EXPECT_EQ(frame.id, n + 1);
    ASSERT_EQ(frame.length, 8);
    MitBytes bytes{};
    std::copy_n(frame.data.begin(), 8, bytes.begin());
    JointSetpoint got;
    ASSERT_TRUE(try_decode_command(bytes, kRanges, got));
    EXPECT_NEAR(got.q_rad, 0.3, 2e-4);
    EXPECT_NEAR(got.kp_nmprad, 100.0, 0.07);
  }
  EXPECT_EQ(bus_->status().clamped, 0U);
}

TEST_P(CanJointBusTest, Read_NothingAsked_TakesNothing) {
  answer_all(0.5);
  JointFeedback feedback;
  EXPECT_FALSE(bus_->try_read(feedback));
}

TEST_P(CanJointBusTest, Read_AllAnswered_HasTheirValuesAndTheCommandsStamp) {
  write();
  answer_all(0.5);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  EXPECT_EQ(feedback.stamp_ns, now_ns_);
  for (std::size_t n = 0; n < kJointCount; ++n) {
    EXPECT_NEAR(feedback.q_rad[static_cast<Eigen::Index>(n)], 0.5, 2e-4);
    EXPECT_NEAR(feedback.tau_nm[static_cast<Eigen::Index>(n)], -3.0, 0.05);
    EXPECT_EQ(feedback.silent_cycles[n], 0);
  }
  EXPECT_EQ(feedback.foot_force_n[0], 270.0);
  EXPECT_EQ(feedback.foot_force_n[1], 280.0);
  EXPECT_FALSE(bus_->try_read(feedback)) << "each once";
}

TEST_P(CanJointBusTest, Read_OneDriveSilent_ElevenAreFreshAndItsAgeGrows) {
  write();
  answer_all(0.5);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  for (std::uint16_t cycle = 1; cycle <= 70; ++cycle) {
    write();
    for (std::size_t n = 0; n < kJointCount; ++n) {
      if (n != 4) answer(n, 0.6);
    }
    ASSERT_TRUE(bus_->try_read(feedback));
    EXPECT_EQ(feedback.stamp_ns, now_ns_);
    for (std::size_t n = 0; n < kJointCount; ++n) EXPECT_EQ(feedback.silent_cycles[n], n == 4 ? cycle : 0);
    EXPECT_NEAR(feedback.q_rad[4], 0.5, 2e-4) << "as it was last heard";
  }
  write();
  answer_all(0.7);
  ASSERT_TRUE(bus_->try_read(feedback));
  EXPECT_EQ(feedback.silent_cycles[4], 0);
  EXPECT_NEAR(feedback.q_rad[4], 0.7, 2e-4);
}

TEST_P(CanJointBusTest, Read_DriveNeverHeard_SaysSo) {
  write();
  for (std::size_t n = 1; n < kJointCount; ++n) answer(n, 0.1);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  EXPECT_EQ(feedback.silent_cycles[0], JointFeedback::kNeverHeard);
  EXPECT_FALSE(bus_->heard().is_all());
  EXPECT_FALSE(bus_->heard().contains(0));
}

TEST_P(CanJointBusTest, Write_QueueTakesTwo_SaysWhoseAndCountsTheRest) {
  channels_[1].room = 2;
  channels_[3].room = 0;
  const JointSet taken = write();
  for (std::size_t n = 0; n < kJointCount; ++n) EXPECT_EQ(taken.contains(n), n < 5 || (n >= 6 && n < 9)) << n;
  EXPECT_FALSE(taken.is_all());
  EXPECT_EQ(bus_->status().refused, 4U);
}

TEST_P(CanJointBusTest, Write_NotFinite_SendsTheOthersAlone) {
  JointCommand command;
  command.stamp_ns = now_ns_;
  command.joints[7].tau_ff_nm = std::numeric_limits<double>::quiet_NaN();
  const JointSet taken = bus_->try_write(command);
  EXPECT_FALSE(taken.contains(7));
  EXPECT_TRUE(taken.contains(6));
  EXPECT_EQ(channels_[2].sent.size(), 2U);
  EXPECT_EQ(bus_->status().not_finite, 1U);
}

TEST_P(CanJointBusTest, Write_BeyondTheRange_IsClampedAndCounted) {
  write();
  answer_all(0.0);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  (void)write(13.0);
  EXPECT_EQ(bus_->status().clamped, kJointCount);
}

TEST_P(CanJointBusTest, Read_ForeignFrames_AreCountedAndChangeNothing) {
  write();
  answer_all(0.5);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  write();
  CanFrame unknown = reply_of(0, 1.0);
  unknown.id = 0x333;
  channels_[0].incoming.push_back(unknown);
  CanFrame extended = reply_of(0, 1.0);
  extended.extended = true;
  channels_[0].incoming.push_back(extended);
  channels_[2].incoming.push_back(reply_of(0, 1.0));  // another bus's drive
  CanFrame shorter = reply_of(1, 1.0);
  shorter.length = 7;
  channels_[0].incoming.push_back(shorter);
  CanFrame empty = reply_of(1, 1.0);
  empty.length = 0;
  channels_[0].incoming.push_back(empty);
  CanFrame fd = reply_of(1, 1.0);
  fd.fd = true;
  channels_[0].incoming.push_back(fd);
  CanFrame wide = reply_of(1, 1.0);  // no identifier of 11 bits, and in its lower ones a drive's
  wide.id |= kMaxCanId + 1;
  channels_[0].incoming.push_back(wide);
  CanFrame error;
  error.error = true;
  error.id = table_.drives[0].reply_id;
  channels_[0].incoming.push_back(error);
  CanFrame feet;
  feet.id = 0x60;
  feet.length = 3;
  channels_[0].incoming.push_back(feet);
  EXPECT_FALSE(bus_->try_read(feedback)) << "no drive replied";
  const JointBusStatus status = bus_->status();
  // Where all drives share an identifier, the frame of another bus's drive has a known identifier and a wrong name.
  const bool shared = GetParam() == MitReplyRule::kId;
  EXPECT_EQ(status.unknown_ids, shared ? 3U : 4U);
  EXPECT_EQ(status.bad_frames, shared ? 5U : 4U);
}

TEST_P(CanJointBusTest, Read_RandomFrames_NeverBreaksIt) {
  std::mt19937_64 random(1);
  JointFeedback feedback;
  std::uint64_t given = 0;
  for (int cycle = 0; cycle < 3000; ++cycle) {
    write();
    for (FakeChannel& channel : channels_) {
      for (std::size_t i = random() % 8; i > 0; --i) {
        CanFrame frame;
        frame.id = static_cast<std::uint32_t>(random() % 0x80);
        frame.length = static_cast<std::uint8_t>(random() % 3 == 0 ? random() % 256 : 8);  // even a broken driver's
        frame.extended = random() % 16 == 0;
        frame.fd = random() % 16 == 0;
        for (std::uint8_t& byte : frame.data) byte = static_cast<std::uint8_t>(random());
        if (random() % 2 == 0) frame.data[0] = static_cast<std::uint8_t>(0x10 | (1 + random() % 12));
        channel.incoming.push_back(frame);
        ++given;
      }
    }
    if (bus_->try_read(feedback)) {
      ASSERT_TRUE(math::all_finite(feedback.q_rad));
      ASSERT_LE(feedback.q_rad.cwiseAbs().maxCoeff(), kRanges.p_rad);
    }
  }
  EXPECT_GT(bus_->status().unknown_ids, given / 4);
  EXPECT_GT(bus_->status().bad_frames, 100U);
}

TEST_P(CanJointBusTest, Read_BabblingNode_DoesNotHoldTheCycle) {
  write();
  for (int i = 0; i < 1000; ++i) channels_[0].incoming.push_back(reply_of(0, 0.1));
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  EXPECT_GE(channels_[0].incoming.size(), 900U);
}

TEST_P(CanJointBusTest, Read_DriveTellsAnError_SaysWhichAndItsCode) {
  write();
  answer_all(0.5);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  EXPECT_TRUE(bus_->status().drive_errors.is_empty());
  write();
  channels_[1].incoming.push_back(reply_of(5, 0.5, 9));
  ASSERT_TRUE(bus_->try_read(feedback));
  EXPECT_TRUE(bus_->status().drive_errors.contains(5));
  EXPECT_EQ(bus_->status().drive_code[5], 9);
  EXPECT_EQ(bus_->status().drive_error_replies, 1U);
  write();
  answer(5, 0.5);
  ASSERT_TRUE(bus_->try_read(feedback));
  EXPECT_TRUE(bus_->status().drive_errors.is_empty());
}

TEST_P(CanJointBusTest, Read_DriveTellsItsTemperature_SaysTheHottestUntilItTellsNone) {
  EXPECT_EQ(bus_->status().drive_degc[5], kNotTold_degc);
  write();
  CanFrame frame = reply_of(5, 0.5);
  const bool nibble = GetParam() == MitReplyRule::kStatusNibble;
  frame.data[6] = 71;              // the motor; Damiao: the transistors
  if (nibble) frame.data[7] = 64;  // the motor
  channels_[1].incoming.push_back(frame);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  EXPECT_EQ(bus_->status().drive_degc[5], 71);
  EXPECT_EQ(bus_->status().drive_degc[4], kNotTold_degc);
  EXPECT_TRUE(bus_->status().drive_errors.is_empty());
  write();
  frame.length = 6;
  channels_[1].incoming.push_back(frame);
  ASSERT_TRUE(bus_->try_read(feedback));
  EXPECT_EQ(bus_->status().drive_degc[5], kNotTold_degc);
}

TEST_P(CanJointBusTest, Read_DriveLeftMotorMode_IsAnError) {
  if (GetParam() != MitReplyRule::kStatusNibble) GTEST_SKIP() << "its replies do not say";
  write();
  channels_[0].incoming.push_back(reply_of(0, 0.5, 0));
  JointFeedback feedback;
  EXPECT_FALSE(bus_->try_read(feedback)) << "not yet in motor mode";
  write();
  answer_all(0.5);
  ASSERT_TRUE(bus_->try_read(feedback));
  write();
  channels_[0].incoming.push_back(reply_of(0, 0.5, 0));
  ASSERT_TRUE(bus_->try_read(feedback));
  EXPECT_TRUE(bus_->status().drive_errors.contains(0));
}

TEST_P(CanJointBusTest, Read_FeetSilent_ForcesBecomeUnknown) {
  write();
  answer_all(0.5);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  for (int cycle = 1; cycle <= 6; ++cycle) {
    write();
    for (std::size_t n = 0; n < kJointCount; ++n) answer(n, 0.5);
    ASSERT_TRUE(bus_->try_read(feedback));
    EXPECT_EQ(std::isnan(feedback.foot_force_n[0]), cycle > 5) << cycle;
    EXPECT_EQ(bus_->status().feet_silent, cycle > 5) << cycle;
  }
}

TEST_P(CanJointBusTest, Status_BusGoesOffTwice_IsCountedTwice) {
  write();
  for (int i = 0; i < 2; ++i) {
    channels_[2].told.bus_off = true;
    JointFeedback feedback;
    EXPECT_FALSE(bus_->try_read(feedback));
    EXPECT_FALSE(bus_->try_read(feedback));
    EXPECT_TRUE(bus_->status().bus_off);
    channels_[2].told.bus_off = false;
    EXPECT_FALSE(bus_->try_read(feedback));
    EXPECT_FALSE(bus_->status().bus_off);
  }
  EXPECT_EQ(bus_->status().bus_offs, 2U);
  channels_[0].told.lost = 3;
  channels_[1].told.lost = 4;
  channels_[1].told.failed_calls = 5;
  (void)write();
  EXPECT_EQ(bus_->status().lost, 7U);
  EXPECT_EQ(bus_->status().failed_calls, 5U);
}

TEST_P(CanJointBusTest, DriveSilentThenBack_IsEnteredAgainAndTheOthersAreNotDisturbed) {
  write();
  answer_all(0.5);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  int entered = 0;
  for (int cycle = 0; cycle < 205; ++cycle) {
    const auto special = written();
    for (std::size_t n = 0; n < kJointCount; ++n) {
      if (n != 4) {
        ASSERT_EQ(special[n], 0) << "joint " << n << " answers";
      }
    }
    ASSERT_TRUE(special[4] == 0 || special[4] == 0xFC);
    if (cycle < 5) {
      ASSERT_EQ(special[4], 0) << "not yet silent";
    }
    entered += special[4] != 0;
    for (std::size_t n = 0; n < kJointCount; ++n) {
      if (n != 4) answer(n, 0.5);
    }
    ASSERT_TRUE(bus_->try_read(feedback));
  }
  EXPECT_EQ(entered, 4) << "once in 50 cycles";
  // It is up again, and answers a command without being in motor mode: only some dialects tell so.
  const bool tells = GetParam() == MitReplyRule::kStatusNibble;
  while (written()[4] != 0) {
  }
  int writes = 0;
  do {
    channels_[1].incoming.push_back(reply_of(4, 0.6, tells ? 0 : 255));
    answer(0, 0.5);
    ASSERT_TRUE(bus_->try_read(feedback));
    EXPECT_EQ(feedback.silent_cycles[4] == 0, !tells);
    EXPECT_TRUE(bus_->status().drive_errors.is_empty()) << "it is about to be entered";
    ASSERT_LT(++writes, 3) << "entered at once";
  } while (written()[4] == 0);
  answer(4, 0.7);
  ASSERT_TRUE(bus_->try_read(feedback));
  EXPECT_EQ(feedback.silent_cycles[4], 0);
  EXPECT_NEAR(feedback.q_rad[4], 0.7, 2e-4);
  for (int cycle = 0; cycle < 120; ++cycle) {
    EXPECT_EQ(written()[4], 0) << "it has answered the frame that enters";
    answer(4, 0.7);
    ASSERT_TRUE(bus_->try_read(feedback));
  }
}

TEST_P(CanJointBusTest, DriveAnswersOnceAndIsSilentAgain_IsNotEnteredOftener) {
  write();
  answer_all(0.5);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  for (int cycle = 0; cycle < 10; ++cycle) write();
  answer(4, 0.6);
  ASSERT_TRUE(bus_->try_read(feedback));
  int entered = 0;
  for (int cycle = 0; cycle < 200; ++cycle) entered += written()[4] != 0;
  EXPECT_LE(entered, 5);
}

TEST_P(CanJointBusTest, EnterFrameRefused_IsSentAgain) {
  write();
  answer_all(0.5);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  for (int cycle = 0; cycle < 10; ++cycle) write();  // all silent
  for (FakeChannel& channel : channels_) channel.room = 0;
  for (int cycle = 0; cycle < 40; ++cycle) write();  // the last of them is the 51st write, which enters
  for (FakeChannel& channel : channels_) channel.room = 100;
  for (const int special : {0x00, 0xFC}) {
    answer(4, 0.6);
    ASSERT_TRUE(bus_->try_read(feedback));
    EXPECT_EQ(written()[4], special) << "what answered was not entered";
  }
}

TEST_P(CanJointBusTest, DriveComesBackWithAnError_IsClearedThenEntered) {
  if (GetParam() != MitReplyRule::kStatusNibble) GTEST_SKIP() << "no frame of its dialect clears an error";
  write();
  answer_all(0.5);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  for (int cycle = 0; cycle < 20; ++cycle) write();
  int cleared = 0;
  for (int cycle = 0; cycle < 200; ++cycle) {
    const std::uint8_t special = written()[4];
    ASSERT_TRUE(special == 0 || special == 0xFB) << "not entered while the error stays";
    cleared += special != 0;
    channels_[1].incoming.push_back(reply_of(4, 0.5, 9));
    ASSERT_TRUE(bus_->try_read(feedback));
    EXPECT_TRUE(bus_->status().drive_errors.contains(4));
  }
  EXPECT_EQ(cleared, 4) << "once in 50 cycles";
  while (written()[4] != 0xFB) {
  }
  channels_[1].incoming.push_back(reply_of(4, 0.5, 0));
  EXPECT_FALSE(bus_->try_read(feedback)) << "cleared, and out of motor mode";
  EXPECT_TRUE(bus_->status().drive_errors.is_empty());
  EXPECT_EQ(bus_->status().drive_code[4], 0);
  EXPECT_EQ(written()[4], 0);
  channels_[1].incoming.push_back(reply_of(4, 0.5, 0));
  EXPECT_FALSE(bus_->try_read(feedback));
  EXPECT_EQ(written()[4], 0xFC);
  answer(4, 0.5);
  ASSERT_TRUE(bus_->try_read(feedback));
  EXPECT_EQ(written()[4], 0);
}

// As after a power-up in which it latched an error.
TEST_P(CanJointBusTest, FirstAnswerTellsAnError_IsClearedThenEnteredWhileNothingIsAsked) {
  const bool can_clear = GetParam() == MitReplyRule::kStatusNibble;
  asks_ = false;
  write();
  JointFeedback feedback;
  const auto answer_with = [&](std::uint8_t status) {
    for (std::size_t n = 0; n < kJointCount; ++n) {
      if (n != 4) answer(n, 0.5);
    }
    channels_[1].incoming.push_back(reply_of(4, 0.5, status));
    ASSERT_TRUE(bus_->try_read(feedback));
  };
  int sent = 0;
  for (int cycle = 0; cycle < 205; ++cycle) {
    answer_with(9);
    ASSERT_TRUE(bus_->status().drive_errors.contains(4));
    const auto special = written();
    for (std::size_t n = 0; n < kJointCount; ++n) {
      ASSERT_TRUE(special[n] == 0 || (n == 4 && special[n] == (can_clear ? 0xFB : 0xFC))) << n;
    }
    sent += special[4] != 0;
  }
  EXPECT_EQ(sent, 4) << "once in 50 cycles";
  const std::uint8_t gone = can_clear ? 0 : 255;  // out of motor mode, where it can tell
  for (int cycle = 0; cycle < 2; ++cycle) {
    answer_with(gone);
    EXPECT_TRUE(bus_->status().drive_errors.is_empty());
    EXPECT_EQ(feedback.silent_cycles[4] == 0, !can_clear);
    if (written()[4] == 0xFC) break;
    ASSERT_EQ(cycle, 0) << "entered at once";
  }
  for (int cycle = 0; cycle < 120; ++cycle) {
    answer_with(255);
    EXPECT_EQ(feedback.silent_cycles[4], 0);
    EXPECT_EQ(written()[4], 0) << "it has answered the frame that enters";
  }
}

TEST_P(CanJointBusTest, DriveInErrorThatCarries_IsSentItsCommandsOnly) {
  write();
  answer_all(0.5);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  for (int cycle = 0; cycle < 200; ++cycle) {
    ASSERT_EQ(written()[4], 0);
    channels_[1].incoming.push_back(reply_of(4, 0.5, 9));
    ASSERT_TRUE(bus_->try_read(feedback));
  }
}

TEST_P(CanJointBusTest, Read_ReplyThatHasWaited_IsCountedAndNotFresh) {
  write();
  answer_all(0.5);
  JointFeedback feedback;
  ASSERT_TRUE(bus_->try_read(feedback));
  write();
  const auto arrive = [this](std::size_t joint, std::int64_t stamp_ns) {
    CanFrame frame = reply_of(joint, 0.9);
    frame.stamp_ns = stamp_ns;
    channels_[table_.drives[joint].bus].incoming.push_back(frame);
  };
  arrive(0, now_ns_ + 300'000);
  arrive(1, now_ns_ - 2 * kBusCycle_ns);
  arrive(2, now_ns_ - 2 * kBusCycle_ns - 1);
  arrive(3, 1);
  arrive(4, 0);                         // none: unknown, and fresh
  arrive(5, now_ns_ + 3600 * kNsPerS);  // of another clock: as if it had none
  CanFrame feet;
  feet.id = 0x60;
  feet.length = 4;
  feet.stamp_ns = now_ns_ - 10 * kBusCycle_ns;
  channels_[0].incoming.push_back(feet);
  ASSERT_TRUE(bus_->try_read(feedback));
  EXPECT_EQ(feedback.stamp_ns, now_ns_) << "the command's, whatever the frames'";
  for (const std::size_t n : {0U, 1U, 4U, 5U}) {
    EXPECT_EQ(feedback.silent_cycles[n], 0) << n;
    EXPECT_NEAR(feedback.q_rad[static_cast<Eigen::Index>(n)], 0.9, 2e-4) << n;
  }
  for (const std::size_t n : {2U, 3U}) {
    EXPECT_EQ(feedback.silent_cycles[n], 1) << n;
    EXPECT_NEAR(feedback.q_rad[static_cast<Eigen::Index>(n)], 0.5, 2e-4) << n;
  }
  EXPECT_EQ(feedback.foot_force_n[0], 270.0) << "as it was told last";
  EXPECT_EQ(bus_->status().stale, 3U);
  EXPECT_EQ(bus_->status().bad_frames + bus_->status().unknown_ids, 0U);
}

TEST_P(CanJointBusTest, Read_NothingAnswersAfterTheStart_FeetAreSilentToo) {
  JointFeedback feedback;
  EXPECT_FALSE(bus_->try_read(feedback));
  EXPECT_FALSE(bus_->status().feet_silent) << "nobody was asked yet";
  write();
  EXPECT_FALSE(bus_->try_read(feedback));
  EXPECT_TRUE(bus_->status().feet_silent);
}

TEST(BusLoad, ThreeDrivesAt1MbitPerS_Take41Percent) {
  DriveTable table = table_of(MitReplyRule::kId);
  EXPECT_NEAR(bus_load(table, 1), 0.405, 1e-9);
  EXPECT_GT(bus_load(table, 0), bus_load(table, 1)) << "the feet's, too";
  for (CanDrive& drive : table.drives) drive.bus = 0;
  EXPECT_GT(bus_load(table, 0), 1.0);
}

}  // namespace
}  // namespace polygmap::hal
