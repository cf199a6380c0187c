// SPDX-License-Identifier: Apache-2.0
// The table as the robot runs it: control and perception on threads of their own.
#include <gtest/gtest.h>

#include <barrier>
#include <memory>
#include <thread>
#include <vector>

#include "firmware/schedule.hpp"
#include "sim_stub/heap_trap.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/fake_robot.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

class PipelineInTwoLanes : public testing::Test {
 protected:
  PipelineInTwoLanes() : camera_(robot_camera_intrinsics()) {
    pipeline_ = std::make_unique<Pipeline>(Ports{camera_, imu_, joints_, lidar_}, Params{});
    control_ =
        std::make_unique<LaneExecutive<kControlLane>>(*pipeline_, control_clock_, pipeline_->lane_health(kControlLane));
    perception_ = std::make_unique<LaneExecutive<kPerceptionLane>>(*pipeline_, perception_clock_,
                                                                   pipeline_->lane_health(kPerceptionLane));
    control_->start(control_clock_.now_ns() + kCycle_ns);
    perception_->start(perception_clock_.now_ns() + kCycle_ns);
  }
  void control_frame() {
    control_clock_.advance_ns(kCycle_ns);
    const std::int64_t now_ns = control_clock_.now_ns();
    imu_.feed({now_ns, Vec3::Zero(), Vec3{0, 0, kGravity_mps2}});
    JointFeedback feedback;
    feedback.stamp_ns = now_ns;
    feedback.q_rad = standing_q_rad_;
    feedback.foot_force_n = {270.0, 270.0};
    joints_.feed(feedback);
    const heap::ModuleCall call("control lane");
    control_->tick(now_ns);
  }
  void perception_frame() {
    perception_clock_.advance_ns(kCycle_ns);
    const heap::ModuleCall call("perception lane");
    perception_->tick(perception_clock_.now_ns());
  }

  const JointVector standing_q_rad_ = test::standing_joints();
  fakes::FakeClock control_clock_ = test::three_days_up(), perception_clock_ = test::three_days_up();
  fakes::FakeDepthCamera camera_;
  fakes::FakeImu imu_;
  fakes::FakeJointBus joints_;
  fakes::FakeLidarOdometry lidar_;
  std::unique_ptr<Pipeline> pipeline_;
  std::unique_ptr<LaneExecutive<kControlLane>> control_;
  std::unique_ptr<LaneExecutive<kPerceptionLane>> perception_;
};

TEST_F(PipelineInTwoLanes, TwoSecondsBeforeStairs_PosesFootholdsAndFaultsCross) {
  constexpr int kFrames = 1700;  // 700 of them before the first picture; then the camera's mount is to be learnt
  test::DepthScene scene;
  scene.world_T_camera = Transform{Mat3::Identity(), Vec3{0, 0, kNominalBaseHeight_m}} * base_T_camera();
  scene.add_stairs({.rise_m = 0.13, .first_riser_x_m = kCollisionRectangle.toe_x_m + 0.1});
  const std::vector<std::uint16_t> stairs = test::render_for_robot(scene);
  std::barrier frame_begins(2);  // both lanes run the same frame at the same time
  std::thread control([&] {
    for (int i = 0; i < kFrames; ++i) {
      frame_begins.arrive_and_wait();
      control_frame();
    }
  });
  for (int i = 0; i < kFrames; ++i) {
    frame_begins.arrive_and_wait();
    if (i > 700 && i % 16 == 0) camera_.feed(perception_clock_.now_ns(), stairs);
    perception_frame();
  }
  control.join();
  EXPECT_EQ(control_->lane_statistics().cycles, static_cast<std::uint64_t>(kFrames));
  EXPECT_EQ(perception_->lane_statistics().cycles, static_cast<std::uint64_t>(kFrames));
  EXPECT_GE(pipeline_->perception().extractor().counters().frames, 15U);
  EXPECT_FALSE(camera_.holding());
  EXPECT_FALSE(pipeline_->perception().map_snapshot().polygons.empty());
  EXPECT_NE(pipeline_->control().gait_status().phase, GaitPhase::kStandstill);  // a foothold came across
  EXPECT_EQ(pipeline_->lane_health(kControlLane).count(Fault::kDepthMissing).count, 0U);
  EXPECT_GE(pipeline_->health().count(Fault::kDepthMissing).count, 6U);  // so did perception's faults
  EXPECT_EQ(pipeline_->health().count(Fault::kPoseMissing).count, 0U);
}

TEST_F(PipelineInTwoLanes, ControlDoesNotAnswer_FrameIsGivenBackAndALateAnswerIsNotTheNextFrames) {
  const std::vector<std::uint16_t> blank(camera_.pixels(), 0);
  const Health& health = pipeline_->perception().faults();
  camera_.feed(perception_clock_.now_ns(), blank);
  for (int i = 0; i < 10; ++i) perception_frame();
  EXPECT_TRUE(camera_.holding());
  for (int i = 0; i < 2; ++i) perception_frame();
  EXPECT_FALSE(camera_.holding());
  EXPECT_EQ(health.count(Fault::kPoseMissing).count, 1U);
  control_frame();
  camera_.feed(perception_clock_.now_ns(), blank);
  for (int i = 0; i < 2; ++i) perception_frame();
  EXPECT_TRUE(camera_.holding());
  EXPECT_EQ(health.count(Limit::kDepthUnplaced).count, 0U);
  control_frame();
  perception_frame();
  EXPECT_FALSE(camera_.holding());
  EXPECT_EQ(health.count(Limit::kDepthUnplaced).count, 1U);
}

}  // namespace
}  // namespace polygmap
