// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/balance/balance.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/bent_legs.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

using test::bent_q_rad;

TEST(Balance, FootThatHangs_DoesNotMoveThePlan) {
  JointVector q_rad = bent_q_rad();
  Balance::Reference reference;
  for (std::size_t f = 0; f < kFootCount; ++f) reference.plan_T_sole[f] = body_frames({}, q_rad)[f].sole;
  q_rad[static_cast<Eigen::Index>(joint_index(Foot::kRight, kHipPitch))] += 0.1;
  const auto moved_m = [&](double right_n) {
    Balance balance;
    Balance::Body body;
    body.q_rad = q_rad;
    JointFeedback feedback;
    feedback.foot_force_n = {500.0, right_n};
    (void)balance.torques_nm({}, nominal_robot(), reference, body, feedback, kTick_s);
    return balance.odom_p_com_planned_m().norm();
  };
  EXPECT_LT(moved_m(0.0), 1e-12);
  EXPECT_GT(moved_m(100.0), 0.02);
  EXPECT_EQ(moved_m(std::nan("")), moved_m(100.0));  // without forces both count
}
}  // namespace
}  // namespace polygmap
