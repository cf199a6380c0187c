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

TEST(Balance, AttitudeIsCorrected_CentreOfMassIsOffByAsMuchAsItIsSeenElsewhereAboveTheSoles) {
  const JointVector q_rad = bent_q_rad();
  const BodyFrames frames = body_frames({}, q_rad);
  const Vec3 base_p_com_m = centre_of_mass_m({}, base_p_links_m({}, frames));
  const Vec3 base_p_soles_m = 0.5 * (frames[0].sole.p_m + frames[1].sole.p_m);
  for (const Vec3& turned_rad : {Vec3{0.0, 0.035, 0.0}, Vec3{-0.02, 0.01, 0.0}}) {
    const Mat3 before_R = rotation_z(0.8) * rotation_y(0.05);
    Balance::Body body;
    body.odom_T_base.R = rotation_zyx(0.0, turned_rad.y(), turned_rad.x()) * before_R;
    body.q_rad = q_rad;
    Balance balance;
    const Vec2 shift_m = balance.turn(nominal_robot(), body, turned_rad);
    const Vec2 seen_m = ((body.odom_T_base.R - before_R) * (base_p_com_m - base_p_soles_m)).head<2>();
    EXPECT_GT(seen_m.norm(), 0.01);
    EXPECT_LT((shift_m - seen_m).norm(), 0.8e-3);
    EXPECT_LT((balance.odom_com_bias_m() - seen_m).norm(), 0.8e-3);
  }
}
}  // namespace
}  // namespace polygmap
