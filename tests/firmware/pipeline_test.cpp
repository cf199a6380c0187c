// SPDX-License-Identifier: Apache-2.0
// The wiring, on fakes fed by hand: every fault and limit that firmware raises by itself, raised (kReachLimited,
// kContactEarly, kContactLate and kFootPutBack repeat the gait's counters, which its own tests raise); no heap call,
// init included; static memory within its budget.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <string_view>
#include <vector>

#include "firmware/schedule.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/fake_robot.hpp"
#include "tests/support/standing_module.hpp"

namespace polygmap {
namespace {

using PipelineTest = test::StandingModule;

TEST_F(PipelineTest, StandingStill_InitialisesCommandsAndRaisesNothingOfControl) {
  stand(kInitialised_ticks);
  EXPECT_TRUE(control().state().initialised);
  EXPECT_FALSE(control().faults().any_fault());
  const JointCommand& command = control().last_command();
  for (std::size_t j = 0; j < kJointCount; ++j) {
    EXPECT_NEAR(command.joints[j].q_rad, standing_q_rad_[static_cast<Eigen::Index>(j)], 0.05) << j;
  }
}

TEST_F(PipelineTest, SensorsSilent_AreCountedAsMissing) {
  stand(10);
  clock_.advance_ns(kCycle_ns);
  tick_with(nullptr, nullptr);
  EXPECT_EQ(count(Fault::kImuMissing), 1U);
  EXPECT_EQ(count(Fault::kJointFeedbackMissing), 1U);
}

TEST_F(PipelineTest, SensorsNotFinite_AreRejectedAndTheCommandStaysFinite) {
  stand(kInitialised_ticks);
  clock_.advance_ns(kCycle_ns);
  ImuSample imu = imu_at(clock_.now_ns());
  imu.gyro_radps.x() = std::numeric_limits<double>::quiet_NaN();
  JointFeedback joints = joints_at(clock_.now_ns());
  joints.q_rad[3] = std::numeric_limits<double>::infinity();
  tick_with(&imu, &joints);
  EXPECT_EQ(count(Fault::kImuRejected), 1U);
  EXPECT_EQ(count(Fault::kJointFeedbackRejected), 1U);
  EXPECT_EQ(count(Fault::kJointCommandInvalid), 0U);
  for (const JointSetpoint& joint : control().last_command().joints) {
    EXPECT_TRUE(std::isfinite(joint.q_rad) && std::isfinite(joint.dq_radps));
  }
}

TEST_F(PipelineTest, BusRefusesTheCommand_IsCounted) {
  stand(10);
  joints_.writes.fail_next();
  stand(1);
  EXPECT_EQ(count(Fault::kJointCommandRefused), 1U);
}

TEST_F(PipelineTest, BusRefusesForFiftyMilliseconds_StopsAndSaysSo) {
  stand(kInitialised_ticks);
  for (std::uint32_t i = 0; i < OverloadGuard::Params{}.most_refused; ++i) {
    EXPECT_TRUE(is_running(control().module_state()));
    joints_.writes.fail_next();
    stand(1);
  }
  EXPECT_EQ(count(Fault::kCommandsRefused), 1U);
  EXPECT_EQ(control().module_state(), ModuleState::kStopping);
  stand(2);
  EXPECT_EQ(control().module_state(), ModuleState::kSafeStop);
  EXPECT_EQ(control().gait_status().stop_reason, StopReason::kCommandsRefused);
}

TEST_F(PipelineTest, BusTakesOneCommandAmongRefusedOnes_GoesOn) {
  stand(kInitialised_ticks);
  for (int n = 0; n < 4; ++n) {
    for (std::uint32_t i = 1; i < OverloadGuard::Params{}.most_refused; ++i) {
      joints_.writes.fail_next();
      stand(1);
    }
    stand(1);
  }
  EXPECT_EQ(count(Fault::kCommandsRefused), 0U);
  EXPECT_TRUE(is_running(control().module_state()));
}

TEST_F(PipelineTest, EveryTickComesTwoCyclesLate_StopsAndSaysSo) {
  stand(kInitialised_ticks);
  for (int i = 0; i < 40 && count(Fault::kTimeShort) == 0; ++i) {
    clock_.advance_ns(2 * kCycle_ns);
    stand(1);
  }
  EXPECT_EQ(count(Fault::kCycleSlip), 0U) << "no cycle was left out";
  EXPECT_EQ(count(Fault::kTimeShort), 1U);
  EXPECT_EQ(count(Limit::kCycleCaughtUp), 50U);
  stand(2);
  EXPECT_EQ(control().gait_status().stop_reason, StopReason::kTimeShort);
}

TEST_F(PipelineTest, CyclesAreLostAgainAndAgain_StopsAndSaysSo) {
  stand(kInitialised_ticks);
  for (int i = 0; i < 5 && count(Fault::kTimeShort) == 0; ++i) {  // 22 lost in each
    clock_.advance_ns(24 * kCycle_ns);
    stand(5);
  }
  EXPECT_EQ(count(Fault::kCycleSlip), 3U * 22U);
  stand(2);
  EXPECT_EQ(control().module_state(), ModuleState::kSafeStop);
  EXPECT_EQ(control().gait_status().stop_reason, StopReason::kTimeShort);
}

TEST_F(PipelineTest, CyclesAreLostNowAndThen_GoesOn) {
  stand(kInitialised_ticks);
  for (int i = 0; i < 3; ++i) {
    clock_.advance_ns(24 * kCycle_ns);
    stand(200);
  }
  EXPECT_EQ(count(Fault::kCycleSlip), 3U * 22U);
  EXPECT_EQ(count(Fault::kTimeShort), 0U);
  EXPECT_TRUE(is_running(control().module_state()));
}

TEST_F(PipelineTest, BusTellsOfItsFaults_EachIsCountedUnderItsName) {
  stand(10);
  joints_.told.bus_offs = 1;
  joints_.told.unknown_ids = 2;
  joints_.told.bad_frames = 3;
  joints_.told.lost = 4;
  joints_.told.failed_calls = 5;
  joints_.told.clamped = 6;
  joints_.told.stale = 7;
  joints_.told.feet_silent = true;
  stand(2);
  EXPECT_EQ(count(Fault::kBusOff), 1U);
  EXPECT_EQ(count(Fault::kBusUnknownId), 2U);
  EXPECT_EQ(count(Fault::kBusBadFrame), 3U);
  EXPECT_EQ(count(Fault::kBusFrameLost), 4U);
  EXPECT_EQ(count(Fault::kBusCallFailed), 5U);
  EXPECT_EQ(count(Limit::kDriveClamped), 6U);
  EXPECT_EQ(count(Fault::kBusReplyStale), 7U);
  EXPECT_EQ(count(Fault::kFeetSilent), 1U);
  EXPECT_TRUE(is_running(control().module_state()));
}

TEST_F(PipelineTest, LidarFromTheFuture_IsRejected) {
  stand(kInitialised_ticks);
  LioSample sample;
  sample.stamp_ns = clock_.now_ns() + kNsPerS;
  sample.position_sigma_m = Vec3::Constant(0.01);
  sample.rotation_sigma_rad = Vec3::Constant(0.003);
  lidar_.feed(sample);
  stand(1);
  EXPECT_EQ(count(Fault::kLioRejected), 1U);
}

TEST_F(PipelineTest, LidarWithoutDelay_MeetsTheStateOfItsOwnFrame) {
  stand(kInitialised_ticks);
  LioSample sample;
  sample.stamp_ns = clock_.now_ns() + kCycle_ns;  // when the next frame begins
  sample.lio_T_lidar = Transform{Mat3::Identity(), Vec3{0, 0, kNominalBaseHeight_m}} * base_T_lidar();
  lidar_.feed(sample);
  stand(1);
  EXPECT_EQ(control().estimator().counters().lio_of(LioVerdict::kAccepted), 1U);
  EXPECT_EQ(count(Fault::kLioRejected), 0U);
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
  EXPECT_EQ(count(Fault::kLioMissing), 1U);
}

TEST_F(PipelineTest, CameraSilent_IsMissing) {
  stand(kInitialised_ticks);
  EXPECT_GE(count(Fault::kDepthMissing), 1U);
}

TEST_F(PipelineTest, FrameOfTheRobotsFuture_HasNoPoseAndIsGivenBack) {
  stand(kInitialised_ticks);
  const std::vector<std::uint16_t> blank(camera_.pixels(), 0);
  camera_.feed(clock_.now_ns() + kNsPerS, blank);
  stand(4);
  EXPECT_EQ(count(Limit::kStateRingMissed), 1U);
  EXPECT_FALSE(camera_.holding());
}

TEST_F(PipelineTest, FrameOutOfOrder_IsRejectedAndGivenBack) {
  stand(kInitialised_ticks);
  const std::vector<std::uint16_t> blank(camera_.pixels(), 0);
  camera_.feed(clock_.now_ns() - 40 * kNsPerMs, blank);
  stand(40);
  camera_.feed(clock_.now_ns() - 200 * kNsPerMs, blank);
  stand(5);
  EXPECT_EQ(count(Fault::kDepthRejected), 1U);
  EXPECT_FALSE(camera_.holding());
}

TEST_F(PipelineTest, NothingToSee_StopsStandingAndSaysSo) {
  stand(kInitialised_ticks + 2000);
  EXPECT_EQ(control().gait_status().phase, GaitPhase::kStopped);
  EXPECT_EQ(control().gait_status().stop_reason, StopReason::kNothingSeen);
  EXPECT_EQ(count(Fault::kGaitStopped), 1U);
}

// After a late tick the executive runs three frames at once; the first of them reads everything.
TEST_F(PipelineTest, TickComesTwoFramesLate_NothingIsMissingAndTheGaitKeepsTime) {
  stand(kInitialised_ticks);
  for (int i = 0; i < 3; ++i) {
    clock_.advance_ns(kCycle_ns);
    imu_.feed(imu_at(clock_.now_ns()));
  }
  joints_.feed(joints_at(clock_.now_ns()));
  const std::uint64_t commands = joints_.writes.calls();
  module_.tick();
  EXPECT_EQ(count(Limit::kCycleCaughtUp), 2U);
  EXPECT_FALSE(control().faults().any_fault());
  EXPECT_EQ(joints_.writes.calls(), commands + 1) << "the drives are told of the newest frame only";
  EXPECT_EQ(control().last_command().stamp_ns, clock_.now_ns());
  EXPECT_EQ(control().gait_status().stamp_ns, clock_.now_ns());
  EXPECT_EQ(control().state().oldest_input_ns, clock_.now_ns());
}

TEST_F(PipelineTest, ImuFasterThanTheFrame_EverySampleCounts) {
  stand(kInitialised_ticks);
  clock_.advance_ns(kCycle_ns);
  for (int i = 3; i >= 0; --i) {
    ImuSample imu = imu_at(clock_.now_ns() - i * kCycle_ns / 4);
    if (i == 3) imu.gyro_radps.z() = 0.4;
    imu_.feed(imu);
  }
  const JointFeedback joints = joints_at(clock_.now_ns());
  tick_with(nullptr, &joints);
  EXPECT_NEAR(control().state().base_w_base_radps.z(), 0.1, 1e-3);
}

TEST_F(PipelineTest, SamplesOfTheFuture_AreRejectedOnceAndForgotten) {
  stand(kInitialised_ticks);
  clock_.advance_ns(kCycle_ns);
  const ImuSample imu = imu_at(clock_.now_ns() + kNsPerS);
  const JointFeedback joints = joints_at(clock_.now_ns() + kNsPerS);
  tick_with(&imu, &joints);
  stand(10);
  EXPECT_EQ(count(Fault::kImuRejected), 1U);
  EXPECT_EQ(count(Fault::kJointFeedbackRejected), 1U);
  EXPECT_EQ(control().state().oldest_input_ns, clock_.now_ns());
}

TEST_F(PipelineTest, LidarNeverSpeaks_IsMissingTwoSecondsAfterTheStart) {
  stand(1000);
  EXPECT_EQ(count(Fault::kLioMissing), 0U);
  stand(10);
  EXPECT_EQ(count(Fault::kLioMissing), 1U);
}

TEST_F(PipelineTest, CameraNeverSpeaks_IsMissingAFifthOfASecondAfterTheStart) {
  stand(100);
  EXPECT_EQ(count(Fault::kDepthMissing), 0U);
  stand(10);
  EXPECT_EQ(count(Fault::kDepthMissing), 1U);
}

TEST_F(PipelineTest, FrameBeforeTheStart_IsGivenBackAndCounted) {
  stand(100);
  camera_.feed(clock_.now_ns(), std::vector<std::uint16_t>(camera_.pixels(), 0));
  stand(5);
  EXPECT_EQ(count(Limit::kDepthUnplaced), 1U);
  EXPECT_EQ(count(Limit::kStateRingMissed), 0U);
  EXPECT_FALSE(camera_.holding());
}

// Boxes of different heights, a surface or two of each.
class PipelineAmongBoxes : public PipelineTest {
 protected:
  PipelineAmongBoxes() : PipelineTest(params()) {}
  static Params params() {
    Params params;
    params.map.memory.misses_unconfirmed = 1000;  // it shall fill, whatever is seen next
    params.map.memory.unconfirmed_age_s = 1000.0;
    return params;
  }
  void feed(int rows, int columns, double lowest_m) {
    constexpr double kStep_m = 0.02;  // no two of them are one to the map
    test::DepthScene scene;
    scene.world_T_camera = Transform{Mat3::Identity(), Vec3{0, 0, kNominalBaseHeight_m}} * base_T_camera();
    scene.floor = false;
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        const Vec3 corner_m{0.35 + 0.2 * row, -0.1 * columns + 0.2 * column, -3.0};
        const double height_m = lowest_m + kStep_m * (row * columns + column);
        scene.boxes.push_back({corner_m, corner_m + Vec3{0.16, 0.16, 3.0 + height_m}});
      }
    }
    camera_.feed(clock_.now_ns(), test::render_for_robot(scene));
  }
  void show(int rows, int columns, double lowest_m) {
    feed(rows, columns, lowest_m);
    stand(100);
  }
};

// The extraction reads the driver's buffer in place.
TEST_F(PipelineAmongBoxes, FrameUnderExtraction_IsHeldUntilItsSurfacesAreOut) {
  stand(kInitialised_ticks);
  show(2, 3, -0.1);
  const PerceptionLane& perception = module_.pipeline().perception();
  const std::int64_t before_ns = perception.surface_frame().stamp_ns;
  feed(6, 8, -0.5);
  const std::int64_t fed_ns = clock_.now_ns();
  int held_ticks = 0;
  for (int i = 0; i < 100 && perception.surface_frame().stamp_ns == before_ns; ++i) {
    stand(1);
    if (perception.extractor().busy()) {
      ++held_ticks;
      EXPECT_TRUE(camera_.holding());
    }
  }
  EXPECT_GE(held_ticks, 1);
  EXPECT_FALSE(perception.extractor().busy());
  EXPECT_EQ(perception.surface_frame().stamp_ns, fed_ns);
  if (camera_.holding()) stand(1);  // the mount learns from the picture, too: in the next cycle, if this one is spent
  EXPECT_FALSE(camera_.holding());
}

TEST_F(PipelineAmongBoxes, MoreSurfacesThanAFrameMayHave_IsCounted) {
  stand(kInitialised_ticks);
  show(2, 3, -0.1);
  EXPECT_EQ(count(Limit::kPlanesFull), 0U);
  show(8, 10, -0.8);
  EXPECT_GT(count(Limit::kPlanesFull), 0U);
}

// A fence of thin slats, one above the other: each ends a run wherever a column looks.
TEST_F(PipelineAmongBoxes, MoreRunsThanAColumnMayHave_IsCounted) {
  stand(kInitialised_ticks);
  show(2, 3, -0.1);
  EXPECT_EQ(count(Limit::kSegmentsFull), 0U);
  const CameraIntrinsics camera = robot_camera_intrinsics();
  std::vector<std::uint16_t> slats(camera_.pixels());
  for (std::size_t i = 0; i < slats.size(); ++i) {
    const bool near = i / static_cast<std::size_t>(camera.width_px) / 6 % 2 == 0;
    slats[i] = static_cast<std::uint16_t>((near ? 0.8 : 1.2) / camera.depth_unit_m);
  }
  camera_.feed(clock_.now_ns(), slats);
  stand(100);
  EXPECT_GT(count(Limit::kSegmentsFull), 0U);
}

TEST_F(PipelineAmongBoxes, MorePolygonsThanTheMapHolds_IsCounted) {
  stand(kInitialised_ticks);
  for (const double lowest_m : {-1.5, -1.25, -1.0, -0.75, -0.5, -0.25}) show(3, 4, lowest_m);
  EXPECT_EQ(count(Limit::kMapFull), 0U);
  for (const double lowest_m : {0.0, 0.25, -1.75, -2.0, -1.38, -1.13, -0.88, -0.63, -0.38}) show(3, 4, lowest_m);
  EXPECT_GT(count(Limit::kMapFull), 0U);
}

// Too little time for the map in every frame: pictures are thrown away unseen, and it says so; then it goes on.
TEST_F(PipelineAmongBoxes, MapShedForLong_LostFramesAreCountedAndControlGoesOn) {
  constexpr std::size_t kSurfacesRow = row_named(kOneLaneSchedule, "surfaces");
  constexpr std::size_t kMapRow = row_named(kOneLaneSchedule, "map");
  stand(kInitialised_ticks);
  show(2, 3, -0.1);
  const PerceptionLane& perception = module_.pipeline().perception();
  const std::int64_t mapped_ns = perception.map_snapshot().stamp_ns;
  const RowStatistics& extraction = module_.executive().row_statistics(kSurfacesRow);
  std::array<std::uint64_t, 3> units{};
  for (std::uint64_t& spent : units) {
    const std::uint64_t before = extraction.units;
    feed(2, 3, -0.1);
    for (int i = 0; i < 100; ++i) {
      module_.executive().shed_in_next_cycle(1U << kMapRow);
      stand(1);
    }
    spent = extraction.units - before;
  }
  EXPECT_GT(units[0], 100U);
  EXPECT_EQ(units[1] + units[2], 0U);
  EXPECT_EQ(count(Limit::kFrameLost), 2U);  // the first may still come
  EXPECT_GE(count(Limit::kRowShed), 299U);  // the last one is told a frame later
  EXPECT_EQ(perception.map_snapshot().stamp_ns, mapped_ns);
  EXPECT_EQ(joints_.commands().newest().stamp_ns, control().state().stamp_ns);
  stand(1);
  show(2, 3, -0.1);
  EXPECT_GT(perception.map_snapshot().stamp_ns, mapped_ns);
  EXPECT_EQ(count(Limit::kFrameLost), 2U);
}

TEST(PipelineMemory, Stages_SumUpWithinTheBudget) {
  const auto memory = static_memory();
  const std::size_t sum = std::accumulate(memory.begin(), memory.end(), std::size_t{0},
                                          [](std::size_t s, const StageMemory& m) { return s + m.bytes; });
  EXPECT_EQ(sum, sizeof(Pipeline) + sizeof(LaneExecutive<kControlLane>) + sizeof(LaneExecutive<kPerceptionLane>) +
                     kLaneCount * kLaneStack_bytes);
  EXPECT_LE(sum, kMemoryBudget_bytes);
  for (const StageMemory& stage : memory) {
    if (std::string_view(stage.stage) == "padding") continue;  // alignment may need none
    EXPECT_GT(stage.bytes, 0U) << stage.stage;
  }
}

}  // namespace
}  // namespace polygmap
