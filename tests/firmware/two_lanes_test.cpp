// SPDX-License-Identifier: Apache-2.0
// The table as the robot runs it: control and perception on threads of their own.
#include <gtest/gtest.h>

#include <atomic>
#include <barrier>
#include <cstring>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "firmware/schedule.hpp"
#include "sim_stub/heap_trap.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/fake_robot.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/slow_machine.hpp"

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
  constexpr int kFrames = 1710;  // 700 of them before the first picture; 14 after the last one, which takes ten
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
  control_clock_.advance_ns(perception_clock_.now_ns() - control_clock_.now_ns() - kCycle_ns);
  control_frame();  // wakes up, and answers
  camera_.feed(perception_clock_.now_ns(), blank);
  for (int i = 0; i < 2; ++i) {
    perception_frame();
    EXPECT_TRUE(camera_.holding());
    control_frame();
  }
  EXPECT_EQ(health.count(Limit::kDepthUnplaced).count, 0U);
  perception_frame();
  EXPECT_FALSE(camera_.holding());
  EXPECT_EQ(health.count(Limit::kDepthUnplaced).count, 1U);
}

// A pose request of frame n is seen by control in n + 1 and its answer by perception in n + 2, whichever lane is first.
TEST_F(PipelineInTwoLanes, OneLaneAlwaysFirst_FrameIsPlacedTwoFramesAfterItsRequest) {
  const std::vector<std::uint16_t> blank(camera_.pixels(), 0);
  const auto frame = [&](bool control_first) {
    if (control_first) control_frame();
    perception_frame();
    if (!control_first) control_frame();
  };
  for (const bool control_first : {true, false}) {
    for (int i = 0; i < 5; ++i) frame(control_first);
    camera_.feed(perception_clock_.now_ns(), blank);
    const std::uint32_t unplaced = pipeline_->perception().faults().count(Limit::kDepthUnplaced).count;
    for (int i = 0; i < 2; ++i) {
      frame(control_first);
      EXPECT_TRUE(camera_.holding()) << i;
    }
    frame(control_first);
    EXPECT_FALSE(camera_.holding());
    EXPECT_EQ(pipeline_->perception().faults().count(Limit::kDepthUnplaced).count, unplaced + 1);
  }
  EXPECT_EQ(pipeline_->health().count(Fault::kLaneBehind).count, 0U);
}

// Perception takes longer than its frame: what it publishes is seen a frame later, and both count it.
TEST_F(PipelineInTwoLanes, PerceptionHasNotFinishedWhenControlBegins_IsCountedAndSeenLater) {
  for (int i = 0; i < 3; ++i) {
    control_frame();
    perception_frame();
  }
  control_frame();
  EXPECT_EQ(pipeline_->health().count(Fault::kLaneBehind).count, 0U);
  control_frame();  // perception is still in the frame before
  EXPECT_EQ(pipeline_->health().count(Fault::kLaneBehind).count, 1U);
  EXPECT_EQ(pipeline_->control().view().last_ns(), control_clock_.now_ns() - 2 * kCycle_ns);
  perception_frame();
  perception_frame();
  control_frame();
  EXPECT_EQ(pipeline_->health().count(Fault::kLaneBehind).count, 1U);
  EXPECT_EQ(pipeline_->control().view().last_ns(), control_clock_.now_ns() - kCycle_ns);
  EXPECT_EQ(pipeline_->perception().faults().count(Fault::kLaneBehind).count, 0U);
}

// A climb in both ways.

// Runs the module's rows, held up now and then, or until the other lane has finished its frame.
class HeldUpTasks {
 public:
  HeldUpTasks(Pipeline& pipeline, unsigned seed)
      : pipeline_(pipeline), random_{{std::mt19937(seed), std::mt19937(~seed)}} {}

  void begin_frame(unsigned order) noexcept {
    order_ = order;
    for (std::atomic<bool>& done : done_) done = false;
  }
  Progress run_row(std::size_t row, std::int64_t cycle_ns, WorkBudget& budget) noexcept {
    const std::size_t lane = kTasks[row].row.lane;
    while (order_ == lane && !done_[1 - lane]) std::this_thread::yield();  // orders 0 and 1: this lane is the second
    std::mt19937& random = random_[lane];
    if (random() % 8 == 0) {
      for (unsigned i = random() % 16; i > 0; --i) std::this_thread::yield();
    }
    return pipeline_.run_row(row, cycle_ns, budget);
  }
  void cycle_done(std::size_t lane, const CycleReport& report) noexcept {
    pipeline_.cycle_done(lane, report);
    done_[lane] = true;
  }

 private:
  Pipeline& pipeline_;
  std::array<std::mt19937, kLaneCount> random_;
  std::array<std::atomic<bool>, kLaneCount> done_{};
  unsigned order_ = 2;
};

struct ClimbTrace {
  std::vector<JointCommand> commands;
  std::uint32_t treads = 0, lane_behind = 0;
};

constexpr double kClimbToeGap_m = 0.062;
// Up to the second tread; on a slow machine until it has stepped off.
constexpr int kClimbFrames = test::kSlowMachine ? 2000 : 5500;

void note(ClimbTrace& trace, const Pipeline& pipeline) {
  trace.commands.push_back(pipeline.control().last_command());
  trace.treads = pipeline.control().gait_status().treads_climbed;
  trace.lane_behind = pipeline.health().count(Fault::kLaneBehind).count;
}

ClimbTrace climb_in_one_lane() {
  test::FakeRobot robot(kClimbToeGap_m);
  const auto pipeline = std::make_unique<Pipeline>(robot.ports(), Params{});
  OneLaneExecutive<> executive(*pipeline, robot.clock, pipeline->lane_health(0));
  executive.start(robot.clock.now_ns() + kCycle_ns);
  ClimbTrace trace;
  for (int i = 0; i < kClimbFrames; ++i) {
    robot.advance();
    executive.tick(robot.clock.now_ns());
    note(trace, *pipeline);
  }
  return trace;
}

ClimbTrace climb_in_two_lanes(unsigned seed) {
  test::FakeRobot robot(kClimbToeGap_m);
  const auto pipeline = std::make_unique<Pipeline>(robot.ports(), Params{});
  HeldUpTasks tasks(*pipeline, seed);
  CyclicExecutive<HeldUpTasks, kSchedule, kControlLane, Health> control(tasks, robot.clock,
                                                                        pipeline->lane_health(kControlLane));
  CyclicExecutive<HeldUpTasks, kSchedule, kPerceptionLane, Health> perception(tasks, robot.clock,
                                                                              pipeline->lane_health(kPerceptionLane));
  control.start(robot.clock.now_ns() + kCycle_ns);
  perception.start(robot.clock.now_ns() + kCycle_ns);
  std::barrier wake(2), asleep(2);  // both lanes wake at the same time
  std::thread other([&] {
    for (int i = 0; i < kClimbFrames; ++i) {
      wake.arrive_and_wait();
      perception.tick(robot.clock.now_ns());
      asleep.arrive_and_wait();
    }
  });
  ClimbTrace trace;
  std::mt19937 random(seed);
  for (int i = 0; i < kClimbFrames; ++i) {
    robot.advance();
    tasks.begin_frame(random() % 4);
    wake.arrive_and_wait();
    control.tick(robot.clock.now_ns());
    asleep.arrive_and_wait();
    note(trace, *pipeline);
  }
  other.join();
  return trace;
}

bool same_bits(const JointCommand& a, const JointCommand& b) {
  bool same = a.stamp_ns == b.stamp_ns;
  for (std::size_t j = 0; j < kJointCount; ++j) {
    same = same && std::memcmp(&a.joints[j], &b.joints[j], sizeof(JointSetpoint)) == 0;  // five doubles, no padding
  }
  return same;
}

void expect_one_lanes_commands(unsigned first_seed, unsigned last_seed) {
  const ClimbTrace one = climb_in_one_lane();
  if (!test::kSlowMachine) {
    EXPECT_GE(one.treads, 1U);
  }
  for (unsigned seed = first_seed; seed <= last_seed; ++seed) {
    const ClimbTrace two = climb_in_two_lanes(seed);
    ASSERT_EQ(two.commands.size(), one.commands.size());
    int differ = 0;
    for (std::size_t i = 0; i < one.commands.size(); ++i) differ += same_bits(one.commands[i], two.commands[i]) ? 0 : 1;
    EXPECT_EQ(differ, 0) << "of " << one.commands.size() << ", seed " << seed;
    EXPECT_EQ(two.treads, one.treads);
    EXPECT_EQ(two.lane_behind, 0U);
  }
}

TEST(ClimbInTwoLanes, ThreadsOfAnySpeedWithinAFrame_EveryCommandIsTheOneLanesToTheBit) {
  expect_one_lanes_commands(1, 1);
}
TEST(LongClimbInTwoLanes, MoreSeeds_EveryCommandIsTheOneLanesToTheBit) { expect_one_lanes_commands(2, 6); }

}  // namespace
}  // namespace polygmap
