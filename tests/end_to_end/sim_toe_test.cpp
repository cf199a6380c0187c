// SPDX-License-Identifier: Apache-2.0
// Where the camera sits along the ground, found on the simulated robot before its first step onto the stairs.
#include <gtest/gtest.h>

#include <memory>

#include "firmware/schedule.hpp"
#include "sim_stub/sim_robot.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

// Stands before the first foot is lifted onto the stairs.
struct Looked {
  double ahead_error_m = 0.0;  // of what was found
  double mount_error_m = 0.0;
  std::uint32_t toes = 0;  // frames that told of them
};

Looked before_the_stairs(std::uint64_t seed, bool estimate_mount = true) {
  SimOptions options;
  options.seed = seed;
  options.plant_kind = PlantKind::kMujoco;
  options.stairs.steps = 4;
  options.start = StartPose{};
  options.errors = ErrorParams::none();
  options.errors.camera_mount_m = 0.006;
  options.errors.depth_noise = 1.0;
  SimRobot robot(options);
  Params params;
  params.estimate_mount = estimate_mount;
  const auto pipeline = std::make_unique<Pipeline>(Ports{robot, robot, robot, robot}, params);
  OneLaneExecutive<> executive(*pipeline, robot, pipeline->lane_health(0));
  executive.start(robot.now_ns() + kCycle_ns);
  const std::int64_t end_ns = robot.now_ns() + 20 * kNsPerS;
  for (bool climbs = false; !climbs && robot.now_ns() < end_ns;) {
    robot.advance();
    executive.tick(robot.now_ns());
    const GaitStatus& gait = pipeline->control().gait_status();
    climbs = gait.phase == GaitPhase::kSwing && gait.step.onto_tread;
  }
  const CameraExtrinsicsEstimator& mount = pipeline->perception().mount();
  const double off_m = robot.errors().base_T_camera.p_m.x() - base_T_camera().p_m.x();
  return {mount.ahead_m() - off_m, off_m, mount.counters().toes};
}

TEST(SimToe, CameraMillimetresAheadOrBehind_IsFoundBeforeTheFirstStep) {
  double farthest_m = 0.0;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Looked looked = before_the_stairs(seed);
    EXPECT_GE(looked.toes, 12U) << seed;
    EXPECT_LT(std::abs(looked.ahead_error_m), 0.0015) << seed << ": off by " << looked.mount_error_m;
    farthest_m = std::max(farthest_m, std::abs(looked.mount_error_m));
  }
  EXPECT_GT(farthest_m, 0.0025);
}

TEST(SimToe, MountNotEstimated_NothingIsLookedFor) { EXPECT_EQ(before_the_stairs(1, false).toes, 0U); }

}  // namespace
}  // namespace polygmap::sim
