// SPDX-License-Identifier: Apache-2.0
// The bus in memory: its time, its arbitration, its queues; and the robot behind it.
#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "hal/codec/can_bits.hpp"
#include "sim_stub/bus/bus_robot.hpp"
#include "sim_stub/bus/candump_log.hpp"
#include "sim_stub/sensors/virtual_clock.hpp"

namespace polygmap::sim {
namespace {

hal::CanFrame frame_of(std::uint32_t id, std::uint8_t byte = 0x55) {
  hal::CanFrame frame;
  frame.id = id;
  frame.length = 8;
  frame.data.fill(byte);
  return frame;
}

struct Observed {
  std::vector<hal::CanFrame> on_bus, at_nodes;
  void run(SimCanBus& bus, std::int64_t from_ns, std::int64_t to_ns) {
    bus.run(
        from_ns, to_ns, [this](const hal::CanFrame& frame, std::int64_t) { at_nodes.push_back(frame); },
        [this](const hal::CanFrame& frame) { on_bus.push_back(frame); });
  }
};

TEST(SimCanBus, FramesTakeTheirBits) {
  SimCanBus bus(1'000'000);
  const std::array frames{frame_of(1), frame_of(2)};
  ASSERT_EQ(bus.write(frames), 2U);
  Observed seen;
  seen.run(bus, 0, 2'000'000);
  ASSERT_EQ(seen.on_bus.size(), 2U);
  const auto bits = static_cast<std::int64_t>(hal::frame_bits(frames[0]));
  EXPECT_EQ(seen.on_bus[0].stamp_ns, 1000 * bits);
  EXPECT_EQ(seen.on_bus[1].stamp_ns, 1000 * (bits + static_cast<std::int64_t>(hal::frame_bits(frames[1]))));
  SimCanBus slow(500'000);
  ASSERT_EQ(slow.write(frames), 2U);
  Observed slowly;
  slowly.run(slow, 0, 2'000'000);
  EXPECT_EQ(slowly.on_bus[0].stamp_ns, 2000 * bits);
}

TEST(SimCanBus, LowestIdentifierGoesFirst_ButInterruptsNone) {
  SimCanBus bus(1'000'000);
  const std::array frames{frame_of(5), frame_of(6)};
  ASSERT_EQ(bus.write(frames), 2U);
  bus.send(frame_of(7), 0);
  bus.send(frame_of(3), 50'000);  // while 5 is on the bus
  Observed seen;
  seen.run(bus, 0, 2'000'000);
  std::vector<std::uint32_t> ids;
  for (const auto& frame : seen.on_bus) ids.push_back(frame.id);
  EXPECT_EQ(ids, (std::vector<std::uint32_t>{5, 3, 6, 7}));
  std::array<hal::CanFrame, 4> got;
  ASSERT_EQ(bus.read(got), 2U);
  EXPECT_EQ(got[0].id, 3U);
  EXPECT_EQ(got[1].id, 7U);
  EXPECT_EQ(bus.status().sent, 2U);
  EXPECT_EQ(bus.status().received, 2U);
}

TEST(SimCanBus, FrameAcrossTheEnd_ArrivesNextTime) {
  SimCanBus bus(1'000'000);
  ASSERT_EQ(bus.write(std::array{frame_of(5)}), 1U);
  Observed seen;
  seen.run(bus, 0, 50'000);
  EXPECT_TRUE(seen.on_bus.empty());
  seen.run(bus, 50'000, 2'000'000);
  ASSERT_EQ(seen.on_bus.size(), 1U);
  EXPECT_EQ(seen.on_bus[0].stamp_ns, 1000 * static_cast<std::int64_t>(hal::frame_bits(frame_of(5))));
}

TEST(SimCanBus, FullQueue_RefusesAndCounts) {
  SimCanBus bus(1'000'000);
  std::vector<hal::CanFrame> frames(SimCanBus::kTransmitQueue + 3, frame_of(1));
  EXPECT_EQ(bus.write(frames), SimCanBus::kTransmitQueue);
  EXPECT_EQ(bus.status().refused, 3U);
  bus.set_transmit_queue(0);
  EXPECT_EQ(bus.write(std::array{frame_of(1)}), 0U);
  EXPECT_EQ(bus.status().refused, 4U);
}

TEST(SimCanBus, NobodyReads_TheNewestAreLostAndCounted) {
  SimCanBus bus(1'000'000);
  for (std::size_t i = 0; i < SimCanBus::kReceiveQueue + 5; ++i) bus.send(frame_of(1), 0);
  Observed seen;
  seen.run(bus, 0, kNsPerS);
  EXPECT_EQ(bus.status().lost, 5U);
}

TEST(SimCanBus, BusOff_NothingIsSentOrHeard) {
  SimCanBus bus(1'000'000);
  ASSERT_EQ(bus.write(std::array{frame_of(1)}), 1U);
  bus.set_bus_off(true);
  EXPECT_TRUE(bus.status().bus_off);
  EXPECT_EQ(bus.write(std::array{frame_of(1)}), 0U);
  bus.send(frame_of(2), 0);
  Observed seen;
  seen.run(bus, 0, 2'000'000);
  EXPECT_TRUE(seen.on_bus.empty());
  bus.set_bus_off(false);
  ASSERT_EQ(bus.write(std::array{frame_of(3)}), 1U);
  seen.run(bus, 2'000'000, 4'000'000);
  ASSERT_EQ(seen.on_bus.size(), 1U);
  EXPECT_EQ(seen.on_bus[0].id, 3U);
}

TEST(Candump, Line_IsWhatCanplayerReads) {
  hal::CanFrame frame = frame_of(0x7, 0xAB);
  frame.length = 3;
  frame.stamp_ns = 12 * kNsPerS + 345'678'901;
  EXPECT_EQ(candump_line(frame, "can2"), "(0000000012.345678) can2 007#ABABAB");
}

class BusRobotTest : public testing::Test {
 protected:
  BusRobotTest() {
    SimOptions options;
    options.camera.threaded = false;
    robot_.emplace(options);
    file_ = config::read_bus(std::string(POLYGMAP_BUSES) + "/damiao.toml");
    bus_.emplace(*robot_, file_, nullptr);
  }
  JointSet write(double kp) {
    JointCommand command;
    command.stamp_ns = robot_->now_ns();
    for (std::size_t n = 0; n < kJointCount; ++n) {
      command.joints[n] = {q_rad_[static_cast<Eigen::Index>(n)], 0.0, 0.0, kp, 4.0};
    }
    return bus_->joints().try_write(command);
  }

  std::optional<SimRobot> robot_;
  config::BusFile file_;
  std::optional<BusRobot> bus_;
  JointVector q_rad_ = JointVector::Constant(0.1);
};

TEST_F(BusRobotTest, CommandOfACycle_IsAnsweredInTheNextWithTheJointAsItWas) {
  ASSERT_TRUE(write(0.0).is_all());
  JointFeedback feedback;
  EXPECT_FALSE(bus_->joints().try_read(feedback)) << "no time has passed";
  const JointVector then = robot_->plant().drive_q_rad();
  const std::int64_t then_ns = robot_->now_ns();
  bus_->advance();
  ASSERT_TRUE(bus_->joints().try_read(feedback));
  EXPECT_EQ(feedback.stamp_ns, then_ns);
  EXPECT_LT((feedback.q_rad - then).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_TRUE(bus_->joints().heard().is_all());
  EXPECT_GT(feedback.foot_force_n[0], 100.0);
  for (const std::uint16_t silent : feedback.silent_cycles) EXPECT_EQ(silent, 0);
}

TEST_F(BusRobotTest, Commands_ReachTheRobotOnceAllDrivesAreInMotorMode) {
  ASSERT_TRUE(write(300.0).is_all());
  bus_->advance();
  EXPECT_FALSE(robot_->last_command()) << "entered, not commanded";
  JointFeedback feedback;
  ASSERT_TRUE(bus_->joints().try_read(feedback));
  ASSERT_TRUE(write(300.0).is_all());
  bus_->advance();
  ASSERT_TRUE(robot_->last_command());
  EXPECT_NEAR(robot_->last_command()->joints[7].kp_nmprad, 300.0, 0.07);
  EXPECT_NEAR(robot_->last_command()->joints[7].q_rad, 0.1, 2e-4);
}

TEST_F(BusRobotTest, DeadDrive_IsSilentAndLimp) {
  JointFeedback feedback;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(write(300.0).is_all());
    bus_->advance();
    ASSERT_TRUE(bus_->joints().try_read(feedback));
  }
  bus_->set_fault(2, DriveFault::kDead);
  bus_->set_fault(3, DriveFault::kUnplugged);
  for (std::uint16_t i = 1; i <= 4; ++i) {
    ASSERT_TRUE(write(200.0).is_all());
    bus_->advance();
    ASSERT_TRUE(bus_->joints().try_read(feedback));
    EXPECT_EQ(feedback.silent_cycles[2], i);
    EXPECT_EQ(feedback.silent_cycles[3], i);
    EXPECT_EQ(feedback.silent_cycles[4], 0);
  }
  EXPECT_EQ(robot_->last_command()->joints[2].kp_nmprad, 0.0);
  EXPECT_NEAR(robot_->last_command()->joints[3].kp_nmprad, 300.0, 0.07) << "as it was told last";
  EXPECT_NEAR(robot_->last_command()->joints[4].kp_nmprad, 200.0, 0.07);
}

TEST_F(BusRobotTest, ExitFrame_LetsGo) {
  JointFeedback feedback;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(write(300.0).is_all());
    bus_->advance();
    ASSERT_TRUE(bus_->joints().try_read(feedback));
  }
  for (const hal::CanDrive& drive : file_.table.drives) {
    hal::CanFrame exit = frame_of(drive.id);
    std::ranges::copy(hal::special_frame(hal::MitSpecial::kExit), exit.data.begin());
    ASSERT_EQ(bus_->bus(drive.bus).write(std::array{exit}), 1U);
  }
  bus_->advance();
  EXPECT_EQ(robot_->last_command()->joints[0].kp_nmprad, 0.0);
  ASSERT_TRUE(bus_->joints().try_read(feedback));
  EXPECT_FALSE(bus_->joints().status().drive_errors.is_empty()) << "a drive out of motor mode tells so";
}

}  // namespace
}  // namespace polygmap::sim
