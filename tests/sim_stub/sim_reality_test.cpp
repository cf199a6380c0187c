// SPDX-License-Identifier: Apache-2.0
// What a real robot has and its data sheet does not say: drawn, set by name, and felt by the module's ports.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "firmware/config/param_table.hpp"
#include "sim_stub/reality.hpp"
#include "sim_stub/sim_robot.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

std::string complaint_of(const std::string& assignment) {
  Reality reality;
  return set_item(reality, assignment);
}

TEST(Reality, ScaleZero_IsTheDataSheet) {
  EXPECT_EQ(config::hash_of(draw_reality(0.0, 7)), config::hash_of(Reality{}));
}

TEST(Reality, EveryItem_IsANumberOfTheTableAndLeavesItsDefaultWithinItsRange) {
  std::vector<bool> left(reality_items().size(), false);
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    for (const double scale : {1.0, 2.0}) {
      Reality usual, drawn = draw_reality(scale, seed);
      const config::ParamTable defaults = config::param_table(usual), table = config::param_table(drawn);
      for (std::size_t i = 0; i < left.size(); ++i) {
        const auto at = std::ranges::find(table.params, reality_items()[i].name, &config::Param::name);
        ASSERT_NE(at, table.params.end()) << reality_items()[i].name;
        const auto& before = defaults.params[static_cast<std::size_t>(at - table.params.begin())];
        left[i] = left[i] || !config::same_value(*at, before);
        const double number = config::number_of(*at);
        EXPECT_TRUE(number >= at->least && number <= at->most) << at->name << " = " << number;
      }
    }
  }
  for (std::size_t i = 0; i < left.size(); ++i) EXPECT_TRUE(left[i]) << reality_items()[i].name;
}

TEST(Reality, OtherSeed_DrawsAnotherRobot) {
  EXPECT_EQ(config::hash_of(draw_reality(1.0, 3)), config::hash_of(draw_reality(1.0, 3)));
  EXPECT_NE(config::hash_of(draw_reality(1.0, 3)), config::hash_of(draw_reality(1.0, 4)));
}

TEST(Reality, ItemSetByName_HasThatValue) {
  Reality reality;
  EXPECT_EQ(set_item(reality, "plant.friction=0.3"), "");
  EXPECT_EQ(set_item(reality, "sensors.lio_jump_m = [0.06, 0, -0.01]"), "");
  EXPECT_EQ(set_item(reality, "sensors.rates_by_difference=true"), "");
  EXPECT_EQ(reality.plant.friction, 0.3);
  EXPECT_EQ(reality.sensors.lio_jump_m, Vec3(0.06, 0.0, -0.01));
  EXPECT_TRUE(reality.sensors.rates_by_difference);
}

TEST(Reality, WrongAssignment_OneSentenceThatNamesIt) {
  for (const std::string wrong : {"plant.friction", "plant.friction=", "plant.frictoin=0.3", "plant.friction=9",
                                  "plant.friction=\"much\"", "sensors.lio_jump_m=0.1", "a=1\nb=2", "[plant]"}) {
    const std::string sentence = complaint_of(wrong);
    EXPECT_FALSE(sentence.empty()) << wrong;
    EXPECT_EQ(sentence.find('\n'), std::string::npos);
    EXPECT_EQ(sentence.back(), '.') << sentence;
  }
  EXPECT_NE(complaint_of("plant.frictoin=0.3").find("plant.friction"), std::string::npos);
  EXPECT_EQ(complaint_of("foo=1"), "--set foo=1: foo is no parameter; `polygmap params reality` names all.");
}

// Stands under physics for a while, and what its ports say of it.
struct StandingRobot {
  explicit StandingRobot(const Reality& reality) : robot(options_of(reality)) {
    JointFeedback feedback;
    EXPECT_TRUE(robot.try_read(feedback));
    for (std::size_t j = 0; j < kJointCount; ++j) {
      hold.joints[j] = {feedback.q_rad[static_cast<Eigen::Index>(j)], 0.0, 0.0, 2000.0, 40.0};
    }
  }
  static SimOptions options_of(const Reality& reality) {
    SimOptions options;
    options.plant_kind = PlantKind::kMujoco;
    options.errors = reality.sensors;
    options.mujoco = reality.plant;
    options.camera.silent = {{0, std::numeric_limits<std::int64_t>::max()}};
    return options;
  }
  JointFeedback next() {
    EXPECT_TRUE(robot.try_write(hold).is_all());
    robot.advance();
    JointFeedback feedback;
    EXPECT_TRUE(robot.try_read(feedback));
    return feedback;
  }
  SimRobot robot;
  JointCommand hold;
};
Reality plain() {
  Reality reality;
  reality.sensors = ErrorParams::none();
  return reality;
}

TEST(RealityFootForce, NoiseAndOffset_AreOnTheContactForce) {
  Reality reality = plain();
  reality.sensors.foot_force_noise_n = 20.0;
  reality.sensors.foot_force_offset_n = {60.0, -40.0};
  StandingRobot standing(reality), without(plain());
  for (int i = 0; i < 200; ++i) (void)standing.next(), (void)without.next();
  std::array<double, kFootCount> sum{}, squares{};
  constexpr int kTicks = 2000;
  for (int i = 0; i < kTicks; ++i) {
    const JointFeedback noisy = standing.next(), exact = without.next();
    for (std::size_t f = 0; f < kFootCount; ++f) {
      const double off_n = noisy.foot_force_n[f] - exact.foot_force_n[f];
      sum[f] += off_n;
      squares[f] += off_n * off_n;
    }
  }
  for (std::size_t f = 0; f < kFootCount; ++f) {
    const double mean_n = sum[f] / kTicks;
    EXPECT_NEAR(mean_n, f == 0 ? 60.0 : -40.0, 2.0);
    EXPECT_NEAR(std::sqrt(squares[f] / kTicks - mean_n * mean_n), 20.0, 1.5);
  }
}

TEST(RealityFootForce, FootThatIsLiftedQuickly_IsFeltByItsMass) {
  ErrorParams params = ErrorParams::none();
  params.foot_force_mass_kg = 0.5;
  FootForceModel forces(params, 1);
  std::array<double, kFootCount> felt_n{};
  for (int i = 0; i < 20; ++i) {
    const double z_m = 0.5 * 20.0 * math::square(i * kPlantTick_s);  // 20 m/s^2 upwards
    felt_n = forces.sample({0.0, 0.0}, {z_m, 0.0}, kPlantTick_s);
  }
  EXPECT_NEAR(felt_n[0], -10.0, 1e-6);
  EXPECT_EQ(felt_n[1], 0.0);
}

TEST(RealityFootForce, ScaleAndDelay_AreOnTheContactForce) {
  ErrorParams params = ErrorParams::none();
  params.foot_force_scale = 1.1;
  params.foot_force_delay_s = 0.010;
  FootForceModel forces(params, 1);
  for (int i = 0; i < 20; ++i) (void)forces.sample({0.0, 0.0}, {0.0, 0.0}, kPlantTick_s);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(forces.sample({100.0, 0.0}, {0.0, 0.0}, kPlantTick_s)[0], 0.0);
  EXPECT_NEAR(forces.sample({100.0, 0.0}, {0.0, 0.0}, kPlantTick_s)[0], 110.0, 1e-9);
}

TEST(RealityImu, ScalesAndDelay_AreOnRateAndForce) {
  ErrorParams params = ErrorParams::none();
  params.gyro_scale = 1.01;
  params.accel_scale = 0.98;
  params.imu_delay_s = 0.006;
  const RobotErrors errors = draw_errors(params, 1);
  ImuModel imu(params, errors, 1, Transform{});
  std::vector<ImuSample> samples;
  for (int i = 1; i <= 40; ++i) {  // it turns from the twentieth tick on
    samples.push_back(imu.sample({rotation_z(0.001 * std::max(0, i - 20)), Vec3::Zero()}, i, kPlantTick_s));
    EXPECT_EQ(samples.back().stamp_ns, i);
  }
  EXPECT_NEAR(samples.back().gyro_radps.z(), 1.01 * 0.5, 1e-9);
  EXPECT_NEAR(samples.back().accel_mps2.z(), 0.98 * kGravity_mps2, 1e-9);
  const auto first = std::ranges::find_if(samples, [](const ImuSample& s) { return s.gyro_radps.z() > 0.1; });
  EXPECT_EQ(first - samples.begin(), 20 + 3);
}

TEST(RealityEncoders, Steps_RoundTheAngleAndSpeedIsTheDifferenceOfTwo) {
  Reality reality = plain();
  reality.sensors.encoder_step_rad = 0.00175;
  reality.sensors.rates_by_difference = true;
  StandingRobot standing(reality);
  JointFeedback before = standing.next();
  standing.hold.joints[kKnee].q_rad += 0.05;
  for (int i = 0; i < 100; ++i) {
    const JointFeedback now = standing.next();
    for (Eigen::Index j = 0; j < now.q_rad.size(); ++j) {
      const double steps = now.q_rad[j] / 0.00175;
      EXPECT_NEAR(steps, std::round(steps), 1e-6);
      EXPECT_NEAR(now.dq_radps[j], (now.q_rad[j] - before.q_rad[j]) / kPlantTick_s, 1e-9);
    }
    before = now;
  }
}

TEST(RealityLio, DriftAndJump_MoveThePoseAwayFromTheTruth) {
  Reality reality = plain();
  reality.sensors.lio_drift_mps = {0.01, 0.0, 0.0};
  reality.sensors.lio_drift_radps = 0.02;
  reality.sensors.lio_jump_m = {0.0, 0.3, 0.0};
  reality.sensors.lio_jump_s = seconds(VirtualClock::kStart_ns) + 5.0;
  StandingRobot standing(reality);
  Vec3 off_m = Vec3::Zero();
  double turned_rad = 0.0;
  for (int i = 0; i < 3000; ++i) {
    (void)standing.next();
    LioSample sample;
    if (!standing.robot.try_read(sample)) continue;
    const Transform true_T_lidar = standing.robot.errors().lio_T_true.inverse() * sample.lio_T_lidar;
    const Transform true_T_base = true_T_lidar * nominal_robot().mounts.base_T_lidar.inverse();
    off_m = true_T_base.p_m - standing.robot.truth().true_T_base.p_m;
    turned_rad = yaw_of(true_T_base.R) - yaw_of(standing.robot.truth().true_T_base.R);
  }
  const double run_s = seconds(standing.robot.now_ns() - VirtualClock::kStart_ns) - 0.1;
  EXPECT_NEAR(off_m.x(), 0.01 * run_s, 0.003);
  EXPECT_NEAR(off_m.y(), 0.3, 0.003);
  EXPECT_NEAR(turned_rad, 0.02 * run_s, 0.003);
}

TEST(RealityLio, DelayAndStamp_AreWhenAPoseComesAndWhatItSaysOfItsScan) {
  Reality reality = plain();
  reality.sensors.lio_delay_s = 0.130;
  reality.sensors.lio_stamp_s = 0.010;
  StandingRobot standing(reality);
  int poses = 0;
  for (int i = 0; i < 300; ++i) {
    (void)standing.next();
    LioSample sample;
    if (!standing.robot.try_read(sample)) continue;
    ++poses;
    EXPECT_NEAR(seconds(standing.robot.now_ns() - sample.stamp_ns), 0.120, 1e-6);
  }
  EXPECT_GT(poses, 3);
}

// The ankle of a lifted foot gets a torque of its own: what differs is what the joint has in it.
double ankle_after(const MujocoPlant::Params& params, double torque_nm, int ticks) {
  const StairWorld world;
  const RobotErrors errors = draw_errors(ErrorParams::none(), 1);
  JointVector q;
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    const double lifted_m = foot == Foot::kLeft ? 0.1 : 0.0;
    const Vec3 p_m{0, side_sign(foot) * kStanceHalfWidth_m, lifted_m - kNominalBaseHeight_m};
    q.segment<6>(static_cast<Eigen::Index>(joint_index(foot, 0))) = solve_leg({}, foot, {Mat3::Identity(), p_m}).q_rad;
  }
  MujocoPlant plant(params, world, errors, Transform{Mat3::Identity(), Vec3{-1, 0, 0}}, q);
  JointCommand command;
  for (std::size_t j = 0; j < kJointCount; ++j) {
    command.joints[j] = {q[static_cast<Eigen::Index>(j)], 0.0, 0.0, 2000.0, 40.0};
  }
  command.joints[kAnkleRoll].tau_ff_nm = torque_nm;
  command.joints[kAnkleRoll].kp_nmprad = command.joints[kAnkleRoll].kd_nmsprad = 0.0;
  for (int i = 0; i < ticks; ++i) plant.step(command);
  return plant.true_q_rad()[kAnkleRoll] - q[kAnkleRoll];
}

// All its torque all the time, with nothing to move but its foot.
TEST(RealityDrive, NoLoadScale_ScalesTheSpeedThatADriveReachesAlone) {
  const double all_nm = joint_limits(Foot::kLeft, kAnkleRoll).torque_nm;
  const auto speed_radps = [&](double scale) {
    MujocoPlant::Params params;
    params.no_load_scale = scale;
    return (ankle_after(params, all_nm, 16) - ankle_after(params, all_nm, 15)) / kPlantTick_s;
  };
  const double no_load_radps = joint_limits(Foot::kLeft, kAnkleRoll).no_load_radps;
  EXPECT_NEAR(speed_radps(1.0), no_load_radps, 0.05 * no_load_radps);
  EXPECT_NEAR(speed_radps(0.8), 0.8 * no_load_radps, 0.05 * no_load_radps);
}

TEST(RealityDrive, CommandDelay_IsTicksInWhichNothingHappens) {
  MujocoPlant::Params params;
  const auto torque_after = [&](int ticks) {
    Reality reality = plain();
    reality.plant = params;
    StandingRobot standing(reality);
    for (int i = 0; i < 30; ++i) (void)standing.next();
    standing.hold.joints[kKnee].tau_ff_nm += 5.0;
    const double before_nm = standing.next().tau_nm[kKnee];
    double after_nm = 0.0;
    for (int i = 0; i < ticks; ++i) after_nm = standing.next().tau_nm[kKnee];
    return after_nm - before_nm;
  };
  EXPECT_GT(torque_after(1), 4.0);
  params.command_delay_s = 0.008;
  EXPECT_LT(torque_after(4), 1.0);
  EXPECT_GT(torque_after(5), 4.0);
}

TEST(RealityDrive, TorqueLag_FollowsWithItsTimeConstant) {
  Reality reality = plain();
  reality.plant.torque_lag_s = 0.020;
  StandingRobot standing(reality);
  for (int i = 0; i < 300; ++i) (void)standing.next();
  standing.hold.joints[kHipYaw].kp_nmprad = standing.hold.joints[kHipYaw].kd_nmsprad = 0.0;
  standing.hold.joints[kHipYaw].tau_ff_nm = 0.0;
  for (int i = 0; i < 100; ++i) (void)standing.next();
  const double before_nm = standing.next().tau_nm[kHipYaw];
  standing.hold.joints[kHipYaw].tau_ff_nm = 1.0;
  for (int i = 0; i < 11; ++i) (void)standing.next();  // one on the bus, ten are a time constant
  EXPECT_NEAR(standing.next().tau_nm[kHipYaw] - before_nm, 1.0 - std::exp(-1.1), 0.06);
}

TEST(RealityBody, LargerInertia_TheSameTorqueTurnsTheFootLess) {
  MujocoPlant::Params params;
  params.armature_kgm2 = 0.001;
  const double usual_rad = ankle_after(params, 0.2, 20);
  params.inertia_scale = 3.0;
  EXPECT_LT(std::abs(ankle_after(params, 0.2, 20)), 0.9 * std::abs(usual_rad));
}

TEST(RealityDrive, FrictionOfAJoint_HoldsASmallTorque) {
  MujocoPlant::Params params;
  EXPECT_GT(std::abs(ankle_after(params, 0.5, 20)), 1e-4);
  params.joint_friction_nm = 8.0;
  EXPECT_LT(std::abs(ankle_after(params, 0.5, 20)), 0.3 * std::abs(ankle_after({}, 0.5, 20)));
}

TEST(RealityDrive, Backlash_LinkIsElsewhereThanItsEncoder) {
  Reality reality = plain();
  reality.plant.backlash_rad = 0.0175;
  StandingRobot standing(reality);
  for (int i = 0; i < 500; ++i) (void)standing.next();
  EXPECT_FALSE(standing.robot.truth().fell);
  const JointFeedback feedback = standing.next();
  const JointVector off_rad = standing.robot.true_q_rad() - feedback.q_rad;
  EXPECT_GT(off_rad.cwiseAbs().maxCoeff(), 0.006);
  EXPECT_LT(off_rad.cwiseAbs().maxCoeff(), 0.0125);
}

TEST(RealityGround, LongerTimeConstant_SoleSinksDeeper) {
  const auto sunk_m = [](double ground_s) {
    Reality reality = plain();
    reality.plant.ground_s = ground_s;
    StandingRobot standing(reality);
    for (int i = 0; i < 300; ++i) (void)standing.next();
    return -standing.robot.truth().true_T_sole[0].p_m.z();
  };
  EXPECT_LT(sunk_m(0.008), 5e-4);
  EXPECT_GT(sunk_m(0.040), 3e-3);
}

// A stiff robot that is pushed harder and harder that way tips over the edge of its soles.
double tipping_force_n(const Vec3& direction, double round_m, double edge_m) {
  Reality reality = plain();
  reality.sensors.toe_round_m = round_m;
  reality.sensors.sole_edge_m = edge_m;
  StandingRobot standing(reality);
  for (int i = 0; i < 300; ++i) (void)standing.next();
  EXPECT_NEAR(standing.robot.truth().true_T_sole[0].p_m.z(), 0.0, 1e-3);
  double force_n = 20.0;
  constexpr double kTilted = 0.03;  // of the sole, ahead
  for (; standing.robot.truth().true_T_sole[0].R(2, 0) > -kTilted && force_n < 400.0; force_n += 0.04) {
    standing.robot.plant().push(force_n * direction.normalized());
    (void)standing.next();
  }
  return force_n;
}

TEST(RealityFoot, WornEndsAndRoundToe_TipOverEarlierWhereTheyAreMissing) {
  const Vec3 ahead{1, 0, 0}, aslant{1, 1, 0};
  const double ahead_n = tipping_force_n(ahead, 0.0, 0.0), aslant_n = tipping_force_n(aslant, 0.0, 0.0);
  EXPECT_LT(tipping_force_n(ahead, 0.0, 0.015) / ahead_n, 0.98);
  EXPECT_NEAR(tipping_force_n(ahead, 0.04, 0.0) / ahead_n, 1.0, 0.02);
  EXPECT_LT(tipping_force_n(aslant, 0.04, 0.0) / aslant_n, 0.98);
}

// Narrower than its toe is round, at the ends of both ranges.
TEST(RealityFoot, RoundestToeOfTheNarrowestSole_IsABodyThatStands) {
  Reality reality = plain();
  EXPECT_EQ(set_item(reality, "sensors.toe_round_m=0.045"), "");
  EXPECT_EQ(set_item(reality, "sensors.sole_width_m=-0.03"), "");
  StandingRobot standing(reality);
  for (int i = 0; i < 300; ++i) (void)standing.next();
  EXPECT_FALSE(standing.robot.truth().fell);
}

TEST(RealityFoot, LongerToe_IsInTheJudgementOfItsMargin) {
  const RobotErrors longer = [] {
    ErrorParams params = ErrorParams::none();
    params.toe_m = 0.010;
    params.heel_m = -0.002;
    return draw_errors(params, 1);
  }();
  const SoleModel& usual = nominal_robot().sole;
  EXPECT_NEAR(longer.sole.contact.toe_x_m - usual.contact.toe_x_m, 0.010, 1e-12);
  EXPECT_NEAR(longer.sole.collision.toe_x_m - usual.collision.toe_x_m, 0.010, 1e-12);
  EXPECT_NEAR(longer.sole.contact.heel_x_m - usual.contact.heel_x_m, 0.002, 1e-12);
}

}  // namespace
}  // namespace polygmap::sim
