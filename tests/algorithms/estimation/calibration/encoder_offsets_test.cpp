// SPDX-License-Identifier: Apache-2.0
// Offsets of the legs' encoders against each other, from soles that stand flat.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "algorithms/estimation/estimator.hpp"
#include "algorithms/geometry/so3.hpp"
#include "tests/support/measured_legs.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kTick_s;

using Legs = std::array<LegMeasurement, kFootCount>;
using Contacts = std::array<FootContact, kFootCount>;

// A robot that stands on both flat soles, its left foot a step ahead, and whose encoders lie.
struct StandingRobot {
  JointVector true_q_rad = JointVector::Zero();
  JointVector offset_rad = JointVector::Zero();  // reading minus true angle
  JointVector torque_nm = JointVector::Zero();

  explicit StandingRobot(double base_pitch_rad = 0.0) {
    const Transform base_T_true{rotation_y(base_pitch_rad).transpose(), Vec3::Zero()};
    for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
      const double ahead_m = leg == Foot::kLeft ? 0.15 : -0.05;
      const Transform true_T_sole{Mat3::Identity(), Vec3{ahead_m, side_sign(leg) * kStanceHalfWidth_m, -0.75}};
      true_q_rad.segment<6>(static_cast<Eigen::Index>(joint_index(leg, 0))) =
          solve_leg({}, leg, base_T_true * true_T_sole).q_rad;
    }
  }
  [[nodiscard]] static Vec3 right_p_left_m(const JointVector& q_rad) {
    const Legs legs = measured(q_rad);
    return legs[0].base_T_sole.p_m - legs[1].base_T_sole.p_m;
  }
  [[nodiscard]] static Legs measured(const JointVector& q_rad) {
    return test::measured_legs({}, q_rad, JointVector::Zero());
  }
  void stand(EncoderOffsets& encoders, double time_s, const Contacts& contacts, double noise_rad = 0.0) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    for (double t_s = 0.0; t_s < time_s; t_s += kTick_s) {
      JointVector q_rad = true_q_rad + offset_rad - encoders.offset_rad();
      for (double& q : q_rad) q += noise_rad * normal(random);
      encoders.update(measured(q_rad), contacts, torque_nm, kTick_s);
    }
  }
};

Contacts both_stand() {
  Contacts contacts;
  for (FootContact& contact : contacts) contact.probability = 1.0;
  return contacts;
}

EncoderOffsets fresh() {
  EncoderOffsets encoders;
  encoders.reset({});
  return encoders;
}

// Half of a hip's offset is told by the soles' roll, and of the pitch's three joints more: the feet's distance, of 200
// robots, is known to .9 instead of 1.8 mm along and to 1.3 instead of 1.9 mm across.
TEST(EncoderOffsets, BothFeetStand_DistanceOfTheFeetIsBetterKnown) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Vec3 before_m2 = Vec3::Zero(), after_m2 = Vec3::Zero();
  constexpr int kRobots = 200;
  for (int n = 0; n < kRobots; ++n) {
    StandingRobot robot;
    for (double& offset_rad : robot.offset_rad) offset_rad = 2e-3 * normal(random);
    EncoderOffsets encoders = fresh();
    robot.stand(encoders, 2.0, both_stand(), 2e-4);
    const JointVector read_rad = robot.true_q_rad + robot.offset_rad;
    const Vec3 true_m = StandingRobot::right_p_left_m(robot.true_q_rad);
    before_m2 += (StandingRobot::right_p_left_m(read_rad) - true_m).cwiseAbs2() / kRobots;
    after_m2 += (StandingRobot::right_p_left_m(read_rad - encoders.offset_rad()) - true_m).cwiseAbs2() / kRobots;
  }
  const Vec3 before_m = before_m2.cwiseSqrt(), after_m = after_m2.cwiseSqrt();
  RecordProperty("along_mm", std::to_string(1e3 * before_m.x()) + " -> " + std::to_string(1e3 * after_m.x()));
  RecordProperty("across_mm", std::to_string(1e3 * before_m.y()) + " -> " + std::to_string(1e3 * after_m.y()));
  EXPECT_LT(after_m.x(), 0.72 * before_m.x());
  EXPECT_LT(after_m.y(), 0.78 * before_m.y());
}

// Robot and ground may lean as they like: only the soles against each other count.
TEST(EncoderOffsets, TorsoLeansAndEncodersAreRight_NothingIsFound) {
  StandingRobot robot(0.1);
  EncoderOffsets encoders = fresh();
  robot.stand(encoders, 2.0, both_stand());
  EXPECT_LT(encoders.offset_rad().cwiseAbs().maxCoeff(), 1e-6);
}

TEST(EncoderOffsets, BothLegsAreOffAlike_NothingIsFound) {
  StandingRobot robot;
  robot.offset_rad[kAnklePitch] = robot.offset_rad[kJointsPerLeg + kAnklePitch] = 3e-3;
  EncoderOffsets encoders = fresh();
  robot.stand(encoders, 2.0, both_stand());
  EXPECT_LT(encoders.offset_rad().cwiseAbs().maxCoeff(), 2e-5);
}

TEST(EncoderOffsets, OneFootInTheAir_NothingIsLearntNorTakenOff) {
  StandingRobot robot;
  robot.offset_rad[kHipPitch] = 4e-3;
  Contacts one_stands = both_stand();
  one_stands[0].probability = 0.9;
  EncoderOffsets encoders = fresh();
  const Vec2 before_rad = encoders.apart_sigma_rad();
  robot.stand(encoders, 2.0, one_stands);
  EXPECT_EQ(encoders.apart_sigma_rad(), before_rad);
  robot.stand(encoders, 0.09, both_stand());  // not settled yet
  EXPECT_EQ(encoders.apart_sigma_rad(), before_rad);
  robot.stand(encoders, 0.5, both_stand());
  const JointVector offset_rad = encoders.offset_rad();
  EXPECT_GT(offset_rad[kHipPitch], 1e-4);
  EXPECT_LT(offset_rad[kHipPitch], 6e-4);  // on its way
  robot.stand(encoders, 2.0, one_stands);
  EXPECT_EQ(encoders.offset_rad(), offset_rad);
  robot.stand(encoders, 1.0, both_stand());
  EXPECT_NEAR(encoders.offset_rad()[kHipPitch], 0.67e-3, 4e-5);
}

// Three sigmas of four joints, 2 mrad each, are 12 mrad.
TEST(EncoderOffsets, FootStandsOnAnEdge_IsNoOffset) {
  for (const double tilt_rad : {0.011, 0.013, 0.08}) {
    StandingRobot robot;
    robot.offset_rad[kAnkleRoll] = tilt_rad;
    EncoderOffsets encoders = fresh();
    robot.stand(encoders, 2.0, both_stand());
    EXPECT_NEAR(encoders.offset_rad()[kHipRoll], tilt_rad < 0.012 ? tilt_rad / 4 : 0.0, 2e-4) << tilt_rad;
  }
}

TEST(EncoderOffsets, RobotIsMovedBeforeEnoughIsKnown_LearnsAnew) {
  StandingRobot robot;
  robot.offset_rad[kHipRoll] = 2e-3;
  robot.true_q_rad[kAnkleRoll] += 0.008;  // put down on something
  EncoderOffsets encoders = fresh();
  robot.stand(encoders, 0.3, both_stand());
  encoders.learn_anew();
  robot.true_q_rad[kAnkleRoll] -= 0.008;
  robot.stand(encoders, 2.0, both_stand());
  EXPECT_NEAR(encoders.offset_rad()[kHipRoll], 0.5e-3, 1e-4);
  const JointVector before_rad = encoders.offset_rad();
  encoders.learn_anew();  // taken off already: the legs would jump
  EXPECT_EQ(encoders.offset_rad(), before_rad);
}

TEST(EncoderOffsets, LargeOffset_IsTakenOffSlowly) {
  StandingRobot robot;
  robot.offset_rad[kAnkleRoll] = 0.011;
  EncoderOffsets encoders = fresh();
  const EncoderOffsets::Params params;
  robot.stand(encoders, 0.5, both_stand());
  JointVector before_rad = encoders.offset_rad();
  double fastest_radps = 0.0;
  for (int i = 0; i < 3000; ++i) {
    encoders.update(StandingRobot::measured(robot.true_q_rad + robot.offset_rad - before_rad), both_stand(),
                    robot.torque_nm, kTick_s);
    fastest_radps = std::max(fastest_radps, (encoders.offset_rad() - before_rad).cwiseAbs().maxCoeff() / kTick_s);
    before_rad = encoders.offset_rad();
  }
  EXPECT_LE(fastest_radps, params.slew_radps * 1.001);
  EXPECT_NEAR(before_rad.cwiseAbs().maxCoeff(), 0.011 / 4, 2e-4);
}

// Ground that is as uneven as is allowed for.
TEST(EncoderOffsets, GroundIsNotLevelAlike_SigmaSaysSo) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const EncoderOffsets::Params params;
  const auto pitch_rad = [](const JointVector& q, int leg) {
    return q[6 * leg + kHipPitch] + q[6 * leg + kKnee] + q[6 * leg + kAnklePitch];
  };
  double squares = 0.0;
  constexpr int kRobots = 200;
  for (int n = 0; n < kRobots; ++n) {
    StandingRobot robot;
    for (double& offset_rad : robot.offset_rad) offset_rad = 2e-3 * normal(random);
    robot.true_q_rad[kAnklePitch] += params.enough_sigma_rad * normal(random);
    EncoderOffsets encoders = fresh();
    robot.stand(encoders, 2.0, both_stand());
    const double apart_rad = pitch_rad(robot.offset_rad, 0) - pitch_rad(robot.offset_rad, 1);
    const double found_rad = pitch_rad(encoders.offset_rad(), 0) - pitch_rad(encoders.offset_rad(), 1);
    squares += math::square((found_rad - apart_rad) / encoders.apart_sigma_rad().y()) / kRobots;
  }
  EXPECT_GT(squares, 0.7);
  EXPECT_LT(squares, 1.3);
}

// An ankle that leans on the inner edge of its sole tilts it with the ground.
TEST(EncoderOffsets, AnklesLeanInwards_IsTheGroundsGiveAndNoOffset) {
  const EncoderOffsets::Params params;
  StandingRobot robot;
  constexpr double kLean_nm = 6.0;
  robot.torque_nm[kAnkleRoll] = kLean_nm;
  robot.torque_nm[kJointsPerLeg + kAnkleRoll] = -kLean_nm;
  robot.true_q_rad[kAnkleRoll] += params.give_radpnm * kLean_nm;
  robot.true_q_rad[kJointsPerLeg + kAnkleRoll] -= params.give_radpnm * kLean_nm;
  EncoderOffsets encoders = fresh();
  robot.stand(encoders, 2.0, both_stand());
  EXPECT_LT(encoders.offset_rad().cwiseAbs().maxCoeff(), 5e-5);
  // Drives that tell no torque: a fourth of the tilt is taken for each joint's.
  robot.torque_nm.setConstant(std::nan(""));
  EncoderOffsets blind = fresh();
  robot.stand(blind, 2.0, both_stand());
  EXPECT_NEAR(blind.offset_rad()[kHipRoll], 0.5 * params.give_radpnm * kLean_nm, 1e-4);
}

// Later ground may give more: what the first seconds told is kept.
TEST(EncoderOffsets, EnoughIsKnown_NothingIsLearntAnyMore) {
  StandingRobot robot;
  robot.offset_rad[kHipRoll] = 2e-3;
  EncoderOffsets encoders = fresh();
  robot.stand(encoders, 3.0, both_stand());
  const JointVector before_rad = encoders.offset_rad();
  EXPECT_LE(encoders.apart_sigma_rad().maxCoeff(), EncoderOffsets::Params{}.enough_sigma_rad);
  EXPECT_NEAR(before_rad[kHipRoll], 0.5e-3, 5e-5);
  robot.true_q_rad[kAnkleRoll] += 0.01;
  robot.stand(encoders, 3.0, both_stand());
  EXPECT_EQ(encoders.offset_rad(), before_rad);
}

// The estimator's own angles are the corrected ones; a drive is told what its encoder will read.
TEST(EncoderOffsets, EstimatorStands_AnglesAreWithoutThem) {
  static Estimator estimator;  // its ring is too large for a stack
  estimator.reset({}, nominal_robot());
  StandingRobot robot;
  robot.offset_rad[kHipRoll] = 3e-3;
  for (int i = 1; i <= 1000; ++i) {
    ImuSample imu;
    JointFeedback joints;
    imu.stamp_ns = joints.stamp_ns = i * 2 * kNsPerMs;
    imu.accel_mps2 = Vec3{0, 0, kGravity_mps2};
    joints.q_rad = robot.true_q_rad + robot.offset_rad;
    joints.foot_force_n = {270.0, 270.0};
    estimator.add_imu(imu, imu.stamp_ns);
    const JointVector taken_off_rad = estimator.leg_sensing().offset_rad();
    estimator.add_joints(joints, joints.stamp_ns);
    EXPECT_LT((estimator.leg_sensing().joints().q_rad + taken_off_rad - joints.q_rad).cwiseAbs().maxCoeff(), 1e-15);
    estimator.tick({true, true});
  }
  EXPECT_TRUE(estimator.state().initialised);
  EXPECT_NEAR(estimator.leg_sensing().offset_rad()[kHipRoll], 0.75e-3, 0.1e-3);  // a fourth: two joints of two legs
  const auto& sole = estimator.state().odom_T_sole;
  EXPECT_LT(sole[0].R.col(2).cross(sole[1].R.col(2)).norm(), 2e-4);
}

}  // namespace
}  // namespace polygmap
