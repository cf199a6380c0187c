// SPDX-License-Identifier: Apache-2.0
// The module meets a robot that somebody else's controller holds, at that robot's gains: it balances from its first
// command, and no command asks for more than the drives are to give.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "sim_stub/reality.hpp"
#include "tests/support/physical_climb.hpp"

namespace polygmap::sim {
namespace {

using LegGains = std::array<double, kJointsPerLeg>;
struct Case {
  const char* name;
  LegGains kp_most_nmprad;
  bool single_step;
  std::uint64_t seed;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name << ", seed " << c.seed; }
std::string case_name(const testing::TestParamInfo<Case>& info) {
  return info.param.name + ("_seed" + std::to_string(info.param.seed)) + (info.param.single_step ? "_ss" : "_ds");
}
constexpr LegGains kKuavo_nmprad{220, 100, 224, 224, 58, 58}, kSoft_nmprad{250, 250, 250, 250, 250, 250};

// The most that was commanded over the limit, of all joints.
double highest_share(const JointCommand& command, const LegGains& most_nmprad) {
  double share = 0.0;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    share = std::max(share, command.joints[n].kp_nmprad / most_nmprad[n % kJointsPerLeg]);
  }
  return share;
}

class TakeOver : public testing::TestWithParam<Case> {};

TEST_P(TakeOver, DrivesWithLimits_BalancesAndClimbsWithinThem) {
  const auto& [name, most_nmprad, single_step, seed] = GetParam();
  SimOptions options = stairs_of(2, seed);
  options.mujoco.kp_most_nmprad = most_nmprad;
  Params params;
  params.robot.drives.kp_most_nmprad = most_nmprad;
  params.gait.planner.pattern = single_step ? GaitPattern::kSingleStep : GaitPattern::kDoubleStep;
  PhysicalClimb climb(options, params);
  double share = 0.0;
  bool goes_on = true;
  while (goes_on && climb.time_s() < 60.0) {
    goes_on = climb.tick();
    share = std::max(share, highest_share(climb.command(), most_nmprad));
  }
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().treads_climbed, 2U);
  EXPECT_GE(climb.sole_margin_min_m(), 0.0);
  EXPECT_GT(share, 0.99) << "the limits are tried";
  EXPECT_LE(share, 1.0);
}
INSTANTIATE_TEST_SUITE_P(Gains, TakeOver,
                         testing::Values(Case{"kuavo", kKuavo_nmprad, false, 1}, Case{"kuavo", kKuavo_nmprad, true, 2},
                                         Case{"soft", kSoft_nmprad, false, 2}, Case{"soft", kSoft_nmprad, true, 1}),
                         case_name);

// From the very first tick: whoever holds it lets go at once.
TEST(TakeOverStart, FirstSecond_StaysWhereItWasMet) {
  SimOptions options = stairs_of(2, 3);
  options.mujoco.kp_most_nmprad = kKuavo_nmprad;
  Params params;
  params.robot.drives.kp_most_nmprad = kKuavo_nmprad;
  PhysicalClimb climb(options, params);
  const Vec3 com_m = climb.truth().true_p_com_m;
  const double met_s = climb.time_s();
  const auto commands = [&climb] { return climb.command().joints[kAnklePitch].kp_nmprad > 0.0; };
  while (!commands() && climb.time_s() < met_s + 1.0) ASSERT_TRUE(climb.tick());
  EXPECT_TRUE(commands());
  EXPECT_NEAR(climb.time_s() - met_s, 0.1, 0.01) << "it listens first";
  double moved_m = 0.0;
  const double end_s = climb.time_s() + 1.0;
  while (climb.time_s() < end_s && climb.tick()) {
    moved_m = std::max(moved_m, (climb.truth().true_p_com_m - com_m).head<2>().norm());
  }
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  EXPECT_LT(moved_m, 0.02);
}

// Turned by 13 deg to any side, on its side and upside down: without the check the robot falls within seconds.
TEST(TakeOverStart, ImuMountIsNotAsConfigured_CommandsNothingAndTheRobotStands) {
  for (const Mat3& turn : {rotation_x(0.227), rotation_x(-0.227), rotation_y(0.227), rotation_y(-0.227),
                           rotation_x(0.5 * kPi), rotation_x(kPi)}) {
    Params params;
    params.robot.mounts.base_R_imu = turn;
    PhysicalClimb climb(stairs_of(1, 3), params);
    while (climb.time_s() < 2.0) {
      (void)climb.tick();
      ASSERT_EQ(climb.state(), ModuleState::kArming);
      ASSERT_EQ(climb.command().joints[kKnee].kp_nmprad, 0.0);
      ASSERT_EQ(climb.command().joints[kKnee].tau_ff_nm, 0.0);
    }
    EXPECT_FALSE(climb.truth().fell);
    EXPECT_EQ(climb.health().count(Fault::kGravityDisagrees).count, 1U);
  }
}

// The robot of each seed stands on its own controller, with errors twice as large as a real one's.
TEST(TakeOverStart, EveryRobotOfTwiceTheErrors_IsWithinTheTolerance) {
  constexpr StanceCheck::Params kMost;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    SimOptions options = stairs_of(1, seed);
    options.plant_kind = PlantKind::kKinematic;
    options.errors = draw_reality(2.0, seed).sensors;
    for (double* spread :
         {&options.errors.imu_mount_rad, &options.errors.accel_bias_mps2, &options.errors.encoder_offset_rad}) {
      *spread *= 2.0;
    }
    SimRobot robot(options);
    RestingAccel felt;
    felt.reset(100 * kNsPerMs);
    JointFeedback joints;
    for (int i = 0; i < 50; ++i) {
      robot.advance();
      ImuSample imu;
      if (robot.try_read(imu)) felt.add(imu.stamp_ns, imu.accel_mps2);
      ASSERT_TRUE(robot.try_read(joints));
    }
    const auto [soles_rad, gravity_rad] = StanceCheck::leans(RobotModel{}.legs, joints.q_rad, felt.mean_mps2());
    EXPECT_LT(soles_rad, kMost.most_soles_rad) << seed;
    EXPECT_LT(gravity_rad, kMost.most_gravity_rad) << seed;
  }
}

}  // namespace
}  // namespace polygmap::sim
