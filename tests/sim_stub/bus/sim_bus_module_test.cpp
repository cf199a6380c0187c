// SPDX-License-Identifier: Apache-2.0
// The module on the simulated buses: it arms, runs, and each injected fault of a bus or drive ends in its named state.
#include <gtest/gtest.h>

#include <memory>
#include <string_view>

#include "firmware/pipeline.hpp"
#include "firmware/schedule.hpp"
#include "sim_stub/bus/bus_robot.hpp"

namespace polygmap::sim {
namespace {

// Sees nothing and stands.
class BusModuleTest : public testing::TestWithParam<const char*> {
 protected:
  BusModuleTest() {
    SimOptions options;
    options.camera.threaded = false;
    options.camera.blank = {{0, INT64_MAX}};
    robot_ = std::make_unique<SimRobot>(options);
    const config::BusFile file = config::read_bus(std::string(POLYGMAP_BUSES) + "/" + GetParam() + ".toml");
    Params params;
    params.gait.standing.start_patience_ticks = 100000;  // it waits for stairs
    params.estimator.rest_ns = 0;                        // nor does it listen before it asks the drives
    config::limit_by_drives(file, params.robot);
    bus_ = std::make_unique<BusRobot>(*robot_, file, nullptr);
    pipeline_ = std::make_unique<Pipeline>(Ports{*robot_, *robot_, bus_->joints(), *robot_}, params);
    executive_ = std::make_unique<OneLaneExecutive<>>(*pipeline_, *robot_, pipeline_->lane_health(0));
    executive_->start(robot_->now_ns() + kCycle_ns);
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      bus_->advance();
      executive_->tick(robot_->now_ns());
    }
  }
  void stand() {
    run(900);
    ASSERT_TRUE(control().state().initialised);
    ASSERT_TRUE(is_running(control().module_state()));
    for (const Fault fault : {Fault::kJointFeedbackMissing, Fault::kJointFeedbackRejected, Fault::kJointCommandRefused,
                              Fault::kStateStale}) {
      ASSERT_EQ(count(fault), 0U) << name_of(fault);
    }
    for (const auto& line : kFaultTable) {
      if (line.number() < static_cast<int>(Fault::kDriveSilent)) continue;
      ASSERT_EQ(count(line.code), 0U) << line.name;
    }
  }
  void expect_safe_stop(StopReason reason = StopReason::kStateStale) {
    EXPECT_EQ(control().module_state(), ModuleState::kSafeStop);
    EXPECT_EQ(control().gait_status().stop_reason, reason);
    EXPECT_TRUE(robot_->truth().in_contact[0] && robot_->truth().in_contact[1]);
    EXPECT_FALSE(robot_->truth().fell);
  }
  [[nodiscard]] const ControlLane& control() const { return pipeline_->control(); }
  [[nodiscard]] std::uint32_t count(Fault fault) const { return pipeline_->health().count(fault).count; }

  std::unique_ptr<SimRobot> robot_;
  std::unique_ptr<BusRobot> bus_;
  std::unique_ptr<Pipeline> pipeline_;
  std::unique_ptr<OneLaneExecutive<>> executive_;
};

INSTANTIATE_TEST_SUITE_P(, BusModuleTest, testing::Values("cubemars", "damiao"));

TEST_P(BusModuleTest, Start_ArmsThenRunsWithGainsWithinTheDrives) {
  run(1);
  EXPECT_EQ(control().module_state(), ModuleState::kArming);
  EXPECT_EQ(control().last_command().joints[0].kp_nmprad, 0.0);
  run(3);
  EXPECT_TRUE(is_running(control().module_state()));
  ASSERT_NO_FATAL_FAILURE(stand());
  for (const JointSetpoint& joint : control().last_command().joints) {
    EXPECT_GT(joint.kp_nmprad, 0.0);
    EXPECT_LE(joint.kp_nmprad, 500.0);
    EXPECT_LE(joint.kd_nmsprad, 5.0);
  }
  EXPECT_EQ(bus_->joints().status().clamped, 0U);
  EXPECT_FALSE(robot_->truth().fell);
}

TEST_P(BusModuleTest, OneDriveMissingAtTheStart_StaysArmingUntilItAnswers) {
  bus_->set_fault(8, DriveFault::kUnplugged);
  run(200);
  EXPECT_EQ(control().module_state(), ModuleState::kArming);
  EXPECT_EQ(count(Fault::kDriveSilent), 0U) << "it may take a while to start";
  run(100);
  EXPECT_EQ(control().module_state(), ModuleState::kArming);
  EXPECT_EQ(count(Fault::kDriveSilent), 1U);
  EXPECT_EQ(control().drives().silent.bits(), 1U << 8U);
  EXPECT_EQ(bus_->joints().heard().bits(), JointSet::all().bits() & ~(1U << 8U));
  bus_->set_fault(8, DriveFault::kNone);
  run(4);
  EXPECT_TRUE(is_running(control().module_state()));
}

TEST_P(BusModuleTest, DriveAnsweredOnceAndIsMuteSince_StaysArmingUntilItAnswersAgain) {
  bus_->set_fault(3, DriveFault::kUnplugged);
  run(100);
  bus_->set_fault(8, DriveFault::kUnplugged);
  run(200);
  bus_->set_fault(3, DriveFault::kNone);
  run(100);
  EXPECT_TRUE(bus_->joints().heard().is_all());
  EXPECT_EQ(control().module_state(), ModuleState::kArming);
  EXPECT_EQ(control().last_command().joints[0].kp_nmprad, 0.0);
  EXPECT_EQ(control().drives().silent.bits(), 1U << 8U);
  EXPECT_EQ(count(Fault::kDriveSilent), 2U);
  bus_->set_fault(8, DriveFault::kNone);
  run(4);
  EXPECT_TRUE(is_running(control().module_state()));
}

// Only Damiao has a frame for it; others keep the module arming until their error is gone.
TEST_P(BusModuleTest, DriveWithALatchedErrorAtPowerUp_IsClearedWhereItCanBeAndArmsAfterwards) {
  const bool can_clear = GetParam() == std::string_view("damiao");
  bus_->set_fault(8, DriveFault::kLatched);
  run(10);
  EXPECT_EQ(control().module_state(), ModuleState::kArming);
  EXPECT_EQ(control().arming_waits_for(), (ArmingWait{ArmingWait::For::kErrors, JointSet::of_bits(1U << 8U)}));
  EXPECT_GE(count(Fault::kDriveError), 1U);
  EXPECT_EQ(control().last_command().joints[0].kp_nmprad, 0.0);
  run(110);
  EXPECT_EQ(control().module_state(), can_clear ? ModuleState::kWalkingUp : ModuleState::kArming);
  bus_->set_fault(8, DriveFault::kNone);
  run(900);
  EXPECT_TRUE(is_running(control().module_state()));
  EXPECT_TRUE(control().state().initialised);
  EXPECT_GT(robot_->last_command()->joints[8].kp_nmprad, 0.0);
  EXPECT_FALSE(robot_->truth().fell);
}

TEST_P(BusModuleTest, DriveTellsAnErrorBeforeTheEstimate_Stops) {
  run(100);
  ASSERT_TRUE(is_running(control().module_state()));
  ASSERT_FALSE(control().state().initialised);
  bus_->set_fault(1, DriveFault::kError);
  run(4);
  EXPECT_EQ(control().module_state(), ModuleState::kSafeStop);
  EXPECT_EQ(control().gait_status().stop_reason, StopReason::kDriveError);
}

TEST_P(BusModuleTest, DriveSilentFor50Ms_IsNamedAndTheModuleGoesOn) {
  ASSERT_NO_FATAL_FAILURE(stand());
  bus_->set_fault(4, DriveFault::kUnplugged);
  run(25);
  EXPECT_EQ(count(Fault::kDriveSilent), 1U);
  EXPECT_TRUE(control().drives().silent.contains(4));
  bus_->set_fault(4, DriveFault::kNone);
  run(200);
  EXPECT_TRUE(control().drives().silent.is_empty());
  EXPECT_TRUE(is_running(control().module_state()));
  EXPECT_EQ(count(Fault::kDriveSilent), 1U);
}

TEST_P(BusModuleTest, DriveRestarts_IsEnteredAgainAndCommandedOn) {
  ASSERT_NO_FATAL_FAILURE(stand());
  bus_->set_fault(4, DriveFault::kDead);
  run(20);
  EXPECT_EQ(count(Fault::kDriveSilent), 1U);
  EXPECT_EQ(robot_->last_command()->joints[4].kp_nmprad, 0.0);
  bus_->set_fault(4, DriveFault::kNone);
  run(8);
  EXPECT_TRUE(control().drives().silent.is_empty());
  EXPECT_GT(robot_->last_command()->joints[4].kp_nmprad, 0.0);
  EXPECT_EQ(count(Fault::kDriveError), 0U);
  run(200);
  EXPECT_TRUE(is_running(control().module_state()));
}

TEST_P(BusModuleTest, DriveUnplugged_StopsOnTwoFeet) {
  ASSERT_NO_FATAL_FAILURE(stand());
  bus_->set_fault(3, DriveFault::kUnplugged);
  run(60);
  expect_safe_stop();
  EXPECT_TRUE(control().drives().silent.contains(3));
}

TEST_P(BusModuleTest, BusGoesOff_IsNamedAndStopsOnTwoFeet) {
  ASSERT_NO_FATAL_FAILURE(stand());
  bus_->bus(2).set_bus_off(true);
  run(60);
  expect_safe_stop(StopReason::kCommandsRefused);
  EXPECT_EQ(count(Fault::kBusOff), 1U);
  EXPECT_EQ(count(Fault::kDriveSilent), 3U);
  EXPECT_EQ(control().drives().silent.bits(), 0b111000000);
  EXPECT_GE(count(Fault::kJointCommandRefused), 58U);
}

TEST_P(BusModuleTest, FeetSilent_AreNamedAndTheJointTorquesGoOnTellingContacts) {
  ASSERT_NO_FATAL_FAILURE(stand());
  bus_->set_feet_silent(true);
  run(500);
  EXPECT_EQ(count(Fault::kFeetSilent), 1U);
  EXPECT_TRUE(is_running(control().module_state()));
  EXPECT_FALSE(robot_->truth().fell);
  const auto& force_n = control().estimator().leg_sensing().joints().foot_force_n;
  for (std::size_t foot = 0; foot < kFootCount; ++foot) {  // it sways between them
    EXPECT_NEAR(force_n[foot], 540.0 * robot_->truth().load_share[foot], 40.0);
  }
}

TEST_P(BusModuleTest, DriveTellsAnError_StopsOnTwoFeet) {
  ASSERT_NO_FATAL_FAILURE(stand());
  bus_->set_fault(1, DriveFault::kError);
  run(3);
  EXPECT_TRUE(control().drives().bus.drive_errors.contains(1));
  EXPECT_GE(count(Fault::kDriveError), 1U);
  run(20);
  EXPECT_EQ(control().module_state(), ModuleState::kSafeStop);
}

TEST_P(BusModuleTest, DriveIsTooHot_StopsOnTwoFeetAndIsNamed) {
  ASSERT_NO_FATAL_FAILURE(stand());
  EXPECT_EQ(control().drives().bus.drive_degc[7], 40);
  bus_->set_temperature(7, 89);
  run(20);
  EXPECT_TRUE(is_running(control().module_state()));
  bus_->set_temperature(7, 90);
  run(20);
  EXPECT_EQ(count(Fault::kDriveHot), 1U);
  EXPECT_EQ(control().drives().hot.bits(), 1U << 7U);
  expect_safe_stop(StopReason::kDriveHot);
}

TEST_P(BusModuleTest, QueueFullForATick_IsNamedAndTheModuleGoesOn) {
  ASSERT_NO_FATAL_FAILURE(stand());
  bus_->bus(0).set_transmit_queue(1);
  run(1);
  bus_->bus(0).set_transmit_queue(SimCanBus::kTransmitQueue);
  run(50);
  EXPECT_EQ(count(Fault::kJointCommandRefused), 1U);
  EXPECT_EQ(bus_->joints().status().refused, 2U);
  EXPECT_TRUE(is_running(control().module_state()));
}

TEST_P(BusModuleTest, ForeignFrames_AreNamedAndChangeNothing) {
  ASSERT_NO_FATAL_FAILURE(stand());
  hal::CanFrame foreign;
  foreign.id = 0x7F;
  foreign.length = 8;
  bus_->bus(1).send(foreign, robot_->now_ns());
  hal::CanFrame broken;
  broken.id = 0x60;
  broken.length = 2;
  bus_->bus(0).send(broken, robot_->now_ns());
  run(2);
  EXPECT_EQ(count(Fault::kBusUnknownId), 1U);
  EXPECT_EQ(count(Fault::kBusBadFrame), 1U);
  EXPECT_TRUE(is_running(control().module_state()));
}

}  // namespace
}  // namespace polygmap::sim
