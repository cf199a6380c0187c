// SPDX-License-Identifier: Apache-2.0
// One robot for all of the gait: what is changed of it, the balance and the proof of a step's feasibility both follow.
#include <gtest/gtest.h>

#include "algorithms/gait/trajectories/step_search.hpp"
#include "tests/support/ideal_climb.hpp"

namespace polygmap {
namespace {

using test::IdealClimb;

// With its torso so far ahead the base must hang back, and the legs cannot do the steps: the proof has to know.
TEST(GaitRobot, TorsoFarAhead_BalanceFollows_AndTheProofRefusesTheSteps) {
  RobotModel robot;
  robot.masses.torso.centre_m.x() += 0.3;
  IdealClimb climb({}, {}, robot), nominal({});
  for (int i = 0; i < 100; ++i) {  // before there is an estimate: the weight is held up by the ankles
    (void)climb.tick();
    (void)nominal.tick();
  }
  const auto ankle_nm = [](const IdealClimb& c) {
    return c.command().joints[kAnklePitch].tau_ff_nm + c.command().joints[kJointsPerLeg + kAnklePitch].tau_ff_nm;
  };
  EXPECT_GT(std::abs(ankle_nm(climb) - ankle_nm(nominal)), 20.0);
  climb.run(20.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kLegsCannot);
  EXPECT_EQ(climb.status().treads_climbed, 0U);
}

TEST(GaitRobot, SlowKnees_TheProofRefusesTheFirstStepOntoTheStairs) {
  RobotModel robot;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) robot.drives.limits[joint_index(leg, kKnee)].speed_radps = 1.2;
  IdealClimb climb({}, {}, robot);
  climb.run(40.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kLegsCannot);
  EXPECT_EQ(climb.status().treads_climbed, 0U);
}

// As strong as ever at rest, but while the knee lifts the body it turns.
TEST(GaitRobot, KneesWhoseTorqueFallsEarly_TheProofRefusesTheFirstStepOntoTheStairs) {
  RobotModel robot;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    JointLimits& knee = robot.drives.limits[joint_index(leg, kKnee)];
    knee.corner_radps = 0.1;
    knee.no_load_radps = 2.0;
  }
  IdealClimb climb({}, {}, robot);
  climb.run(40.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, StopReason::kLegsCannot);
  EXPECT_EQ(climb.status().treads_climbed, 0U);
}

TEST(GaitRobot, DrivesWithoutRoomForTheirDamping_TorquesMakeUpForIt) {
  RobotModel robot;
  for (GainLimits& limits : robot.drives.gain_limits) limits.kd_nmsprad = 5.0;
  IdealClimb limited({}, {}, robot), nominal({});
  JointVector dq_radps;
  const auto knees_jerk = [&](StateEstimate&, FootholdSet&, JointFeedback& feedback) {
    for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
      feedback.dq_radps[static_cast<Eigen::Index>(joint_index(leg, kKnee))] += 0.1;
    }
    dq_radps = feedback.dq_radps;
  };
  limited.tamper = nominal.tamper = knees_jerk;
  ASSERT_TRUE(limited.run_until(GaitPhase::kSwing, 1));
  ASSERT_TRUE(nominal.run_until(GaitPhase::kSwing, 1));
  for (int i = 0; i < 50; ++i) {
    (void)nominal.tick();
    (void)limited.tick();  // the same motion: this robot goes wherever it is told
    for (std::size_t n = 0; n < kJointCount; ++n) {
      const JointSetpoint& joint = limited.command().joints[n];
      const double times = limited.status().stands[n / kJointsPerLeg] ? 1.0 : JointReference::Params{}.swing_gain;
      const double added_nm =
          robot.drives.kd_beside(n, times) * (joint.dq_radps - dq_radps[static_cast<Eigen::Index>(n)]);
      EXPECT_NEAR(joint.tau_ff_nm - nominal.command().joints[n].tau_ff_nm, added_nm, 1e-9) << n;
      EXPECT_TRUE(n % kJointsPerLeg != kKnee || std::abs(added_nm) > 0.0) << n;
    }
  }
}

// The margins of one and the same step, as the proof sees them.
StepCheck check_of(const RobotModel& robot) {
  const StepParams params;
  const std::array<Transform, kFootCount> soles{Transform{Mat3::Identity(), Vec3{0, 0.1, 0}},
                                                Transform{Mat3::Identity(), Vec3{0, -0.1, 0}}};
  const SolePair flat{sole_pose(soles[0]), sole_pose(soles[1])};
  const StepGoal goal{StepKind::kLeading, Foot::kLeft, {{0.28, 0.1, 0.13}, 0.0}, {}};
  const TorsoPose middle = torso_between(nominal_robot().legs, params.torso, flat);
  const TorsoTrajectory::State from = TorsoTrajectory::at_rest({rotation_z(0.0), middle.position_m});
  const StepPlan plan = plan_step(params, goal, flat, kStepTries[0]);
  StepFeasibility proof;
  proof.begin(robot, StepKnots(robot, params, params.knot_ticks, plan, from, soles));
  (void)proof.advance(robot, params, 1000);
  return proof.check();
}

TEST(GaitRobot, EveryPartOfTheRobot_ChangesWhatTheProofFinds) {
  const StepCheck nominal = check_of({});
  ASSERT_TRUE(nominal.feasible);
  RobotModel heavier;
  heavier.masses.torso.centre_m.x() += 0.02;
  EXPECT_NE(check_of(heavier).joint_margin_rad, nominal.joint_margin_rad);
  RobotModel longer;
  longer.legs.shank_m += 0.01;
  EXPECT_NE(check_of(longer).knee_rad, nominal.knee_rad);
  RobotModel faster;
  for (JointLimits& limits : faster.drives.limits) limits.speed_radps *= 2.0;
  EXPECT_NEAR(check_of(faster).speed_share, 0.5 * nominal.speed_share, 1e-12);
}

}  // namespace
}  // namespace polygmap
