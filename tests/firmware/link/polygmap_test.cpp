// SPDX-License-Identifier: Apache-2.0
// The C interface around the module: the same commands as without it, no heap call, and a plan that is what happens.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>

#include "firmware/link/abi.hpp"
#include "sim_stub/heap_trap.hpp"
#include "tests/support/fake_robot.hpp"
#include "tests/support/trapped_module.hpp"

namespace polygmap {
namespace {

using test::FakeRobot;

struct alignas(POLYGMAP_ALIGNMENT) Memory {
  std::array<std::byte, POLYGMAP_MEMORY_BYTES> bytes;
};

template <class Struct>
Struct sized() {
  Struct value{};
  value.size = sizeof value;
  return value;
}
void copy(const auto& from, auto& to) {
  for (Eigen::Index i = 0; i < from.size(); ++i) to[i] = from[i];
}

// A robot whose controller has the module behind the C interface. Every call of it is in the heap trap.
class LinkedRobot {
 public:
  explicit LinkedRobot(double toe_gap_m, const char* config = nullptr) : robot(toe_gap_m) {
    const heap::ModuleCall call("polygmap_create");
    EXPECT_EQ(polygmap_create(&module_, memory_->bytes.data(), sizeof memory_->bytes, config), POLYGMAP_OK);
  }
  // 2 ms: what the sensors say is pushed, and what is commanded goes to the drives.
  void tick() {
    robot.advance();
    push();
    const heap::ModuleCall call("polygmap_step");
    ASSERT_EQ(polygmap_step(module_, robot.clock.now_ns()), POLYGMAP_OK);
    command = sized<polygmap_command>();
    if (polygmap_read_command(module_, &command) != POLYGMAP_OK) return;
    JointCommand to_drives;
    to_drives.stamp_ns = command.stamp_ns;
    for (std::size_t n = 0; n < kJointCount; ++n) {
      to_drives.joints[n] = {command.q_rad[n], command.dq_radps[n], command.tau_ff_nm[n], command.kp_nmprad[n],
                             command.kd_nmsprad[n]};
    }
    ASSERT_TRUE(robot.joints.try_write(to_drives).is_all());
  }
  [[nodiscard]] const polygmap_plan& plan() {
    const heap::ModuleCall call("polygmap_read_plan");
    plan_->size = sizeof *plan_;
    EXPECT_EQ(polygmap_read_plan(module_, plan_.get()), POLYGMAP_OK);
    return *plan_;
  }
  [[nodiscard]] polygmap_status status() const {
    auto status = sized<polygmap_status>();
    EXPECT_EQ(polygmap_read_status(module_, &status), POLYGMAP_OK);
    return status;
  }
  [[nodiscard]] polygmap_pose pose() const {
    auto pose = sized<polygmap_pose>();
    EXPECT_EQ(polygmap_read_pose(module_, &pose), POLYGMAP_OK);
    return pose;
  }
  [[nodiscard]] polygmap_handle* module() { return module_; }

  FakeRobot robot;
  polygmap_command command{};  // of the last tick; without a stamp there was none

 private:
  void push() {
    ImuSample felt;
    while (robot.imu.try_read(felt)) {
      auto imu = sized<polygmap_imu>();
      imu.stamp_ns = felt.stamp_ns;
      copy(felt.gyro_radps, imu.gyro_radps);
      copy(felt.accel_mps2, imu.accel_mps2);
      ASSERT_EQ(polygmap_push_imu(module_, &imu), POLYGMAP_OK);
    }
    JointFeedback feedback;
    while (robot.joints.try_read(feedback)) {
      auto joints = sized<polygmap_joints>();
      joints.stamp_ns = feedback.stamp_ns;
      copy(feedback.q_rad, joints.q_rad);
      copy(feedback.dq_radps, joints.dq_radps);
      copy(feedback.tau_nm, joints.tau_nm);
      std::ranges::copy(feedback.silent_cycles, joints.silent_cycles);
      std::ranges::copy(feedback.foot_force_n, joints.foot_force_n);
      ASSERT_EQ(polygmap_push_joints(module_, &joints), POLYGMAP_OK);
    }
    LioSample pose;
    while (robot.lidar.try_read(pose)) {
      auto lio = sized<polygmap_lio>();
      lio.stamp_ns = pose.stamp_ns;
      for (int i = 0; i < 9; ++i) lio.lio_R_lidar[i] = pose.lio_T_lidar.R(i / 3, i % 3);
      copy(pose.lio_T_lidar.p_m, lio.lio_p_lidar_m);
      copy(pose.position_sigma_m, lio.position_sigma_m);
      copy(pose.rotation_sigma_rad, lio.rotation_sigma_rad);
      ASSERT_EQ(polygmap_push_lio(module_, &lio), POLYGMAP_OK);
    }
    DepthFrameView frame;
    while (robot.camera.try_acquire(frame)) {
      auto depth = sized<polygmap_depth>();
      depth.sequence = frame.sequence;
      depth.stamp_ns = frame.stamp_ns;
      depth.width_px = frame.width_px;
      depth.height_px = frame.height_px;
      depth.pixels = frame.depth;
      ASSERT_EQ(polygmap_push_depth(module_, &depth), POLYGMAP_OK);
      robot.camera.release();  // which writes over it at once
    }
  }

  std::unique_ptr<Memory> memory_ = std::make_unique<Memory>();
  std::unique_ptr<polygmap_plan> plan_ = std::make_unique<polygmap_plan>();
  polygmap_handle* module_ = nullptr;
};

constexpr double kToeGap_m = 0.032;
constexpr int kUntilItStands_ticks = 700;

TEST(Link, AClimb_GivesTheCommandsOfTheModuleOnPorts) {
  LinkedRobot linked(kToeGap_m);
  FakeRobot robot(kToeGap_m);
  test::TrappedModule module(robot.ports(), {}, robot.clock);
  const int ticks = test::kSlowMachine ? 750 : 3000;
  for (int i = 0; i < ticks; ++i) {
    linked.tick();
    robot.advance();
    module.tick();
    const bool commanded = !robot.joints.commands().empty();
    ASSERT_EQ(linked.command.stamp_ns != 0, commanded) << i;
    if (!commanded) continue;
    const JointCommand& expected = robot.joints.commands().newest();
    ASSERT_EQ(linked.command.stamp_ns, expected.stamp_ns) << i;
    for (std::size_t n = 0; n < kJointCount; ++n) {
      ASSERT_EQ(linked.command.q_rad[n], expected.joints[n].q_rad) << i;
      ASSERT_EQ(linked.command.tau_ff_nm[n], expected.joints[n].tau_ff_nm) << i;
      ASSERT_EQ(linked.command.kp_nmprad[n], expected.joints[n].kp_nmprad) << i;
    }
  }
  const GaitStatus& gait = module.pipeline().control().gait_status();
  EXPECT_EQ(linked.status().treads_climbed, gait.treads_climbed);
  EXPECT_EQ(linked.status().cycles.run, static_cast<std::uint64_t>(ticks));
  EXPECT_TRUE(test::kSlowMachine || gait.treads_climbed > 0);
  EXPECT_EQ(heap::report().calls, 0U) << heap::report().first_caller;
}

TEST(Link, Plan_OfAClimb_IsWhatHappens) {
  LinkedRobot linked(kToeGap_m);
  std::int64_t announced_ns = 0, lifted_ns = 0;
  int steps_onto_treads = 0;
  std::uint32_t stairs_seen = 0;
  polygmap_foot_target announced{};
  for (int i = 0; i < (test::kSlowMachine ? 750 : 3000); ++i) {
    linked.tick();
    const polygmap_plan& plan = linked.plan();
    ASSERT_LE(plan.step_count, static_cast<std::uint32_t>(POLYGMAP_MAX_STEPS));
    EXPECT_EQ(plan.stamp_ns, linked.robot.clock.now_ns());
    stairs_seen |= 1U << plan.stairs.state;
    EXPECT_EQ(std::isnan(plan.foot[0].odom_T_sole.p_m[0]), plan.body_count == 0);
    if (plan.body_count > 0) {
      ASSERT_GT(plan.contact_count, 0U);
      EXPECT_EQ(plan.contact[0].begin_ns, plan.stamp_ns);
      EXPECT_EQ(plan.contact[plan.contact_count - 1].end_ns, INT64_MAX);
      EXPECT_EQ(plan.contact[0].stands[0], plan.foot[0].stands);
      EXPECT_EQ(plan.contact[0].stands[1], plan.foot[1].stands);
    }
    for (std::uint32_t c = 1; c < plan.contact_count; ++c) {
      EXPECT_EQ(plan.contact[c].begin_ns, plan.contact[c - 1].end_ns);
      EXPECT_GT(plan.contact[c].begin_ns, plan.contact[c - 1].begin_ns);
      EXPECT_NE(plan.contact[c].stands[0] + plan.contact[c].stands[1], 0U);
    }
    if (plan.step_count == 0) continue;
    const polygmap_foot_target& step = plan.step[0];
    EXPECT_GT(step.torso_z_m, step.z_m + 0.5);
    if (step.certainty == POLYGMAP_STEP_PLANNED) {
      announced = step;
      announced_ns = step.lift_off_ns;
    } else if (step.lift_off_ns != lifted_ns) {  // in the air
      lifted_ns = step.lift_off_ns;
      EXPECT_EQ(plan.foot[step.foot].stands, 0U);
      EXPECT_EQ(step.foot, announced.foot);
      EXPECT_NEAR(static_cast<double>(lifted_ns - announced_ns), 0.0, 1e8);  // no later than a tenth of a second
      steps_onto_treads += step.onto_tread != 0 ? 1 : 0;
      if (step.onto_tread == 0) continue;
      // It stands on a polygon of the map, whose height it has.
      const auto* polygon = std::find_if(plan.polygon, plan.polygon + plan.polygon_count,
                                         [&](const polygmap_polygon& p) { return p.id == step.polygon_id; });
      ASSERT_NE(polygon, plan.polygon + plan.polygon_count);
      EXPECT_EQ(polygon->surface, POLYGMAP_SURFACE_TREAD);
      EXPECT_NEAR(polygon->vertex_m[0][2], step.z_m, 0.01);
      EXPECT_NEAR(plan.stairs.rise_m, 0.13, 0.01);
      EXPECT_NEAR(plan.stairs.tread_m, 0.28, 0.02);
      EXPECT_NEAR(plan.stairs.heading_rad, 0.0, 0.03);
      EXPECT_NEAR(plan.stairs.nosing_m[0][0], plan.stairs.nosing_m[1][0], 0.03);  // across the way
      EXPECT_GT(plan.stairs.nosing_m[0][1], plan.stairs.nosing_m[1][1]);          // from left to right
    }
  }
  if (test::kSlowMachine) return;
  EXPECT_GE(steps_onto_treads, 2);
  EXPECT_EQ(stairs_seen,
            1U << POLYGMAP_STAIRS_NONE | 1U << POLYGMAP_STAIRS_APPROACHING | 1U << POLYGMAP_STAIRS_CLIMBING);
}

TEST(Link, Pose_IsTheRobots) {
  LinkedRobot linked(kToeGap_m);
  for (int i = 0; i < kUntilItStands_ticks; ++i) linked.tick();
  const polygmap_pose pose = linked.pose();
  EXPECT_EQ(pose.initialised, 1U);
  EXPECT_EQ(pose.stamp_ns, linked.robot.clock.now_ns());
  EXPECT_NEAR(pose.odom_T_base.p_m[2], linked.robot.true_T_base().p_m.z(), 0.01);
  EXPECT_NEAR(std::abs(pose.odom_T_base.q[0]), 1.0, 1e-3);
  EXPECT_NEAR(pose.odom_T_sole[0].p_m[1] - pose.odom_T_sole[1].p_m[1], 0.2, 0.01);
  EXPECT_GT(pose.contact_probability[0], 0.9);
  EXPECT_GT(pose.covariance[0][0], 0.0);
  EXPECT_GE(pose.lio_age_ns, 0);
}

TEST(Link, Operator_IsObeyedOrRefused) {
  LinkedRobot linked(kToeGap_m, "[supervisor]\nautostart = false\n");
  for (int i = 0; i < 10; ++i) linked.tick();
  EXPECT_EQ(linked.status().state, POLYGMAP_STATE_OFF);
  EXPECT_EQ(polygmap_operate(linked.module(), POLYGMAP_OPERATE_START), POLYGMAP_OK);
  linked.tick();
  EXPECT_EQ(linked.status().answer.operation, POLYGMAP_OPERATE_START);
  EXPECT_STREQ(polygmap_refusal_text(linked.status().answer.refusal), "the state has no answer to it");
  EXPECT_EQ(polygmap_operate(linked.module(), POLYGMAP_OPERATE_ARM), POLYGMAP_OK);
  for (int i = 0; i < kUntilItStands_ticks; ++i) linked.tick();
  EXPECT_EQ(linked.status().answer.answered, 2U);
  EXPECT_EQ(linked.status().answer.refusal, 0);
  EXPECT_EQ(linked.status().state, POLYGMAP_STATE_STANDING);
  EXPECT_EQ(linked.plan().step_count, 0U);
  for (int i = 0; i < 600 && linked.plan().stairs.state == POLYGMAP_STAIRS_NONE; ++i) linked.tick();
  EXPECT_EQ(linked.plan().stairs.state, POLYGMAP_STAIRS_APPROACHING);
}

TEST(Link, SentToAPlace_WalksThereAndEnds) {
  LinkedRobot linked(kToeGap_m, "[supervisor]\nautostart = false\n");
  EXPECT_EQ(polygmap_operate(linked.module(), POLYGMAP_OPERATE_ARM), POLYGMAP_OK);
  for (int i = 0; i < kUntilItStands_ticks; ++i) linked.tick();
  const double nan = std::nan("");
  EXPECT_EQ(polygmap_go_to(nullptr, 0.0, 0.0, nan, nan), POLYGMAP_E_NULL);
  EXPECT_EQ(polygmap_go_to(linked.module(), 51.0, 0.0, nan, nan), POLYGMAP_E_PLACE);
  EXPECT_EQ(polygmap_go_to(linked.module(), nan, 0.0, 0.0, nan), POLYGMAP_E_PLACE);
  EXPECT_EQ(polygmap_go_to(linked.module(), 1.0, 0.0, 3.3, nan), POLYGMAP_E_PLACE);
  EXPECT_EQ(polygmap_go_to(linked.module(), 1.0, 0.0, nan, -50.1), POLYGMAP_E_PLACE);
  EXPECT_EQ(polygmap_operate(linked.module(), POLYGMAP_OPERATE_GO_TO), POLYGMAP_E_OPERATE) << "it names no place";
  EXPECT_EQ(polygmap_go_to(linked.module(), -0.02, 0.0, nan, nan), POLYGMAP_OK);
  for (int i = 0; i < 3000 && linked.status().state != POLYGMAP_STATE_ON_TOP; ++i) linked.tick();
  EXPECT_EQ(linked.status().answer.operation, POLYGMAP_OPERATE_GO_TO);
  EXPECT_EQ(linked.status().state, POLYGMAP_STATE_ON_TOP);
}

// Two masters on a bus contradict each other: nothing is to be sent any more.
TEST(Link, AfterTheHandOver_ThereIsNoCommand) {
  LinkedRobot linked(kToeGap_m, "[supervisor]\nautostart = false\n");
  EXPECT_EQ(polygmap_operate(linked.module(), POLYGMAP_OPERATE_ARM), POLYGMAP_OK);
  for (int i = 0; i < kUntilItStands_ticks; ++i) linked.tick();
  ASSERT_NE(linked.command.stamp_ns, 0);
  EXPECT_EQ(polygmap_operate(linked.module(), POLYGMAP_OPERATE_HAND_OVER), POLYGMAP_OK);
  for (int i = 0; i < 1000 && linked.status().state != POLYGMAP_STATE_RELEASED; ++i) linked.tick();
  EXPECT_EQ(linked.status().state, POLYGMAP_STATE_RELEASED);
  linked.tick();
  EXPECT_EQ(linked.command.stamp_ns, 0);
}

TEST(Link, StepsThatComeLateOrEarly_AreCounted) {
  LinkedRobot linked(kToeGap_m);
  const std::int64_t begin_ns = 1000;
  EXPECT_EQ(polygmap_step(linked.module(), begin_ns), POLYGMAP_OK);
  EXPECT_EQ(linked.status().cycles.next_due_ns, begin_ns + POLYGMAP_CYCLE_NS);
  EXPECT_EQ(polygmap_step(linked.module(), begin_ns + 5), POLYGMAP_OK);
  EXPECT_EQ(linked.status().cycles.run, 1U);
  EXPECT_EQ(polygmap_step(linked.module(), begin_ns + 2 * POLYGMAP_CYCLE_NS), POLYGMAP_OK);
  EXPECT_EQ(linked.status().cycles.run, 3U);
  EXPECT_EQ(linked.status().cycles.late, 1U);
  EXPECT_EQ(polygmap_step(linked.module(), begin_ns + 12 * POLYGMAP_CYCLE_NS), POLYGMAP_OK);
  EXPECT_EQ(linked.status().cycles.run, 6U);
  EXPECT_EQ(linked.status().cycles.skipped, 7U);
  EXPECT_EQ(linked.status().stamp_ns, begin_ns + 12 * POLYGMAP_CYCLE_NS);
}

TEST(Link, ASilentDriveAndAFault_AreNamed) {
  LinkedRobot linked(kToeGap_m);
  for (int i = 0; i < kUntilItStands_ticks; ++i) linked.tick();
  linked.robot.silent_joint = 3;
  for (int i = 0; i < 30; ++i) linked.tick();
  EXPECT_EQ(linked.status().drives.silent, 1U << 3);
  auto faults = sized<polygmap_faults>();
  ASSERT_EQ(polygmap_read_faults(linked.module(), &faults), POLYGMAP_OK);
  const auto* silent = std::find_if(faults.fault, faults.fault + faults.count,
                                    [](const polygmap_fault& fault) { return fault.number == 30; });
  ASSERT_NE(silent, faults.fault + faults.count);
  EXPECT_STREQ(polygmap_fault_name(silent->number), "drive_silent");
  EXPECT_EQ(silent->count, 1U);
  EXPECT_LE(linked.robot.clock.now_ns() - silent->first_ns, 60 * kNsPerMs);
  EXPECT_EQ(linked.plan().held, 1U);
  EXPECT_EQ(linked.plan().body_count, 1U);
}

// The same bits whatever lay in the memory before.
TEST(Link, MemoryThatWasUsed_MakesNoDifference) {
  std::array<polygmap_command, 2> last{};
  for (const int fill : {0x00, 0xa5}) {
    const auto memory = std::make_unique<Memory>();
    std::memset(memory->bytes.data(), fill, sizeof memory->bytes);
    polygmap_handle* module = nullptr;
    ASSERT_EQ(polygmap_create(&module, memory->bytes.data(), sizeof memory->bytes, nullptr), POLYGMAP_OK);
    FakeRobot robot(kToeGap_m);
    for (int i = 0; i < 200; ++i) {
      robot.advance();
      ImuSample felt;
      JointFeedback feedback;
      auto imu = sized<polygmap_imu>();
      auto joints = sized<polygmap_joints>();
      ASSERT_TRUE(robot.imu.try_read(felt) && robot.joints.try_read(feedback));
      imu.stamp_ns = joints.stamp_ns = robot.clock.now_ns();
      copy(felt.accel_mps2, imu.accel_mps2);
      copy(feedback.q_rad, joints.q_rad);
      ASSERT_EQ(polygmap_push_imu(module, &imu), POLYGMAP_OK);
      ASSERT_EQ(polygmap_push_joints(module, &joints), POLYGMAP_OK);
      ASSERT_EQ(polygmap_step(module, robot.clock.now_ns()), POLYGMAP_OK);
    }
    polygmap_command& command = last[fill == 0 ? 0 : 1];
    command.size = sizeof command;
    ASSERT_EQ(polygmap_read_command(module, &command), POLYGMAP_OK);
  }
  EXPECT_EQ(std::memcmp(&last[0], &last[1], sizeof last[0]), 0);
}

}  // namespace
}  // namespace polygmap
