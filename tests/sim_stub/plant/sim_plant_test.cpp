// SPDX-License-Identifier: Apache-2.0
// The kinematic plant and the sensors on it, driven through the ports as the module would.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "algorithms/robot/leg_kinematics.hpp"
#include "sim_stub/sim_robot.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

SimOptions ideal(const StartPose& start = {0.6, 0.0, 0.0}) {
  SimOptions options;
  options.errors = ErrorParams::none();
  options.start = start;
  options.stairs.jitter_m = 0.0;
  options.camera.silent = {{0, std::numeric_limits<std::int64_t>::max()}};  // no pictures wanted here
  return options;
}

// Moves the base and the soles along smooth scripts in the true world, by the data sheet's leg kinematics.
class Script {
 public:
  explicit Script(SimRobot& robot) : robot_(robot) {
    base_ = {rotation_z(robot.start().yaw_rad),
             Vec3{-robot.start().distance_m, robot.start().lateral_m, kNominalBaseHeight_m}};
    for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
      sole(foot) =
          base_ * Transform{Mat3::Identity(), Vec3{0, side_sign(foot) * kStanceHalfWidth_m, -kNominalBaseHeight_m}};
    }
  }
  [[nodiscard]] Transform& sole(Foot foot) { return soles_[index_of(foot)]; }
  [[nodiscard]] const Vec3& base_m() const { return base_.p_m; }

  void base_to(const Vec3& target_m, int ticks) {
    const Vec3 from_m = base_.p_m;
    run(ticks, [&](double s) { base_.p_m = from_m + s * (target_m - from_m); });
  }
  void sole_to(Foot foot, const Vec3& target_m, int ticks) {
    const Vec3 from_m = sole(foot).p_m;
    run(ticks, [&](double s) { sole(foot).p_m = from_m + s * (target_m - from_m); });
  }
  // Downwards until the plant feels the ground.
  void land(Foot foot) {
    run(200, [&](double) {
      if (!robot_.truth().in_contact[index_of(foot)]) sole(foot).p_m.z() -= 0.0005;
    });
  }
  void wait(int ticks) {
    run(ticks, [](double) {});
  }
  // Called after every tick.
  std::function<void()> watch = [] {};

 private:
  template <typename Move>
  void run(int ticks, const Move& move) {
    for (int i = 1; i <= ticks && !robot_.truth().fell; ++i) {
      const double t = static_cast<double>(i) / ticks;
      move(t * t * t * (10.0 - 15.0 * t + 6.0 * t * t));
      JointCommand command;
      for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
        LegSolution leg = solve_leg({}, foot, base_.inverse() * sole(foot));
        // A foot in the air tips its toe down where the ankle bends no further.
        for (int k = 0; k < 45 && leg.q_rad[kAnklePitch] < -0.86 && !robot_.truth().in_contact[index_of(foot)]; ++k) {
          const Transform tip{rotation_y(0.02 * (k + 1)), Vec3::Zero()};
          leg = solve_leg({}, foot, base_.inverse() * sole(foot) * tip);
        }
        ASSERT_TRUE(leg.reachable && limit_margin_rad(nominal_robot().drives, foot, leg.q_rad) >= 0.0)
            << "the script asks too much: " << leg.q_rad.transpose();
        for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
          command.joints[joint_index(foot, j)].q_rad = leg.q_rad[static_cast<Eigen::Index>(j)];
          command.joints[joint_index(foot, j)].kp_nmprad = 1.0;
        }
      }
      ASSERT_TRUE(robot_.try_write(command).is_all());
      robot_.advance();
      watch();
    }
  }
  SimRobot& robot_;
  Transform base_;
  std::array<Transform, kFootCount> soles_;
};

JointCommand command_of(const JointVector& q_rad) {
  JointCommand command;
  for (std::size_t j = 0; j < kJointCount; ++j) {
    command.joints[j].q_rad = q_rad[static_cast<Eigen::Index>(j)];
    command.joints[j].kp_nmprad = 1.0;  // the first one with a gain takes over
  }
  return command;
}
JointVector encoders(SimRobot& robot) {
  JointFeedback feedback;
  EXPECT_TRUE(robot.try_read(feedback));
  return feedback.q_rad;
}
bool contains(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

TEST(SimStart, Seeds_DrawTheStartInItsRange) {
  StartPose least{1, 1, 1}, most{-1, -1, -1};
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const StartPose s = draw_start(seed);
    least = {std::min(least.distance_m, s.distance_m), std::min(least.lateral_m, s.lateral_m),
             std::min(least.yaw_rad, s.yaw_rad)};
    most = {std::max(most.distance_m, s.distance_m), std::max(most.lateral_m, s.lateral_m),
            std::max(most.yaw_rad, s.yaw_rad)};
  }
  const double yaw = 10.0 * kPi / 180.0;
  EXPECT_GE(least.distance_m, 0.35);
  EXPECT_LE(most.distance_m, 0.8);
  EXPECT_LT(least.distance_m, 0.37);
  EXPECT_GT(most.distance_m, 0.78);
  EXPECT_GE(least.lateral_m, -0.15);
  EXPECT_LE(most.lateral_m, 0.15);
  EXPECT_GE(least.yaw_rad, -yaw);
  EXPECT_LE(most.yaw_rad, yaw);
}

TEST(SimPlant, StandingStill_WithAllErrors_StaysStillAndReadsGravity) {
  SimOptions options = ideal();
  options.start.reset();
  options.errors = {};
  options.seed = 3;
  SimRobot robot(options);
  const Truth before = robot.truth();
  EXPECT_NEAR(before.true_T_base.p_m.z(), kNominalBaseHeight_m, 0.02);
  EXPECT_NEAR(before.true_T_base.p_m.x(), -robot.start().distance_m, 0.02);
  Vec3 gyro = Vec3::Zero(), accel = Vec3::Zero(), gyro2 = Vec3::Zero(), accel2 = Vec3::Zero();
  constexpr int kCount = 2000;
  ImuSample sample;
  ASSERT_TRUE(robot.try_read(sample));
  std::int64_t last_ns = sample.stamp_ns;
  for (int i = 0; i < kCount; ++i) {
    robot.advance();
    ASSERT_TRUE(robot.try_read(sample));
    EXPECT_EQ(sample.stamp_ns, last_ns + VirtualClock::kTick_ns);
    last_ns = sample.stamp_ns;
    gyro += sample.gyro_radps / kCount;
    accel += sample.accel_mps2 / kCount;
    gyro2 += sample.gyro_radps.cwiseAbs2() / kCount;
    accel2 += sample.accel_mps2.cwiseAbs2() / kCount;
  }
  EXPECT_FALSE(robot.truth().fell) << robot.truth().fall_reason;
  EXPECT_LT((robot.truth().true_T_base.p_m - before.true_T_base.p_m).norm(), 1e-4);
  EXPECT_LT(robot.truth().closure_error_m, 0.02);
  EXPECT_GT(robot.truth().closure_error_m, 1e-5);  // two legs with their own errors never agree
  // Gravity through tilt, mount and bias of this seed.
  const Mat3 imu_R_true = robot.errors().base_R_imu.transpose() * robot.truth().true_T_base.R.transpose();
  const Vec3 expected = imu_R_true * Vec3{0, 0, kGravity_mps2} + robot.errors().accel_bias_mps2;
  EXPECT_LT((accel - expected).norm(), 0.006);
  EXPECT_LT((gyro - robot.errors().gyro_bias_radps).norm(), 2.5e-4);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(std::sqrt(gyro2[i] - gyro[i] * gyro[i]), 2e-3, 1.5e-4);
    EXPECT_NEAR(std::sqrt(accel2[i] - accel[i] * accel[i]), 0.05, 4e-3);
  }
}

TEST(SimPlant, Encoders_OfManySeeds_HaveOffsetAndNoise) {
  double offsets2 = 0, noise2 = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SimOptions options = ideal();
    options.errors = {};
    options.seed = seed;
    SimRobot robot(options);
    const JointVector first = encoders(robot);
    robot.advance();
    const JointVector second = encoders(robot);
    offsets2 += (second - robot.true_q_rad()).squaredNorm();
    noise2 += (second - first).squaredNorm() / 2.0;
    count += static_cast<int>(kJointCount);
  }
  EXPECT_NEAR(std::sqrt(offsets2 / count), 2e-3, 2e-4);
  EXPECT_NEAR(std::sqrt(noise2 / count), 2e-4, 2e-5);
}

// Drives give way where two legs cannot both be as they are led: else no encoder would tell of its own offset.
TEST(SimPlant, LegsThatDisagreeAboutTheAttitude_StandFlatByTheirTrueAngles) {
  double given_rad = 0.0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    SimOptions options = ideal();
    options.errors = {};
    options.seed = seed;
    SimRobot robot(options);
    for (int i = 0; i < 100; ++i) robot.advance();
    for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
      const LegVector q = leg_joints(robot.true_q_rad(), foot);
      const Mat3 R = robot.truth().true_T_base.R * base_T_sole(robot.errors().legs[index_of(foot)], foot, q).R;
      EXPECT_LT(R.col(2).head<2>().norm(), 1e-4) << seed;
      const Transform home{Mat3::Identity(), Vec3{0.0, side_sign(foot) * kStanceHalfWidth_m, -kNominalBaseHeight_m}};
      const double led_rad = solve_leg({}, foot, home).q_rad[kAnkleRoll];
      const double drive_rad = leg_joints(robot.plant().drive_q_rad(), foot)[kAnkleRoll];
      given_rad = std::max(given_rad, std::abs(drive_rad - led_rad));
    }
  }
  EXPECT_GT(given_rad, 2e-3);
}

TEST(SimPlant, LegLengths_OfManySeeds_DifferFromTheDataSheet) {
  double squares = 0, apart = 0;
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    const RobotErrors errors = draw_errors({}, seed);
    const double left = errors.legs[0].thigh_m / LegGeometry{}.thigh_m - 1.0;
    const double right = errors.legs[1].thigh_m / LegGeometry{}.thigh_m - 1.0;
    squares += left * left / 500;
    apart += math::square(left - right) / 500;
  }
  EXPECT_NEAR(std::sqrt(squares), 0.005, 5e-4);
  EXPECT_NEAR(std::sqrt(apart), 0.005 * std::sqrt(0.2), 3e-4);
}

TEST(SimPlant, SmallStep_OfOneJoint_LagsByTenMillisecondsAfterTwo) {
  SimRobot robot(ideal());
  JointVector q = encoders(robot);
  const double start = q[kHipYaw];
  q[kHipYaw] += 0.01;
  ASSERT_TRUE(robot.try_write(command_of(q)).is_all());
  robot.advance();  // the command is on its way
  EXPECT_EQ(encoders(robot)[kHipYaw], start);
  for (int i = 0; i < 5; ++i) robot.advance();
  EXPECT_NEAR(encoders(robot)[kHipYaw] - start, 0.01 * (1.0 - std::exp(-1.0)), 1e-6);
}

TEST(SimPlant, LargeStep_OfEachJoint_KeepsTheDriveSpeed) {
  for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
    SimRobot robot(ideal());
    JointFeedback feedback;
    ASSERT_TRUE(robot.try_read(feedback));
    JointVector q = feedback.q_rad;
    q[static_cast<Eigen::Index>(j)] += 0.15;
    ASSERT_TRUE(robot.try_write(command_of(q)).is_all());
    double fastest = 0.0;
    for (int i = 0; i < 10; ++i) {
      robot.advance();
      ASSERT_TRUE(robot.try_read(feedback));
      fastest = std::max(fastest, feedback.dq_radps[static_cast<Eigen::Index>(j)]);
    }
    EXPECT_NEAR(fastest, joint_limits(Foot::kLeft, j).speed_radps, 1e-9) << j;
  }
}

TEST(SimPlant, StepInPlace_LiftsAndTouchesWithoutJumpsOfTheBase) {
  for (const bool with_errors : {false, true}) {
    SimOptions options = ideal();
    if (with_errors) options.errors = {};
    options.seed = 4;
    SimRobot robot(options);
    Script script(robot);
    Vec3 before = robot.truth().true_T_base.p_m, before2 = before;
    double hardest_mps2 = 0.0, jump_share = 0.0, share = 0.5;
    script.watch = [&] {
      const Vec3 now = robot.truth().true_T_base.p_m;
      hardest_mps2 = std::max(hardest_mps2, (now - 2.0 * before + before2).norm() / 4e-6);
      before2 = std::exchange(before, now);
      if (robot.truth().in_contact[0] && robot.truth().in_contact[1]) {
        jump_share = std::max(jump_share, std::abs(robot.truth().load_share[0] - share));
      }
      share = robot.truth().load_share[0];
    };
    const Vec3 home = script.base_m();
    script.base_to(home + Vec3{0, -0.1, 0}, 400);
    script.wait(100);
    EXPECT_TRUE(robot.truth().in_contact[0]);
    EXPECT_LT(robot.truth().load_share[0], 0.05);
    const Vec3 ground = script.sole(Foot::kLeft).p_m;
    script.sole_to(Foot::kLeft, ground + Vec3{0, 0, 0.05}, 250);
    EXPECT_FALSE(robot.truth().in_contact[0]);
    EXPECT_EQ(robot.truth().load_share[0], 0.0);
    EXPECT_EQ(robot.truth().load_share[1], 1.0);
    EXPECT_NEAR(robot.truth().true_T_sole[0].p_m.z(), 0.05, with_errors ? 0.01 : 1e-3);
    script.sole_to(Foot::kLeft, ground + Vec3{0.02, 0, -0.01}, 250);  // searches the ground
    EXPECT_TRUE(robot.truth().in_contact[0]);
    EXPECT_EQ(robot.truth().true_T_sole[0].p_m.z(), 0.0);
    EXPECT_NEAR(robot.truth().true_T_sole[0].p_m.x(), ground.x() + 0.02, 0.008);
    script.base_to(home, 800);  // its acceleration loads the foot it brakes on
    script.wait(100);
    EXPECT_NEAR(robot.truth().load_share[0], 0.5, 0.1);
    EXPECT_FALSE(robot.truth().fell) << robot.truth().fall_reason;
    EXPECT_LT(hardest_mps2, with_errors ? 2.5 : 2.0);  // the script itself asks for 0.9
    EXPECT_LT(jump_share, 0.015);                      // from one foot to the other at once it would be 0.029
  }
}

TEST(SimPlant, FootForce_AtLiftOffAndTouchDown_FollowsTheContactSixMillisecondsLater) {
  SimRobot robot(ideal());
  Script script(robot);
  std::array<bool, 4> contact{true, true, true, true};
  int changes = 0;
  script.watch = [&] {
    JointFeedback feedback;
    ASSERT_TRUE(robot.try_read(feedback));
    std::rotate(contact.begin(), contact.begin() + 1, contact.end());
    contact[3] = robot.truth().in_contact[0];
    ASSERT_EQ(feedback.foot_force_n[0] > 0.0, contact[0]);
    if (contact[0]) {
      ASSERT_GE(feedback.foot_force_n[0], 60.0);
    }
    changes += contact[0] != contact[1] ? 1 : 0;
  };
  const Vec3 ground = script.sole(Foot::kLeft).p_m;
  script.base_to(script.base_m() + Vec3{0, -0.1, 0}, 400);
  script.wait(100);
  script.sole_to(Foot::kLeft, ground + Vec3{0, 0, 0.05}, 250);
  script.sole_to(Foot::kLeft, ground - Vec3{0, 0, 0.003}, 250);
  script.wait(50);
  EXPECT_EQ(changes, 2);
  JointFeedback feedback;
  robot.advance();
  ASSERT_TRUE(robot.try_read(feedback));
  EXPECT_NEAR(feedback.foot_force_n[1], kRobotWeight_n, 30.0);
}

// Both feet onto the next tread, left one first.
void climb(Script& script, double advance_m, double rise_m) {
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    const Foot stance = other(foot);
    const Vec3 over = script.sole(stance).p_m, from = script.sole(foot).p_m;
    const double height_m = foot == Foot::kLeft ? 0.72 : 0.66;  // the trailing leg must reach down a tread
    script.base_to(over + Vec3{-0.02, -0.03 * side_sign(stance), height_m}, 500);
    script.wait(100);
    script.sole_to(foot, from + Vec3{-0.05, 0, 0.05}, 200);
    script.sole_to(foot, from + Vec3{-0.05, 0, rise_m + 0.1}, 300);
    script.sole_to(foot, from + Vec3{advance_m, 0, rise_m + 0.05}, 500);
    script.land(foot);
  }
}

TEST(SimPlant, ScriptedClimb_TwoTreads_StandsOnTheSecond) {
  SimOptions options = ideal({0.2, 0.0, 0.0});
  options.stairs.steps = 3;
  SimRobot robot(options);
  Script script(robot);
  double least_clearance = 1.0;
  const std::vector<SolidBox> solids = solids_of(robot.stairs());
  script.watch = [&] {
    for (const Transform& sole : robot.truth().true_T_sole) {
      least_clearance = std::min(least_clearance, clearance_m(collision_box(kSole, sole), solids));
    }
  };
  script.base_to(script.base_m() + Vec3{0, 0, -0.08}, 200);
  climb(script, 0.3, 0.13);
  EXPECT_EQ(robot.truth().step_index[0], 0) << robot.truth().fall_reason;
  EXPECT_EQ(robot.truth().step_index[1], 0);
  climb(script, 0.28, 0.13);
  EXPECT_FALSE(robot.truth().fell) << robot.truth().fall_reason;
  EXPECT_EQ(robot.truth().step_index[0], 1);
  EXPECT_EQ(robot.truth().step_index[1], 1);
  EXPECT_NEAR(robot.truth().true_T_sole[0].p_m.z(), 0.26, 1e-12);
  EXPECT_NEAR(robot.truth().true_T_sole[1].p_m.x(), 0.38, 2e-3);
  EXPECT_GT(sole_margin_m(robot.truth().true_T_sole[1], robot.stairs(), 1), 0.005);
  EXPECT_GT(least_clearance, -1e-6);
}

TEST(SimPlant, ScriptedClimb_WithAllErrors_TouchesAndLeavesOncePerSwing) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SimOptions options = ideal({0.2, 0.0, 0.0});
    options.errors = {};
    options.seed = seed;
    options.stairs.steps = 2;
    SimRobot robot(options);
    Script script(robot);
    std::array<bool, kFootCount> contact{true, true};
    int changes = 0;
    double largest_closure_m = 0.0;
    script.watch = [&] {
      for (std::size_t f = 0; f < kFootCount; ++f) changes += contact[f] != robot.truth().in_contact[f] ? 1 : 0;
      contact = robot.truth().in_contact;
      largest_closure_m = std::max(largest_closure_m, robot.truth().closure_error_m);
    };
    script.base_to(script.base_m() + Vec3{0, 0, -0.08}, 200);
    climb(script, 0.3, 0.13);
    EXPECT_FALSE(robot.truth().fell) << robot.truth().fall_reason;
    EXPECT_EQ(changes, 4) << seed;
    EXPECT_LT(largest_closure_m, 0.02);
    EXPECT_EQ(robot.truth().step_index, (std::array<int, 2>{0, 0}));
  }
}

TEST(SimPlant, CommandOutsideLimits_Falls) {
  SimRobot robot(ideal());
  JointVector q = encoders(robot);
  q[kKnee] = -0.5e-3;  // within the tolerance
  ASSERT_TRUE(robot.try_write(command_of(q)).is_all());
  robot.advance();
  robot.advance();
  EXPECT_FALSE(robot.truth().fell) << robot.truth().fall_reason;
  q[kKnee] = -2e-3;
  ASSERT_TRUE(robot.try_write(command_of(q)).is_all());
  robot.advance();
  robot.advance();
  EXPECT_TRUE(robot.truth().fell);
  EXPECT_TRUE(contains(robot.truth().fall_reason, "left leg joint 3")) << robot.truth().fall_reason;
}

TEST(SimPlant, CommandNotFinite_Falls) {
  SimRobot robot(ideal());
  JointVector q = encoders(robot);
  q[7] = std::numeric_limits<double>::quiet_NaN();
  ASSERT_TRUE(robot.try_write(command_of(q)).is_all());
  robot.advance();
  robot.advance();
  EXPECT_TRUE(robot.truth().fell);
  EXPECT_TRUE(contains(robot.truth().fall_reason, "not finite")) << robot.truth().fall_reason;
}

TEST(SimPlant, LiftOfALoadedFoot_Falls) {
  SimRobot robot(ideal());
  Script script(robot);
  script.sole_to(Foot::kLeft, script.sole(Foot::kLeft).p_m + Vec3{0, 0, 0.05}, 250);
  EXPECT_TRUE(robot.truth().fell);
  EXPECT_TRUE(contains(robot.truth().fall_reason, "Lifted a loaded foot")) << robot.truth().fall_reason;
}

TEST(SimPlant, WeightOnAFootBesideItsTread_Falls) {
  SimOptions options = ideal({0.25, 0.0, 0.0});
  options.stairs.steps = 2;
  SimRobot robot(options);
  Script script(robot);
  script.base_to(script.base_m() + Vec3{-0.02, -0.08, -0.07}, 400);
  script.wait(100);
  const Vec3 from = script.sole(Foot::kLeft).p_m;
  script.sole_to(Foot::kLeft, from + Vec3{-0.03, 0, 0.1}, 300);
  script.sole_to(Foot::kLeft, from + Vec3{-0.03, 0, 0.18}, 300);
  script.sole_to(Foot::kLeft, from + Vec3{0.18, 0, 0.17}, 300);  // centre 21 mm before the nosing
  script.sole_to(Foot::kLeft, from + Vec3{0.18, 0, 0.127}, 200);
  EXPECT_EQ(robot.truth().step_index[0], 0) << robot.truth().fall_reason;
  EXPECT_FALSE(robot.truth().fell) << robot.truth().fall_reason;  // not while it carries nothing
  script.base_to(script.base_m() + Vec3{0.05, 0.1, 0}, 400);
  EXPECT_TRUE(robot.truth().fell);
  EXPECT_TRUE(contains(robot.truth().fall_reason, "off the tread of step 1")) << robot.truth().fall_reason;
}

TEST(SimPlant, ToeIntoTheRiser_Falls) {
  SimRobot robot(ideal({0.25, 0.0, 0.0}));
  Script script(robot);
  script.base_to(script.base_m() + Vec3{0.02, -0.1, -0.08}, 400);
  script.wait(100);
  const Vec3 from = script.sole(Foot::kLeft).p_m;
  script.sole_to(Foot::kLeft, from + Vec3{0, 0, 0.05}, 250);
  script.sole_to(Foot::kLeft, from + Vec3{0.2, 0, 0.05}, 250);
  EXPECT_TRUE(robot.truth().fell);
  EXPECT_TRUE(contains(robot.truth().fall_reason, "left foot collided")) << robot.truth().fall_reason;
}

TEST(SimPlant, LegsThatPullApart_Fall) {
  SimRobot robot(ideal());
  Script script(robot);
  script.sole_to(Foot::kLeft, script.sole(Foot::kLeft).p_m + Vec3{0.1, 0, 0}, 400);
  EXPECT_TRUE(robot.truth().fell);
  EXPECT_TRUE(contains(robot.truth().fall_reason, "disagree")) << robot.truth().fall_reason;
}

TEST(SimPlant, BaseTooLow_Falls) {
  SimOptions options = ideal();
  options.plant.min_base_height_m = 0.6;
  SimRobot robot(options);
  Script script(robot);
  script.base_to(script.base_m() + Vec3{0, 0, -0.25}, 400);
  EXPECT_TRUE(robot.truth().fell);
  EXPECT_TRUE(contains(robot.truth().fall_reason, "sank")) << robot.truth().fall_reason;
}

TEST(SimLio, Poses_ArriveLateInTheirOwnWorldWithTheirNoise) {
  SimOptions options = ideal();
  options.errors = {};
  options.seed = 9;
  options.errors.lio_outage_from_s = seconds(VirtualClock::kStart_ns) + 2.0;
  options.errors.lio_outage_s = 1.0;
  SimRobot robot(options);
  int count = 0;
  std::int64_t last_ns = VirtualClock::kStart_ns - 100 * kNsPerMs, longest_ns = 0;
  Vec3 squares = Vec3::Zero();
  double turn2 = 0;
  for (int i = 0; i < 15000; ++i) {
    LioSample sample;
    while (robot.try_read(sample)) {
      EXPECT_EQ(robot.now_ns() - sample.stamp_ns, 100 * kNsPerMs);
      longest_ns = std::max(longest_ns, sample.stamp_ns - last_ns);
      last_ns = sample.stamp_ns;
      const Transform error =
          (robot.errors().lio_T_true * robot.truth().true_T_base * base_T_lidar()).inverse() * sample.lio_T_lidar;
      squares += error.p_m.cwiseAbs2();
      turn2 += math::square(Eigen::AngleAxisd(error.R).angle());
      ++count;
    }
    robot.advance();
  }
  EXPECT_EQ(count, 300 - 1 - 10);
  EXPECT_EQ(longest_ns, 1100 * kNsPerMs);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(std::sqrt(squares[i] / count), 0.010, 0.0015);
  EXPECT_NEAR(std::sqrt(turn2 / count / 3.0), 0.2 * kPi / 180.0, 4e-4);
  EXPECT_GT((robot.errors().lio_T_true.p_m).norm(), 0.1);
}

}  // namespace
}  // namespace polygmap::sim
