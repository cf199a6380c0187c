// SPDX-License-Identifier: Apache-2.0
// The module on a robot that does what it is told, before stairs that it sees: sensors that fall silent, and what the
// lanes tell each other.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "firmware/pipeline.hpp"
#include "tests/support/fake_robot.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/trapped_module.hpp"

namespace polygmap {
namespace {

using test::FakeRobot;
using test::TrappedModule;

class PipelineOnARobot : public testing::Test {
 protected:
  void start(double toe_gap_m, const Params& params = {}) {
    robot_ = std::make_unique<FakeRobot>(toe_gap_m);
    module_ = std::make_unique<TrappedModule>(robot_->ports(), params, robot_->clock);
  }
  void run(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      const auto& sent = robot_->joints.commands();
      const JointCommand before = sent.empty() ? JointCommand{} : sent.newest();
      const std::uint64_t writes = robot_->joints.writes.calls();
      robot_->advance();
      module_->tick();
      if (!started_) {
        started_ = !sent.empty() && sent.newest().joints[0].kp_nmprad > 0.0;  // armed: from here on angles count
        continue;
      }
      // Whatever is silent, the drives hear of the gait every tick, and nothing jumps.
      ASSERT_EQ(robot_->joints.writes.calls(), writes + 1);
      for (std::size_t n = 0; n < kJointCount; ++n) {
        const double most_rad =
            joint_limits(static_cast<Foot>(n / kJointsPerLeg), n % kJointsPerLeg).speed_radps * 1e-6 * kCycle_us;
        ASSERT_LE(std::abs(sent.newest().joints[n].q_rad - before.joints[n].q_rad), most_rad + 1e-9) << n;
      }
    }
  }
  // Until the nth swing is in the air, or double support after it.
  [[nodiscard]] bool run_until(GaitPhase phase, std::uint32_t swing) {
    for (int i = 0; i < 6000 && !(gait().phase == phase && gait().step.sequence == swing); ++i) run(1);
    return gait().phase == phase;
  }
  [[nodiscard]] const GaitStatus& gait() const { return module_->pipeline().control().gait_status(); }
  [[nodiscard]] const ControlLane& control() const { return module_->pipeline().control(); }
  [[nodiscard]] std::uint32_t count(Fault fault) const { return module_->pipeline().health().count(fault).count; }

  // Until the first swing onto a tread begins.
  [[nodiscard]] bool reach_the_stairs() {
    while (gait().step.sequence < 6 && run_until(GaitPhase::kSwing, gait().step.sequence + 1)) {
      if (gait().step.onto_tread) return true;
    }
    return false;
  }
  // In the middle of a swing of 0.98 s onto the first tread.
  void fly() {
    start(kToeGap_m);
    ASSERT_TRUE(reach_the_stairs());
    run(150);
    ASSERT_FALSE(robot_->stands(gait().step.foot));
    ASSERT_FALSE(control().faults().any_fault());
  }
  // most_off_m: of the foot against its target on the true stairs, at touch-down.
  void expect_landed_and_stopped(double most_off_m) {
    ASSERT_TRUE(run_until(GaitPhase::kDoubleSupport, gait().step.sequence));
    const Vec3 landed_m = robot_->true_T_sole(gait().step.foot).p_m;
    EXPECT_NEAR(landed_m.z(), 0.13, most_off_m);
    EXPECT_NEAR(landed_m.x(), robot_->first_riser_x_m() + gait().step.target.nosing_distance_m, most_off_m);
    run(600);
    EXPECT_NE(gait().step.touch_down_stamp_ns, 0);
    EXPECT_TRUE(gait().stands[0] && gait().stands[1]);
    EXPECT_EQ(gait().phase, GaitPhase::kStopped);
    EXPECT_EQ(gait().stop_reason, StopReason::kStateStale);
    EXPECT_TRUE(gait().step.onto_tread);
    EXPECT_EQ(count(Fault::kStateStale), 1U);
    EXPECT_EQ(count(Fault::kGaitStopped), 1U);
    EXPECT_EQ(gait().stamp_ns, robot_->clock.now_ns());
    EXPECT_LT(std::abs(robot_->true_T_base().R(2, 2) - 1.0), 5e-4);
  }

  static constexpr double kToeGap_m = 0.062;  // one step of each foot before the stairs
  std::unique_ptr<FakeRobot> robot_;
  std::unique_ptr<TrappedModule> module_;
  bool started_ = false;
};

// One robot for all stages: the estimator's lengths, the balance's masses.
TEST_F(PipelineOnARobot, AnotherRobotInParams_EstimatorAndBalanceFollow) {
  constexpr double kLonger_m = 0.02, kHeavier_kg = 20.0;
  const auto stand = [&](const Params& params) {
    start(0.2, params);
    started_ = false;
    run(400);
  };
  stand({});
  const double height_m = control().state().odom_T_base.p_m.z();
  const double knee_nm = control().last_command().joints[kKnee].tau_ff_nm;
  Params params;
  params.robot.legs.shank_m += kLonger_m;
  params.robot.masses.torso.mass_kg += kHeavier_kg;
  params.estimator.legs.forces.torque_scale.most = 0.0;  // or its drives feel that it is no heavier
  stand(params);
  EXPECT_NEAR(control().state().odom_T_base.p_m.z() - height_m, kLonger_m, 0.5 * kLonger_m);
  EXPECT_GT(std::abs(control().last_command().joints[kKnee].tau_ff_nm), 1.2 * std::abs(knee_nm));
}

TEST_F(PipelineOnARobot, JointsFallSilentInSwing_FootComesDownAsPlannedAndTheGaitStops) {
  ASSERT_NO_FATAL_FAILURE(fly());
  robot_->joints_speak = false;
  expect_landed_and_stopped(0.003);
  EXPECT_GT(count(Fault::kJointFeedbackMissing), 600U);
  EXPECT_EQ(count(Fault::kImuMissing), 0U);
  EXPECT_EQ(control().state().stamp_ns, robot_->clock.now_ns());
}

// Of a Livox Mid-360: in three of five cycles nothing comes, and nothing is missing.
TEST_F(PipelineOnARobot, ImuSlowerThanACycle_IsMissingOnlyWhenASampleIsDue) {
  Params params;
  params.imu_interval_ns = 5 * kNsPerMs;
  start(kToeGap_m, params);
  robot_->imu_interval_ns = params.imu_interval_ns;
  ASSERT_TRUE(reach_the_stairs());
  EXPECT_EQ(count(Fault::kImuMissing), 0U);
  EXPECT_FALSE(control().faults().any_fault());
  robot_->imu_speaks = false;
  const std::int64_t newest_ns = control().estimator().newest_imu_ns();
  const std::int64_t read_ns = (newest_ns + kCycle_ns - 1) / kCycle_ns * kCycle_ns;
  for (int i = 0; i < 10 && count(Fault::kImuMissing) == 0; ++i) run(1);
  EXPECT_EQ(robot_->clock.now_ns() - read_ns, 4 * kCycle_ns);  // the first to begin 5 ms and a cycle after that one
  run(10);
  EXPECT_EQ(count(Fault::kImuMissing), 11U);
  robot_->imu_speaks = true;
  run(100);
  EXPECT_LE(count(Fault::kImuMissing), 13U);  // until the next one ends
}

// Nothing comes in every other cycle.
TEST_F(PipelineOnARobot, ImuSlowerThanTheModuleIsTold_IsMissingAllTheTime) {
  start(kToeGap_m);
  robot_->imu_interval_ns = 4 * kNsPerMs;
  run(100);
  EXPECT_GE(count(Fault::kImuMissing), 48U);
  EXPECT_LE(count(Fault::kImuMissing), 50U);
}

TEST_F(PipelineOnARobot, ImuSilentFromTheStart_IsMissingFromWhenItWasDue) {
  Params params;
  params.imu_interval_ns = 5 * kNsPerMs;
  start(kToeGap_m, params);
  robot_->imu_speaks = false;
  run(4);
  EXPECT_EQ(count(Fault::kImuMissing), 0U);
  run(1);
  EXPECT_EQ(count(Fault::kImuMissing), 1U);
}

TEST_F(PipelineOnARobot, ImuFallsSilentInSwing_FootComesDownAndTheGaitStops) {
  ASSERT_NO_FATAL_FAILURE(fly());
  robot_->imu_speaks = false;
  expect_landed_and_stopped(0.003);
  EXPECT_GT(count(Fault::kImuMissing), 600U);
  EXPECT_EQ(count(Fault::kJointFeedbackMissing), 0U);
  EXPECT_EQ(control().state().stamp_ns, robot_->clock.now_ns());
}

// Eleven drives are heard and commanded; the twelfth's leg is no measurement. A drive that is silent counts as one that
// holds: a knee in the air is asked to, and its foot lands short.
TEST_F(PipelineOnARobot, OneDriveFallsSilentInSwing_FootComesDownAsPlannedAndTheGaitStops) {
  for (const bool of_the_swing_leg : {true, false}) {
    ASSERT_NO_FATAL_FAILURE(fly());
    const Foot leg = of_the_swing_leg ? gait().step.foot : other(gait().step.foot);
    robot_->silent_joint = joint_index(leg, kKnee);
    expect_landed_and_stopped(of_the_swing_leg ? 0.06 : 0.004);
    EXPECT_EQ(count(Fault::kDriveSilent), 1U);
    EXPECT_EQ(count(Fault::kJointFeedbackMissing), 0U);
    EXPECT_EQ(count(Fault::kJointFeedbackRejected), 0U);
    EXPECT_TRUE(control().drives().silent.contains(robot_->silent_joint));
    EXPECT_EQ(control().module_state(), ModuleState::kSafeStop);
    started_ = false;
  }
}

TEST_F(PipelineOnARobot, OneDriveSilentFor50MsInSwing_ClimbGoesOn) {
  ASSERT_NO_FATAL_FAILURE(fly());
  robot_->silent_joint = joint_index(other(gait().step.foot), kHipPitch);
  run(25);
  robot_->silent_joint = kJointCount;
  run(1);
  EXPECT_TRUE(control().drives().silent.is_empty());
  EXPECT_FALSE(control().drives().ever_silent.is_empty());
  ASSERT_TRUE(run_until(GaitPhase::kSwing, gait().step.sequence + 1));
  EXPECT_EQ(count(Fault::kDriveSilent), 1U);
  EXPECT_TRUE(is_running(control().module_state()));
}

TEST_F(PipelineOnARobot, OneDriveSilentForAFewCycles_NothingIsRaisedAndTheClimbGoesOn) {
  ASSERT_NO_FATAL_FAILURE(fly());
  for (int gap = 0; gap < 5; ++gap) {
    robot_->silent_joint = joint_index(gap % 2 == 0 ? Foot::kLeft : Foot::kRight, kKnee);
    run(1 + gap);
    robot_->silent_joint = kJointCount;
    run(3);
  }
  EXPECT_FALSE(control().faults().any_fault());
  ASSERT_TRUE(run_until(GaitPhase::kSwing, gait().step.sequence + 1));
}

TEST_F(PipelineOnARobot, OneDriveSilentOnTwoFeet_StopsWithinATenthOfASecond) {
  start(kToeGap_m);
  ASSERT_TRUE(run_until(GaitPhase::kDoubleSupport, 0));
  run(20);
  robot_->silent_joint = joint_index(Foot::kLeft, kHipRoll);
  run(55);
  EXPECT_EQ(gait().phase, GaitPhase::kStopped);
  EXPECT_EQ(gait().stop_reason, StopReason::kStateStale);
}

TEST_F(PipelineOnARobot, DriveTellsAnErrorInSwing_StepIsFinishedThenTheGaitStops) {
  ASSERT_NO_FATAL_FAILURE(fly());
  robot_->joints.told.drive_errors.insert(7);
  robot_->joints.told.drive_error_replies = 1;
  ASSERT_TRUE(run_until(GaitPhase::kStopped, gait().step.sequence));
  EXPECT_NE(gait().step.touch_down_stamp_ns, 0);
  EXPECT_EQ(count(Fault::kDriveError), 1U);
  EXPECT_EQ(control().module_state(), ModuleState::kSafeStop);
}

TEST_F(PipelineOnARobot, BothFallSilentInSwing_FootComesDownAsPlannedAndTheGaitStops) {
  ASSERT_NO_FATAL_FAILURE(fly());
  robot_->imu_speaks = robot_->joints_speak = false;
  const std::int64_t last_ns = robot_->clock.now_ns();
  expect_landed_and_stopped(0.004);
  EXPECT_EQ(control().state().stamp_ns, last_ns);
}

TEST_F(PipelineOnARobot, ImuSilentForAMomentInSwing_ClimbGoesOn) {
  ASSERT_NO_FATAL_FAILURE(fly());
  robot_->imu_speaks = false;
  run(40);
  robot_->imu_speaks = true;
  ASSERT_TRUE(run_until(GaitPhase::kSwing, gait().step.sequence + 1));
}

TEST_F(PipelineOnARobot, JointsSilentOnTwoFeet_StopsWithinATenthOfASecond) {
  start(kToeGap_m);
  ASSERT_TRUE(run_until(GaitPhase::kDoubleSupport, 0));
  run(20);
  robot_->joints_speak = false;
  run(55);
  EXPECT_EQ(gait().phase, GaitPhase::kStopped);
  EXPECT_EQ(gait().stop_reason, StopReason::kStateStale);
  run(500);
  EXPECT_EQ(gait().step.sequence, 0U);
}

TEST_F(PipelineOnARobot, CameraFallsSilentBeforeTheStep_StopsWithAStaleMap) {
  start(kToeGap_m);
  ASSERT_TRUE(run_until(GaitPhase::kDoubleSupport, 0));
  robot_->camera_speaks = false;
  run(3000);
  EXPECT_EQ(gait().phase, GaitPhase::kStopped);
  EXPECT_EQ(gait().stop_reason, StopReason::kMapStale);
  EXPECT_EQ(count(Fault::kMapStale), 1U);
  EXPECT_EQ(gait().step.sequence, 0U);
}

// The target's height of a step on the floor is the estimator's own; a tread's is the map's.
TEST_F(PipelineOnARobot, TouchDown_OnlyATreadsHeightIsNews) {
  start(kToeGap_m);
  ASSERT_TRUE(reach_the_stairs());
  EXPECT_GT(gait().step.sequence, 1U);
  EXPECT_EQ(control().estimator().counters().height_taken, 0U);
  ASSERT_TRUE(run_until(GaitPhase::kDoubleSupport, gait().step.sequence));
  EXPECT_EQ(control().estimator().counters().height_taken, 1U);
}

// Hips and ankles that are off in roll by as much: the module finds all of it, and its commands hold where it is.
TEST_F(PipelineOnARobot, EncodersOffAgainstEachOther_FeetAreWhereTheModuleHasThem) {
  start(kToeGap_m);
  for (const std::size_t joint : {std::size_t{kHipRoll}, std::size_t{kAnkleRoll}}) {
    robot_->encoder_offset_rad[static_cast<Eigen::Index>(joint_index(Foot::kLeft, joint))] = 2e-3;
    robot_->encoder_offset_rad[static_cast<Eigen::Index>(joint_index(Foot::kRight, joint))] = -2e-3;
  }
  ASSERT_TRUE(run_until(GaitPhase::kSwing, 1));
  const auto right_p_left_m = [](const Transform& left, const Transform& right) {
    return (right.inverse() * left).p_m;
  };
  const auto& sole = control().state().odom_T_sole;
  const auto& desired = gait().odom_T_sole_desired;
  const Vec3 true_m = right_p_left_m(robot_->true_T_sole(Foot::kLeft), robot_->true_T_sole(Foot::kRight));
  EXPECT_LT((right_p_left_m(sole[0], sole[1]) - true_m).norm(), 5e-4);  // 3 mm before they are found
  EXPECT_LT((right_p_left_m(desired[0], desired[1]) - true_m).norm(), 8e-4);
}

TEST_F(PipelineOnARobot, TreadElsewhereThanTheSoleOnIt_IsCounted) {
  Params params;
  params.estimator.max_height_error_m = 0.0;
  start(kToeGap_m, params);
  ASSERT_TRUE(reach_the_stairs());
  EXPECT_EQ(module_->pipeline().health().count(Limit::kHeightRejected).count, 0U);
  ASSERT_TRUE(run_until(GaitPhase::kDoubleSupport, gait().step.sequence));
  run(2);
  EXPECT_EQ(module_->pipeline().health().count(Limit::kHeightRejected).count, 1U);
}

TEST_F(PipelineOnARobot, PoseOfAFrameIsUncertain_MapKnows) {
  Params params;
  params.estimator.filter.gyro_noise_radprs = 0.1;
  params.estimator.filter.sole_sigma_rad = 0.1;
  params.estimator.filter.accel_noise_mpsrs = 3.0;  // gravity tells less
  start(kToeGap_m, params);
  run(1000);
  const double tilt_sigma_rad = control().state().tilt_sigma_rad;
  EXPECT_GT(tilt_sigma_rad, 0.02);
  ASSERT_FALSE(module_->pipeline().perception().map_snapshot().polygons.empty());
  for (const MapPolygon& polygon : module_->pipeline().perception().map_snapshot().polygons) {
    EXPECT_GT(polygon.surface.tilt_sigma_rad, 0.8 * tilt_sigma_rad);  // it has grown since the frame
  }
}

TEST_F(PipelineOnARobot, MountIsUncertain_EdgesAre) {
  Params params;
  start(kToeGap_m, params);
  run(1000);
  const PerceptionLane& perception = module_->pipeline().perception();
  const double learnt_rad = perception.mount().tilt_sigma_rad();
  EXPECT_LT(learnt_rad, 0.5 * params.mount.prior.tilt_sigma_rad);
  int edges = 0;
  for (const MapPolygon& polygon : perception.map_snapshot().polygons) {
    if (!polygon.surface.nosing.valid) continue;
    ++edges;
    EXPECT_GT(polygon.surface.nosing.sigma_m, 0.4 * learnt_rad);  // the camera is higher than that
  }
  EXPECT_GT(edges, 0);
}

}  // namespace
}  // namespace polygmap
