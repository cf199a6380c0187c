// SPDX-License-Identifier: Apache-2.0
// The wiring, on fakes: every fault that firmware raises, raised; no heap call; static memory within its budget.
#include "firmware/pipeline.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <vector>

#include "algorithms/robot/leg_kinematics.hpp"
#include "scheduler/cyclic_executive.hpp"
#include "sim_stub/heap_trap.hpp"
#include "tests/support/fakes/fake_clock.hpp"
#include "tests/support/fakes/fake_depth_camera.hpp"
#include "tests/support/fakes/fake_imu.hpp"
#include "tests/support/fakes/fake_joint_bus.hpp"
#include "tests/support/fakes/fake_lidar_odometry.hpp"

namespace polygmap {
namespace {

// A robot that stands still on level floor, fed by hand.
class PipelineTest : public testing::Test {
 protected:
  PipelineTest() : camera_(robot_camera_intrinsics()) {
    for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
      const Transform sole{Mat3::Identity(), Vec3{0, side_sign(foot) * kStanceHalfWidth_m, -kNominalBaseHeight_m}};
      standing_q_rad_.segment<6>(static_cast<Eigen::Index>(joint_index(foot, 0))) = solve_leg({}, foot, sole).q_rad;
    }
    pipeline_ = std::make_unique<Pipeline>(Ports{camera_, imu_, joints_, lidar_}, Params{});
    executive_ = std::make_unique<Executive>(*pipeline_, clock_, health_);
    executive_->start(clock_.now_ns() + kMinorFrame_ns);
  }

  [[nodiscard]] ImuSample imu_at(std::int64_t stamp_ns) const {
    return {stamp_ns, Vec3::Zero(), Vec3{0, 0, kGravity_mps2}};
  }
  [[nodiscard]] JointFeedback joints_at(std::int64_t stamp_ns) const {
    JointFeedback feedback;
    feedback.stamp_ns = stamp_ns;
    feedback.q_rad = standing_q_rad_;
    feedback.foot_force_n = {270.0, 270.0};
    return feedback;
  }
  void tick_with(const ImuSample* imu, const JointFeedback* joints) {
    if (imu != nullptr) imu_.feed(*imu);
    if (joints != nullptr) joints_.feed(*joints);
    const heap::ModuleCall call("CyclicExecutive::tick");
    executive_->tick(clock_.now_ns());
  }
  void stand(int ticks) {
    for (int i = 0; i < ticks; ++i) {
      clock_.advance_ns(kMinorFrame_ns);
      const ImuSample imu = imu_at(clock_.now_ns());
      const JointFeedback joints = joints_at(clock_.now_ns());
      tick_with(&imu, &joints);
    }
  }
  [[nodiscard]] std::uint32_t control(Fault fault) const { return pipeline_->control().faults().count(fault).count; }
  [[nodiscard]] std::uint32_t perception(Fault fault) const {
    return pipeline_->perception().faults().count(fault).count;
  }

  using Executive = CyclicExecutive<Pipeline, kOneLaneSchedule>;
  static constexpr int kInitialised_ticks = 700;  // the standstill takes a second

  fakes::FakeClock clock_;
  fakes::FakeDepthCamera camera_;
  fakes::FakeImu imu_;
  fakes::FakeJointBus joints_;
  fakes::FakeLidarOdometry lidar_;
  Health health_;
  JointVector standing_q_rad_ = JointVector::Zero();
  std::unique_ptr<Pipeline> pipeline_;
  std::unique_ptr<Executive> executive_;
};

TEST_F(PipelineTest, StandingStill_InitialisesCommandsAndRaisesNothingOfControl) {
  stand(kInitialised_ticks);
  EXPECT_TRUE(pipeline_->control().state().initialised);
  EXPECT_FALSE(pipeline_->control().faults().any_fault());
  const JointCommand& command = pipeline_->control().last_command();
  for (std::size_t j = 0; j < kJointCount; ++j) {
    EXPECT_NEAR(command.joints[j].q_rad, standing_q_rad_[static_cast<Eigen::Index>(j)], 0.05) << j;
  }
}

TEST_F(PipelineTest, SensorsSilent_AreCountedAsMissing) {
  stand(10);
  clock_.advance_ns(kMinorFrame_ns);
  tick_with(nullptr, nullptr);
  EXPECT_EQ(control(Fault::kImuMissing), 1U);
  EXPECT_EQ(control(Fault::kJointFeedbackMissing), 1U);
}

TEST_F(PipelineTest, SensorsNotFinite_AreRejectedAndTheCommandStaysFinite) {
  stand(kInitialised_ticks);
  clock_.advance_ns(kMinorFrame_ns);
  ImuSample imu = imu_at(clock_.now_ns());
  imu.gyro_radps.x() = std::numeric_limits<double>::quiet_NaN();
  JointFeedback joints = joints_at(clock_.now_ns());
  joints.q_rad[3] = std::numeric_limits<double>::infinity();
  tick_with(&imu, &joints);
  EXPECT_EQ(control(Fault::kImuRejected), 1U);
  EXPECT_EQ(control(Fault::kJointFeedbackRejected), 1U);
  EXPECT_EQ(control(Fault::kJointCommandInvalid), 0U);
  for (const JointSetpoint& joint : pipeline_->control().last_command().joints) {
    EXPECT_TRUE(std::isfinite(joint.q_rad) && std::isfinite(joint.dq_radps));
  }
}

TEST_F(PipelineTest, BusRefusesTheCommand_IsCounted) {
  stand(10);
  joints_.writes.fail_next();
  stand(1);
  EXPECT_EQ(control(Fault::kJointCommandRefused), 1U);
}

TEST_F(PipelineTest, LidarFromTheFuture_IsRejected) {
  stand(kInitialised_ticks);
  LioSample sample;
  sample.stamp_ns = clock_.now_ns() + kNsPerS;
  sample.position_sigma_m = Vec3::Constant(0.01);
  sample.rotation_sigma_rad = Vec3::Constant(0.003);
  lidar_.feed(sample);
  stand(1);
  EXPECT_EQ(control(Fault::kLioRejected), 1U);
}

TEST_F(PipelineTest, LidarFallsSilent_IsMissingOnce) {
  stand(kInitialised_ticks);
  LioSample sample;
  sample.stamp_ns = clock_.now_ns() - 50 * kNsPerMs;
  sample.lio_T_lidar = Transform{Mat3::Identity(), Vec3{0, 0, kNominalBaseHeight_m}} * base_T_lidar();
  sample.position_sigma_m = Vec3::Constant(0.01);
  sample.rotation_sigma_rad = Vec3::Constant(0.003);
  lidar_.feed(sample);
  stand(1500);
  EXPECT_EQ(control(Fault::kLioMissing), 1U);
}

TEST_F(PipelineTest, CameraSilent_IsMissing) {
  stand(kInitialised_ticks);
  EXPECT_GE(perception(Fault::kDepthMissing), 1U);
}

TEST_F(PipelineTest, FrameOfTheRobotsFuture_HasNoPoseAndIsGivenBack) {
  stand(kInitialised_ticks);
  const std::vector<std::uint16_t> blank(camera_.pixels(), 0);
  camera_.feed(clock_.now_ns() + kNsPerS, blank);
  stand(4);
  EXPECT_EQ(pipeline_->control().faults().count(Limit::kStateRingMissed).count, 1U);
  EXPECT_FALSE(camera_.holding());
}

TEST_F(PipelineTest, FrameOutOfOrder_IsRejectedAndGivenBack) {
  stand(kInitialised_ticks);
  const std::vector<std::uint16_t> blank(camera_.pixels(), 0);
  camera_.feed(clock_.now_ns() - 40 * kNsPerMs, blank);
  stand(40);
  camera_.feed(clock_.now_ns() - 200 * kNsPerMs, blank);
  stand(4);
  EXPECT_EQ(perception(Fault::kDepthRejected), 1U);
  EXPECT_FALSE(camera_.holding());
}

TEST_F(PipelineTest, NothingToSee_StopsStandingAndSaysSo) {
  stand(kInitialised_ticks + 2000);
  EXPECT_EQ(pipeline_->control().gait_status().phase, GaitPhase::kStopped);
  EXPECT_EQ(pipeline_->control().gait_status().stop_reason, Obstruction::kNothingSeen);
  EXPECT_EQ(control(Fault::kGaitStopped), 1U);
}

TEST(PipelineMemory, Stages_SumUpWithinTheBudget) {
  const auto memory = static_memory();
  const std::size_t sum = std::accumulate(memory.begin(), memory.end(), std::size_t{0},
                                          [](std::size_t s, const StageMemory& m) { return s + m.bytes; });
  EXPECT_EQ(sum, sizeof(Pipeline));
  EXPECT_LE(sum, kMemoryBudget_bytes);
  for (const StageMemory& stage : memory) EXPECT_GT(stage.bytes, 0U) << stage.stage;
}

}  // namespace
}  // namespace polygmap
