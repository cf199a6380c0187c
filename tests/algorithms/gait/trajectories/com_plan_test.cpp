// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/trajectories/com_plan.hpp"

#include <gtest/gtest.h>

#include "algorithms/core/time.hpp"

namespace polygmap {
namespace {

ZmpKnots knots(std::initializer_list<ZmpKnot> list) {
  ZmpKnots result;
  for (const ZmpKnot& knot : list) EXPECT_TRUE(result.try_push_back(knot));
  return result;
}

// Two steps to the left and on.
const ZmpKnots kWalk = knots({{75, {0, 0}}, {355, {0.1, 0.09}}, {850, {0.1, 0.09}}, {1130, {0.35, -0.09}}});

TEST(ComPlan, FromRest_StartsAndEndsAtRestAndKeepsThePendulumsLaw) {
  ComPlan plan;
  plan.plan({}, {}, kWalk);
  EXPECT_LT(plan.at(0).position_m.norm() + plan.at(0).velocity_mps.norm(), 1e-12);
  EXPECT_LT((plan.at(4000).position_m - Vec2(0.35, -0.09)).norm(), 1e-6);
  EXPECT_LT(plan.at(4000).velocity_mps.norm(), 1e-6);
  const double w = ComPlan::Params{}.omega_radps;
  for (int tick = 1; tick < 3000; ++tick) {
    const HorizontalMotion before = plan.at(tick - 1), now = plan.at(tick), after = plan.at(tick + 1);
    // Speeds are those of the positions, accelerations those of the pendulum over the zero-moment point.
    EXPECT_LT(((after.position_m - before.position_m) / (2 * kTick_s) - now.velocity_mps).norm(), 1e-4) << tick;
    EXPECT_LT((now.acceleration_mps2 - w * w * (now.position_m - plan.zmp_m(tick))).norm(), 1e-9) << tick;
    EXPECT_LT((after.acceleration_mps2 - now.acceleration_mps2).norm(), 0.06) << tick;  // no jump of the ZMP
  }
}

TEST(ComPlan, AfterThePush_ZmpIsOnItsStraightWay) {
  ComPlan plan;
  plan.plan({}, {}, kWalk);
  EXPECT_GT(ComPlan::zmp_offset_m({}, {}, kWalk), 0.005);
  EXPECT_LT((plan.zmp_m(200) - (200.0 - 75.0) / 280.0 * Vec2(0.1, 0.09)).norm(), 1e-12);
  EXPECT_EQ(plan.zmp_m(600), Vec2(0.1, 0.09));
}

TEST(ComPlan, MadeAgainOnItsWay_NeedsNoPush) {
  ComPlan plan;
  plan.plan({}, {}, kWalk);
  ComPlan again;
  const ZmpKnots rest_of_it = knots({{450, {0.1, 0.09}}, {730, {0.35, -0.09}}});
  again.plan({}, plan.at(400), rest_of_it);
  EXPECT_LT(ComPlan::zmp_offset_m({}, plan.at(400), rest_of_it), 1e-9);
  EXPECT_LT((again.at(300).position_m - plan.at(700).position_m).norm(), 1e-9);
}

TEST(ComPlan, InMotion_ComesToRest) {
  ComPlan plan;
  const HorizontalMotion moving{{0.1, 0.0}, {0.2, -0.1}, {0.3, 0.1}};
  plan.plan({}, moving, knots({{200, {0.12, 0.01}}}));
  EXPECT_LT((plan.at(0).velocity_mps - moving.velocity_mps).norm(), 1e-9);
  EXPECT_LT((plan.at(0).acceleration_mps2 - moving.acceleration_mps2).norm(), 1e-9);
  EXPECT_LT((plan.at(3000).position_m - Vec2(0.12, 0.01)).norm(), 1e-6);
}

}  // namespace
}  // namespace polygmap
