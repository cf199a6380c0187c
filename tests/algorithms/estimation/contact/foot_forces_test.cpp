// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/foot_forces.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/nominal_robot.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kNaN;

// A robot at rest whose feet press by some force, the torques exact.
class FootForcesTest : public testing::Test {
 protected:
  FootForcesTest() { forces_.reset({}); }
  std::array<double, kFootCount> tick(const std::array<double, kFootCount>& pressed_n,
                                      const std::array<double, kFootCount>& read_n) {
    JointFeedback joints;
    joints.stamp_ns = stamp_ns_ += 2'000'000;
    joints.foot_force_n = read_n;
    joints.silent_cycles[kKnee] = silent_cycles_;
    const Vec3 up = Vec3::UnitZ();
    ImuSample base;
    base.accel_mps2 = kGravity_mps2 * up;
    for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
      LegVector q;
      q << 0.0, 0.0, -0.4, 0.8, -0.4, 0.0;
      const auto at = static_cast<Eigen::Index>(joint_index(foot, 0));
      joints.q_rad.segment<6>(at) = q;
      std::array<Vec3, kJointsPerLeg> specific_mps2;
      specific_mps2.fill(-kGravity_mps2 * up);
      if (!tells_torques_) continue;
      joints.tau_nm.segment<6>(at) = leg_torques_nm(robot_.masses, foot, leg_frames(robot_.legs, foot, q),
                                                    specific_mps2, {pressed_n[index_of(foot)] * up, Vec3::Zero()});
    }
    joints.tau_nm *= told_share_ / forces_.torque_scale();
    forces_.update(robot_, body_frames(robot_.legs, joints.q_rad), joints, base, up,
                   {says_stands_ && pressed_n[0] > 0.0, says_stands_ && pressed_n[1] > 0.0});
    return forces_.up_n();
  }
  std::array<double, kFootCount> ticks(int count, const std::array<double, kFootCount>& pressed_n,
                                       const std::array<double, kFootCount>& offset_n) {
    std::array<double, kFootCount> up_n{};
    for (int i = 0; i < count; ++i) up_n = tick(pressed_n, {pressed_n[0] + offset_n[0], pressed_n[1] + offset_n[1]});
    return up_n;
  }

  RobotModel robot_ = nominal_robot();
  FootForces forces_;
  std::int64_t stamp_ns_ = 0;
  bool tells_torques_ = true, says_stands_ = true;
  double told_share_ = 1.0;  // of the torques that the legs need
  std::uint16_t silent_cycles_ = 0;
};

TEST_F(FootForcesTest, NoSensor_TorquesTellTheForce) {
  const auto up_n = ticks(100, {400.0, 140.0}, {kNaN, kNaN});
  EXPECT_NEAR(up_n[0], 400.0, 0.05 * 400.0) << "of which the damping takes most";
  EXPECT_NEAR(up_n[1], 140.0, 0.05 * 140.0);
}

TEST_F(FootForcesTest, NoTorques_SensorIsBelieved) {
  tells_torques_ = false;
  const auto up_n = ticks(1000, {400.0, 140.0}, {0.0, 0.0});
  EXPECT_NEAR(up_n[0], 400.0, 1e-9);
  EXPECT_NEAR(up_n[1], 140.0, 1e-9);
}

TEST_F(FootForcesTest, NeitherIsTold_IsNoNumber) {
  tells_torques_ = false;
  EXPECT_TRUE(std::isnan(ticks(1, {400.0, 140.0}, {kNaN, kNaN})[0]));
}

TEST_F(FootForcesTest, MuteDrive_OnlyTheOtherLegIsToldByTorques) {
  silent_cycles_ = JointFeedback::kCarried_cycles + 1;
  const auto up_n = ticks(100, {270.0, 270.0}, {kNaN, kNaN});
  EXPECT_TRUE(std::isnan(up_n[0]));
  EXPECT_NEAR(up_n[1], 270.0, 0.05 * 270.0);
}

TEST_F(FootForcesTest, SensorWithAnOffset_ItsZeroIsLearntFromTorquesWhileItCarries) {
  const auto first_n = ticks(1, {270.0, 270.0}, {60.0, -60.0});
  EXPECT_NEAR(first_n[0], 270.0, 15.0) << "torques are known better from the first";
  const auto up_n = ticks(1000, {270.0, 270.0}, {60.0, -60.0});
  EXPECT_NEAR(up_n[0], 270.0, 0.05 * 270.0);
  EXPECT_NEAR(up_n[1], 270.0, 0.05 * 270.0);
}

TEST_F(FootForcesTest, SensorWithAnOffset_AFootInTheAirPressesNothing) {
  (void)ticks(1000, {270.0, 270.0}, {60.0, -60.0});
  (void)ticks(200, {0.0, 540.0}, {60.0, -60.0});
  EXPECT_EQ(tick({0.0, 540.0}, {60.0, 480.0})[0], 0.0);
  // From the air the zero is known to some newtons: a touch is seen that torques alone would not tell.
  EXPECT_NEAR(tick({15.0, 525.0}, {75.0, 465.0})[0], 15.0, 4.0);
}

TEST_F(FootForcesTest, NoisySensor_TheForceIsLessNoisy) {
  (void)ticks(500, {0.0, 540.0}, {0.0, 0.0});  // from then on the torques are known to tell well
  std::mt19937 random(7);
  std::normal_distribution<double> noise_n(0.0, 20.0);
  double off_n2 = 0.0;
  constexpr int kTicks = 2000;
  for (int i = 0; i < kTicks; ++i) {
    const double sensed_n = 270.0 + noise_n(random);
    const double up_n = tick({270.0, 270.0}, {sensed_n, 270.0})[0];
    if (i > kTicks / 2) off_n2 += math::square(up_n - 270.0) / (0.5 * kTicks);
  }
  EXPECT_LT(std::sqrt(off_n2), 0.85 * 20.0) << "5 % of 270 N of it by the observed force's damping";
}

TEST_F(FootForcesTest, AFewNewtons_AreNoForceWhereOnlyTorquesTellThem) {
  EXPECT_EQ(ticks(100, {15.0, 525.0}, {kNaN, kNaN})[0], 0.0);
  EXPECT_NEAR(ticks(100, {40.0, 500.0}, {kNaN, kNaN})[0], 40.0, 3.0);
}

// Motors of a fifth less than they say: the weight is known, so that neither forces nor sensors' zeros go with them.
TEST_F(FootForcesTest, DrivesTellAFourthMore_ForcesAreThoseOfTheWeight) {
  told_share_ = 1.25;
  const double half_n = 0.5 * robot_.masses.total_kg() * kGravity_mps2;
  const auto by_torques_n = ticks(1000, {half_n, half_n}, {kNaN, kNaN});
  EXPECT_NEAR(forces_.torque_scale(), 1.25, 0.06 * 1.25) << "of which the damping takes most";
  EXPECT_NEAR(by_torques_n[0], half_n, 0.03 * half_n);
  forces_.reset({});
  (void)ticks(1000, {half_n, half_n}, {40.0, -40.0});
  EXPECT_NEAR(forces_.torque_scale(), 1.25, 0.06 * 1.25) << "of which the damping takes most";
  EXPECT_LT(ticks(50, {0.0, 2.0 * half_n}, {40.0, -40.0})[0], 25.0) << "that zero is not the weight's";
}

// The scale is not known yet when the robot first stands: torques that are a fourth too high would leave the zero of an
// exact sensor 67 N off.
TEST_F(FootForcesTest, DrivesTellAFourthMore_AnExactSensorKeepsItsZero) {
  told_share_ = 1.25;
  (void)ticks(1000, {270.0, 270.0}, {0.0, 0.0});
  tells_torques_ = false;
  EXPECT_NEAR(ticks(1, {270.0, 270.0}, {0.0, 0.0})[0], 270.0, 20.0);
}

// Nobody said yet that it stands, or the plan says early that it does not.
TEST_F(FootForcesTest, LoadedFootThatIsSaidToHang_TeachesNothing) {
  says_stands_ = false;
  (void)tick({270.0, 270.0}, {kNaN, kNaN});
  const double first_n = forces_.sigma_n()[0];
  (void)ticks(500, {270.0, 270.0}, {kNaN, kNaN});
  EXPECT_EQ(forces_.sigma_n()[0], first_n) << "it never stood";
  says_stands_ = true;
  (void)ticks(10, {270.0, 270.0}, {kNaN, kNaN});
  says_stands_ = false;
  (void)ticks(77, {270.0, 270.0}, {kNaN, kNaN});  // for longer nobody says so of a foot that is stuck
  EXPECT_EQ(forces_.sigma_n()[0], first_n) << "it lifts";
}

// It counts as 20 ms of a foot that is said to hang.
TEST_F(FootForcesTest, GapAfterLiftOff_TeachesNothing) {
  (void)ticks(10, {270.0, 270.0}, {kNaN, kNaN});
  const double first_n = forces_.sigma_n()[0];
  says_stands_ = false;
  stamp_ns_ += 1'000'000'000;
  (void)ticks(60, {270.0, 270.0}, {kNaN, kNaN});
  EXPECT_EQ(forces_.sigma_n()[0], first_n);
}

TEST_F(FootForcesTest, LongGap_ASensorsZeroWalksOn) {
  (void)ticks(500, {270.0, 270.0}, {0.0, 0.0});
  tells_torques_ = false;
  (void)tick({270.0, 270.0}, {270.0, 270.0});
  const double before_n = forces_.sigma_n()[0];
  stamp_ns_ += 100'000'000'000;
  (void)tick({270.0, 270.0}, {270.0, 270.0});
  EXPECT_GT(forces_.sigma_n()[0], before_n + 1.0) << "the walk of 100 s is ten newtons";
}

TEST_F(FootForcesTest, FootInTheAir_TellsHowWellTorquesDo) {
  (void)tick({270.0, 270.0}, {kNaN, kNaN});
  const double first_n = forces_.sigma_n()[0];
  (void)ticks(500, {0.0, 540.0}, {kNaN, kNaN});
  EXPECT_LT(forces_.sigma_n()[0], 0.5 * first_n) << "these torques are exact";
  EXPECT_EQ(forces_.sigma_n()[1], first_n) << "of a foot that stands nothing is learnt";
  const double torques_n = forces_.sigma_n()[0];
  (void)ticks(500, {0.0, 540.0}, {0.0, 0.0});
  EXPECT_LT(forces_.sigma_n()[0], 0.7 * torques_n) << "a sensor knows better";
  tells_torques_ = false;
  (void)tick({0.0, 540.0}, {kNaN, kNaN});
  EXPECT_TRUE(std::isnan(forces_.sigma_n()[0]));
}

}  // namespace
}  // namespace polygmap
