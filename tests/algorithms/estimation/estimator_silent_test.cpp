// SPDX-License-Identifier: Apache-2.0
// Drives and the feet's board that fall silent: what stands then, what the base is measured by, and for how long.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>

#include "algorithms/estimation/estimator.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/synthetic_walk.hpp"
#include "tests/support/ticks.hpp"

namespace polygmap {
namespace {

using test::kNaN;
using test::kTick_ns;
using test::SyntheticWalk;
using test::WalkSpec;

class EstimatorSilentTest : public ::testing::Test {
 protected:
  void SetUp() override {
    spec_.steps = 1;
    walk_.emplace(spec_);
    estimator_.reset({}, nominal_robot());
  }
  // While `holds`, at most to the walk's end. silence: takes away what is not told.
  void run_while(const std::function<bool()>& holds, const std::function<void(JointFeedback&)>& silence = {}) {
    for (; t_ns_ < walk_->end_ns() && holds(); t_ns_ += kTick_ns) {
      JointFeedback joints = walk_->joints(t_ns_);
      if (silence) silence(joints);
      estimator_.add_imu(walk_->imu(t_ns_), t_ns_);
      estimator_.add_joints(joints, t_ns_);
      estimator_.tick(walk_->truth(t_ns_).stance);
      if (estimator_.state().initialised && !true_T_odom_) {
        true_T_odom_ = walk_->truth(t_ns_).true_T_base * estimator_.state().odom_T_base.inverse();
      }
    }
  }
  void run_until(double time_s, const std::function<void(JointFeedback&)>& silence = {}) {
    run_while([&] { return seconds(t_ns_) < time_s; }, silence);
  }
  // Where it was, since then.
  static void silence_joint(JointFeedback& joints, const JointFeedback& last, std::size_t n) {
    const auto i = static_cast<Eigen::Index>(n);
    joints.q_rad[i] = last.q_rad[i];
    joints.dq_radps[i] = 0.0;
    joints.silent_cycles[n] = static_cast<std::uint16_t>((joints.stamp_ns - last.stamp_ns) / kTick_ns);
  }
  [[nodiscard]] double off_m() const {
    const Transform truth = walk_->truth(estimator_.state().stamp_ns).true_T_base;
    return (*true_T_odom_ * estimator_.state().odom_T_base.p_m - truth.p_m).norm();
  }

  static Estimator estimator_;  // its ring is too large for a stack
  WalkSpec spec_;
  std::optional<SyntheticWalk> walk_;
  std::optional<Transform> true_T_odom_;
  std::int64_t t_ns_ = 0;
};
Estimator EstimatorSilentTest::estimator_;

TEST_F(EstimatorSilentTest, MuteAnkleOfAStandingFoot_IsWhereTheSoleIsLevelAndTheOthersAreHeard) {
  spec_.noise_scale = 0.0;
  walk_.emplace(spec_);
  run_until(1.5);
  ASSERT_TRUE(estimator_.state().initialised);
  const JointFeedback last = walk_->joints(t_ns_ - kTick_ns);
  for (const LegJoint joint : {kAnklePitch, kAnkleRoll}) {
    const std::size_t n = joint_index(Foot::kRight, joint);
    const auto i = static_cast<Eigen::Index>(n);
    const std::int64_t end_ns = t_ns_ + 50 * kTick_ns, gives_way_ns = t_ns_ + 6 * kTick_ns;
    run_while([&] { return t_ns_ < end_ns; },
              [&](JointFeedback& joints) {
                silence_joint(joints, last, n);
                if (t_ns_ >= gives_way_ns) joints.q_rad[i] += 0.05;  // since it was heard
              });
    EXPECT_NEAR(estimator_.state().q_rad[i], walk_->joints(t_ns_ - kTick_ns).q_rad[i], 0.01) << joint;
    EXPECT_EQ(estimator_.state().heard_ns, t_ns_ - kTick_ns);
    EXPECT_LE(estimator_.state().oldest_input_ns, last.stamp_ns);
    EXPECT_TRUE(std::isnan(estimator_.leg_sensing().joints().tau_nm[i])) << "its last torque is no news";
  }
}

TEST_F(EstimatorSilentTest, Feet_JointsAreTakenOnAndTheAgeIsTheirs) {
  run_until(1.5);
  ASSERT_TRUE(estimator_.state().initialised);
  const std::int64_t since_ns = t_ns_ - kTick_ns;
  run_until(1.6, [](JointFeedback& joints) { joints.foot_force_n = {kNaN, kNaN}; });
  EXPECT_EQ(estimator_.leg_sensing().counters().invalid, 0U);
  EXPECT_EQ(estimator_.state().heard_ns, t_ns_ - kTick_ns);
  EXPECT_EQ(estimator_.state().oldest_input_ns, since_ns);
  EXPECT_GT(estimator_.state().contact_probability[0], 0.9) << "as planned";
  EXPECT_TRUE(std::isnan(estimator_.leg_sensing().joints().foot_force_n[0]));
}

// As where the left hip and the feet's board share a bus.
TEST_F(EstimatorSilentTest, FeetAndOtherLegWhileInTheAir_FootStandsAsPlannedAndMeasuresTheBase) {
  run_until(4.5);
  ASSERT_FALSE(walk_->truth(t_ns_).stance[1]);
  ASSERT_TRUE(walk_->truth(t_ns_).stance[0]);
  const JointFeedback last = walk_->joints(t_ns_ - kTick_ns);
  const auto bus_dies = [&](JointFeedback& joints) {
    joints.foot_force_n = {kNaN, kNaN};
    for (const LegJoint joint : {kHipRoll, kHipYaw, kHipPitch}) {
      silence_joint(joints, last, joint_index(Foot::kLeft, joint));
    }
  };
  run_while([&] { return !walk_->truth(t_ns_).stance[1]; }, bus_dies);
  EXPECT_EQ(estimator_.state().contact_probability[1], 0.0) << "it is planned in the air";
  run_until(1e3, bus_dies);
  EXPECT_EQ(estimator_.state().heard_ns, t_ns_ - kTick_ns);
  EXPECT_EQ(estimator_.state().contact_probability[1], 1.0);
  EXPECT_LT(estimator_.state().odom_v_base_mps.norm(), 0.01) << "it stands";
  EXPECT_LT(off_m(), 0.03);
}

TEST_F(EstimatorSilentTest, FeetAtLiftOff_SwingingFootIsNeitherOnTheGroundNorLevel) {
  run_while([&] { return walk_->truth(t_ns_ + kTick_ns).stance[0]; });
  ASSERT_GT(estimator_.leg_sensing().joints().foot_force_n[0] + estimator_.leg_sensing().joints().foot_force_n[1], 0.0);
  const JointFeedback last = walk_->joints(t_ns_);
  const std::size_t ankle = joint_index(Foot::kLeft, kAnklePitch);
  const auto silence = [&](JointFeedback& joints) {
    joints.foot_force_n = {kNaN, kNaN};
    silence_joint(joints, last, ankle);
  };
  run_while([&] { return walk_->truth(t_ns_).stance[0]; }, silence);
  double most = 0.0;
  int ticks = 0;
  run_while(
      [&] {
        most = std::max(most, ticks > 0 ? estimator_.state().contact_probability[0] : 0.0);
        ++ticks;
        return !walk_->truth(t_ns_).stance[0];
      },
      silence);
  EXPECT_GT(ticks, 150) << "longer than a foot that sticks";
  EXPECT_EQ(most, 0.0);
  EXPECT_NEAR(estimator_.state().q_rad[static_cast<Eigen::Index>(ankle)], last.q_rad[static_cast<Eigen::Index>(ankle)],
              0.01)
      << "the sole of a foot in the air may point anywhere";
  EXPECT_LT(off_m(), 0.01);
}

TEST_F(EstimatorSilentTest, ADriveOfEachLegForHalfAMinute_TheLegsBoundTheVelocityAllTheSame) {
  spec_.stand_s = 33.0;
  walk_.emplace(spec_);
  run_until(1.5);
  ASSERT_TRUE(estimator_.state().initialised);
  const JointFeedback last = walk_->joints(t_ns_ - kTick_ns);
  const auto silence = [&](JointFeedback& joints) {
    silence_joint(joints, last, joint_index(Foot::kLeft, kAnkleRoll));
    silence_joint(joints, last, joint_index(Foot::kRight, kKnee));
  };
  run_until(2.4, silence);  // as in a swing beside a mute leg: by the IMU alone
  EXPECT_LT(estimator_.state().odom_v_base_mps.norm(), 0.1);
  run_until(31.5, silence);
  EXPECT_EQ(estimator_.state().heard_ns, t_ns_ - kTick_ns);
  EXPECT_LT(estimator_.state().odom_v_base_mps.norm(), 0.01);
  EXPECT_LT(off_m(), 0.1);
}

TEST_F(EstimatorSilentTest, ADriveOfEachLegAndNoFootOnTheGround_IsHeardForASecond) {
  run_until(1.5);
  const JointFeedback last = walk_->joints(t_ns_ - kTick_ns);
  run_until(2.7, [&](JointFeedback& joints) {
    silence_joint(joints, last, joint_index(Foot::kLeft, kAnkleRoll));
    silence_joint(joints, last, joint_index(Foot::kRight, kAnkleRoll));
    joints.foot_force_n = {0.0, 0.0};
  });
  EXPECT_NEAR(seconds(t_ns_ - kTick_ns - estimator_.state().heard_ns), 1.2, 0.02);
}

}  // namespace
}  // namespace polygmap
