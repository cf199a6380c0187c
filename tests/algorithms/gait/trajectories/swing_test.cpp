// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/trajectories/swing.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "algorithms/gait/trajectories/step_plan.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

struct Case {
  double rise_m;
  double toe_down_rad;
};
constexpr Case kCases[]{{0.0, 0.0}, {0.10, 0.3}, {0.13, 0.2}, {0.17, 0.5}, {-0.05, 0.0}};
constexpr std::int32_t kTicks = 490;

Swing make(const Case& c, double retreat_m = 0.015) {
  SwingShape shape;
  shape.toe_down_rad = c.toe_down_rad;
  shape.retreat_m = retreat_m;
  Swing swing;
  swing.plan(kSole, {Mat3::Identity(), {0, 0.1, 0}}, {{0.28, 0.1, c.rise_m}, 0.0}, shape, kTicks);
  return swing;
}
double lowest_m(const Transform& sole) {
  return std::min((sole * Vec3{kCollisionRectangle.toe_x_m, 0, 0}).z(),
                  (sole * Vec3{kCollisionRectangle.heel_x_m, 0, 0}).z());
}
double front_m(const Transform& sole) {
  return std::max((sole * Vec3{kCollisionRectangle.toe_x_m, 0, 0}).x(),
                  (sole * Vec3{kCollisionRectangle.toe_x_m, 0, kCollisionHeight_m}).x());
}

TEST(Swing_Eq32, LiftAndLand_ReachApexAndTarget) {
  for (const Case& c : kCases) {
    const Swing swing = make(c);
    EXPECT_LT((swing.at(0).p_m - Vec3(0, 0.1, 0)).norm(), 1e-12);
    EXPECT_LT((swing.at(kTicks).p_m - Vec3(0.28, 0.1, c.rise_m)).norm(), 1e-9);
    EXPECT_LT((swing.at(kTicks).R - Mat3::Identity()).norm(), 1e-9);
    double apex = -1;
    for (int i = 0; i <= kTicks; ++i) apex = std::max(apex, lowest_m(swing.at(i)));
    EXPECT_NEAR(apex, std::max(c.rise_m, 0.0) + SwingShape{}.clearance_m, 1e-6);
  }
}

// As printed, eq. (32) jumps by z_0 when the landing begins.
TEST(Swing_Eq32Eq33, WholePath_IsContinuousInPositionAndSpeed) {
  for (const Case& c : kCases) {
    const Swing swing = make(c);
    for (int i = 2; i <= kTicks + 50; ++i) {
      const Vec3 v1 = (swing.at(i - 1).p_m - swing.at(i - 2).p_m) / kTick_s;
      const Vec3 v2 = (swing.at(i).p_m - swing.at(i - 1).p_m) / kTick_s;
      EXPECT_LT(v2.norm(), 1.6) << i;
      EXPECT_LT((v2 - v1).norm() / kTick_s, 25.0) << i;  // m/s2: no jump of the speed
    }
  }
}

TEST(Swing_Eq33, Forward_NeverOvershootsAndEndsBeforeTheLanding) {
  const Swing swing = make({0.13, 0.3});
  const SwingShape shape;
  for (int i = 0; i <= kTicks; ++i) EXPECT_LE(front_m(swing.at(i)), 0.28 + kCollisionRectangle.toe_x_m + 1e-9) << i;
  for (int i = 0; i <= kTicks; ++i) {
    const Transform sole = swing.at(i);
    if (i <= kTicks / 2) continue;
    // Nearly straight down over the last 30 mm, and straight over the last 5.
    const double above_m = lowest_m(sole) - 0.13;
    const double off_m = above_m < 0.005 ? 1e-4 : above_m < 0.03 ? shape.short_m + 1e-3 : 1.0;
    EXPECT_NEAR(sole.p_m.x(), 0.28, off_m) << i;
  }
  // Where it stops it may come too far.
  const double stops = shape.forward_end * kTicks;
  EXPECT_LT(front_m(swing.at(stops)), 0.28 + kCollisionRectangle.toe_x_m - 0.003);
}

TEST(Swing, RiserAtTheToe_RisesBeforeItGoesForward) {
  for (const Case& c : {Case{0.10, 0.3}, Case{0.13, 0.2}, Case{0.17, 0.5}}) {
    const Swing swing = make(c);
    for (int i = 0; i <= kTicks; ++i) {
      const Transform sole = swing.at(i);
      // 11 mm to the riser, which may be 10 mm nearer and 10 mm higher than mapped.
      if (lowest_m(sole) < c.rise_m + 0.01 && i < kTicks / 2) {
        EXPECT_LT(front_m(sole), kCollisionRectangle.toe_x_m + 0.001) << c.rise_m << " " << i;
      }
      const double toe_x = (sole * Vec3{kCollisionRectangle.toe_x_m, 0, 0}).x();
      if (std::abs(toe_x - kCollisionRectangle.toe_x_m - 0.011) < 0.003 && i > 50) {
        EXPECT_GT(lowest_m(sole), c.rise_m + 0.04) << i;
      }
    }
  }
}

// The foot stands 14 mm before the riser of the tread that the other foot stands on, and lands on the one beyond.
TEST(Swing, TwoRisersAhead_ClearsBothNosings) {
  constexpr double kTread_m = 0.28, kGap_m = 0.014;
  for (const double rise_m : {0.10, 0.13, 0.17}) {
    for (const StepTry& tried : kPassingTries) {
      const StepParams params;
      SwingShape shape = params.passing_swing;
      shape.toe_down_rad = tried.toe_down_rad;
      Swing swing;
      swing.plan(kSole, {Mat3::Identity(), {0, 0.1, 0}}, {{2 * kTread_m, 0.1, 2 * rise_m}, 0.0}, shape,
                 params.durations.passing_swing_ticks);
      const double riser_x_m = kCollisionRectangle.toe_x_m + kGap_m;
      double middle_m = 1e9, last_m = 1e9;  // least distance of a corner from the solid behind each riser
      for (int i = 0; i <= params.durations.passing_swing_ticks; ++i) {
        const Transform sole = swing.at(i);
        const bool lands = i > params.passing_swing.landing_begin * params.durations.passing_swing_ticks;
        for (const double x : {kCollisionRectangle.heel_x_m, kCollisionRectangle.toe_x_m}) {
          for (const double z : {0.0, kCollisionHeight_m}) {
            const Vec3 p = sole * Vec3{x, 0, z};
            middle_m = std::min(middle_m, std::max(riser_x_m - p.x(), p.z() - rise_m));
            if (!lands) {
              last_m = std::min(last_m, std::max(riser_x_m + kTread_m - p.x(), p.z() - 2 * rise_m));
            }
          }
        }
      }
      EXPECT_GT(middle_m, 0.005) << rise_m << " " << tried.toe_down_rad;
      EXPECT_GT(last_m, 0.015) << rise_m << " " << tried.toe_down_rad;
    }
  }
}

TEST(Swing, NothingFelt_GoesOnDownAtApproachSpeed) {
  const Swing swing = make({0.13, 0.3});
  EXPECT_NEAR(swing.at(kTicks + 100).p_m.z(), 0.13 - 0.2 * SwingShape{}.approach_mps, 1e-9);
  EXPECT_NEAR(swing.lowered_m(kTicks + 100), 0.2 * SwingShape{}.approach_mps, 1e-12);
  EXPECT_NEAR((swing.at(kTicks).p_m.z() - swing.at(kTicks - 1).p_m.z()) / kTick_s, -SwingShape{}.approach_mps, 1e-9);
}

TEST(Swing, BackBeyondTheStart_GoesOnDownAtApproachSpeed) {
  const Swing swing = make({0.13, 0.3});
  EXPECT_NEAR(swing.at(-100).p_m.z(), -0.2 * SwingShape{}.approach_mps, 1e-9);
  EXPECT_LT((swing.at(-100).p_m - swing.at(0).p_m).head<2>().norm(), 1e-12);
}

TEST(Swing, TiltedAndTurnedStart_LeavesItContinuouslyAndLandsFlat) {
  const Transform start{rotation_z(0.15) * rotation_y(0.004) * rotation_x(-0.003), {0, 0.1, 0}};
  Swing swing;
  swing.plan(kSole, start, {{0.2, 0.12, 0.0}, -0.05}, {}, kTicks);
  EXPECT_LT((swing.at(0).R - start.R).norm(), 1e-12);
  EXPECT_LT((swing.at(kTicks).R - rotation_z(-0.05)).norm(), 1e-9);
}

TEST(Quintic, EndsAndSpeeds_AreAsAsked) {
  const Quintic q({1.0, -0.5, 2.0}, {3.0, 0.25, -1.0}, 0.7);
  EXPECT_NEAR(q.at(0.0).acceleration, 2.0, 1e-12);
  EXPECT_NEAR(q.at(0.0).speed, -0.5, 1e-12);
  EXPECT_NEAR(q.at(0.7).position, 3.0, 1e-12);
  EXPECT_NEAR(q.at(0.7).speed, 0.25, 1e-11);
  EXPECT_NEAR(q.at(0.7).acceleration, -1.0, 1e-10);
  for (double t = 0.01; t < 0.69; t += 0.01) {
    EXPECT_NEAR(q.at(t).speed, (q.at(t + 1e-6).position - q.at(t - 1e-6).position) / 2e-6, 1e-6);
  }
}

}  // namespace
}  // namespace polygmap
