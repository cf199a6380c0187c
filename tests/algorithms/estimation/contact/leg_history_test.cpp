// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/leg_history.hpp"

#include <gtest/gtest.h>

#include "algorithms/core/time.hpp"

namespace polygmap {
namespace {

class LegHistoryTest : public testing::Test {
 protected:
  // The left foot at x and turned by angle_rad about y, the right one at -2 x and turned back.
  void push(std::int64_t stamp_ms, double x_m, double angle_rad = 0.0) {
    LegHistory::Legs legs;
    legs[0].base_T_sole = {rotation_y(angle_rad), {x_m, 0.1, -0.8}};
    legs[1].base_T_sole = {rotation_y(-angle_rad), {-2.0 * x_m, -0.1, -0.8}};
    history_.push(stamp_ms * kNsPerMs, legs);
  }
  [[nodiscard]] double left_x_m(double delay_s) const { return history_.before(delay_s).legs[0].base_T_sole.p_m.x(); }
  LegHistory history_;
};

TEST_F(LegHistoryTest, NoDelay_IsTheNewestExactly) {
  push(0, 0.13, 0.37);
  push(3, 0.77, 1.13);  // numbers of which an interpolation would lose a bit
  const LegHistory::Moment now = history_.before(0.0);
  EXPECT_EQ(now.legs[0].base_T_sole.p_m, Vec3(0.77, 0.1, -0.8));
  EXPECT_EQ(now.legs[1].base_T_sole.p_m, Vec3(-1.54, -0.1, -0.8));
  EXPECT_EQ(now.legs[0].base_T_sole.R, rotation_y(1.13));
  EXPECT_EQ(now.legs[1].base_T_sole.R, rotation_y(-1.13));
  EXPECT_EQ(left_x_m(-0.002), 0.77);  // nothing is known of what is to come
}

TEST_F(LegHistoryTest, DelayBetweenTwoSamples_PlaceAndRotationGoOnEvenly) {
  push(0, 0.0);
  push(1, 0.1, 0.2);
  push(5, 0.5, 1.0);
  const LegHistory::Moment then = history_.before(0.003);  // at 2 ms, a quarter of the way from 1 to 5 ms
  const Transform &left = then.legs[0].base_T_sole, &right = then.legs[1].base_T_sole;
  EXPECT_LT((left.p_m - Vec3(0.2, 0.1, -0.8)).norm(), 1e-15);
  EXPECT_LT((right.p_m - Vec3(-0.4, -0.1, -0.8)).norm(), 1e-15);
  EXPECT_LT((left.R - rotation_y(0.4)).norm(), 1e-14);
  EXPECT_LT((right.R - rotation_y(-0.4)).norm(), 1e-14);
  EXPECT_NEAR(left_x_m(0.0045), 0.05, 1e-15);  // half of the way from 0 to 1 ms
  EXPECT_EQ(left_x_m(0.004), 0.1);
}

TEST_F(LegHistoryTest, LongDelay_IsNoLongerAgoThanTheMost) {
  for (int i = 0; i <= 100; ++i) push(i, 1e-3 * i);  // the oldest that is held is 31 ms old
  EXPECT_NEAR(left_x_m(0.024), 0.076, 1e-15);
  EXPECT_NEAR(left_x_m(0.025), 0.075, 1e-15);
  EXPECT_NEAR(left_x_m(1.0), 0.075, 1e-15);
}

TEST_F(LegHistoryTest, DelayBeforeTheOldest_IsTheOldest) {
  push(10, 0.1, 0.2);
  EXPECT_EQ(left_x_m(0.02), 0.1);
  push(13, 0.3, 0.7);
  EXPECT_EQ(left_x_m(0.02), 0.1);
  EXPECT_EQ(history_.before(0.02).legs[1].base_T_sole.R, rotation_y(-0.2));
}

TEST_F(LegHistoryTest, ConstantSpeed_DifferencedSpeedConvergesOnIt) {
  push(0, 0.0);
  EXPECT_EQ(history_.before(0.0).base_v_foot_mps[0], Vec3::Zero());
  push(1, 3e-4);
  EXPECT_NEAR(history_.before(0.0).base_v_foot_mps[0].x(), 0.3 / 6.0, 1e-12);  // smoothed over 5 ms: 1 of 6
  for (int i = 2; i <= 100; ++i) push(i, 3e-4 * i);
  const LegHistory::Moment then = history_.before(0.01);
  EXPECT_LT((then.base_v_foot_mps[0] - Vec3(0.3, 0, 0)).norm(), 1e-7);  // (5/6)^100 of it is left
  EXPECT_LT((then.base_v_foot_mps[1] - Vec3(-0.6, 0, 0)).norm(), 1e-7);
  EXPECT_GT((then.base_v_foot_mps[0] - Vec3(0.3, 0, 0)).norm(), 1e-9);
}

TEST_F(LegHistoryTest, Clear_NeitherPlaceNorSpeedIsRemembered) {
  for (int i = 0; i <= 100; ++i) push(i, 3e-4 * i);
  history_.clear();
  push(101, 0.5);
  EXPECT_EQ(left_x_m(0.02), 0.5);
  EXPECT_EQ(history_.before(0.0).base_v_foot_mps[0], Vec3::Zero());
  EXPECT_EQ(history_.before(0.0).base_v_foot_mps[1], Vec3::Zero());
}

}  // namespace
}  // namespace polygmap
