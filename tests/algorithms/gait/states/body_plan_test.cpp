// SPDX-License-Identifier: Apache-2.0
// Feet that stand otherwise to each other than planned: the plan follows, and their middle stays.
#include "algorithms/gait/states/body_plan.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

class FeetApart : public testing::Test {
 protected:
  FeetApart() {
    JointVector q_rad;
    for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
      const Transform sole{Mat3::Identity(), {0, side_sign(leg) * kStanceHalfWidth_m, -0.75}};
      q_rad.segment<6>(static_cast<Eigen::Index>(joint_index(leg, 0))) =
          solve_leg(nominal_robot().legs, leg, sole).q_rad;
    }
    EXPECT_TRUE(joints_.try_arm(nominal_robot(), {}, q_rad));
    const Transform odom_T_base{Mat3::Identity(), {0.3, -0.2, 0.75}};
    plan_.reset();
    plan_.start(joints_, odom_T_base);
    state_.odom_T_base = odom_T_base;
    state_.odom_T_sole = plan_.plan_T_sole();
    plan_.correct(state_, kCorrection_s);
    feedback_.foot_force_n = {200.0, 200.0};
    before_ = plan_.plan_T_sole();
  }
  void stand_for(double s) {
    for (int tick = 0; tick < s / kTick_s; ++tick) plan_.settle_feet_apart(params_, state_, feedback_);
  }
  [[nodiscard]] double planned_off_m() const {
    const auto apart_m = [](const std::array<Transform, kFootCount>& soles) -> Vec2 {
      return (soles[0].p_m - soles[1].p_m).head<2>();
    };
    return (apart_m(state_.odom_T_sole) - apart_m(plan_.plan_T_sole())).norm();
  }

  static constexpr double kCorrection_s = 0.03;
  FeetApartParams params_;
  JointReference joints_;
  BodyPlan plan_;
  StateEstimate state_;
  JointFeedback feedback_;
  std::array<Transform, kFootCount> before_;
};

TEST_F(FeetApart, BothCarry_PlanFollowsTheEstimateAndTheMiddleStays) {
  state_.odom_T_sole[0].p_m += Vec3{0.02, 0.05, 0.0};
  const double off_m = planned_off_m();
  stand_for(0.1);
  EXPECT_GE(planned_off_m(), off_m - 0.1 * params_.most_mps - 1e-3) << "faster than its speed";
  stand_for(2.0);
  EXPECT_NEAR(planned_off_m(), params_.least_m, 1e-3);
  const Vec3 moved_m =
      plan_.plan_T_sole(Foot::kLeft).p_m + plan_.plan_T_sole(Foot::kRight).p_m - (before_[0].p_m + before_[1].p_m);
  EXPECT_LT(moved_m.norm(), 1e-9);
  EXPECT_GT(plan_.plan_T_sole(Foot::kLeft).p_m.y(), before_[0].p_m.y());
}

// A base that leans has both elsewhere: that is not what the feet are off, and following it would go on for ever.
TEST_F(FeetApart, BothOffAlike_NothingMoves) {
  for (Transform& sole : state_.odom_T_sole) sole.p_m += Vec3{0.02, 0.01, 0.0};
  stand_for(1.0);
  for (std::size_t f = 0; f < kFootCount; ++f) {
    EXPECT_LT((plan_.plan_T_sole()[f].p_m - before_[f].p_m).norm(), 1e-12);
  }
}

TEST_F(FeetApart, OneHangsOrTellsNothing_NothingMoves) {
  state_.odom_T_sole[0].p_m.y() += 0.05;
  for (const double force_n : {0.0, params_.pressed_n - 1.0, std::numeric_limits<double>::quiet_NaN()}) {
    feedback_.foot_force_n = {200.0, force_n};
    stand_for(0.5);
    EXPECT_LT((plan_.plan_T_sole(Foot::kRight).p_m - before_[1].p_m).norm(), 1e-12) << force_n;
  }
}

}  // namespace
}  // namespace polygmap
