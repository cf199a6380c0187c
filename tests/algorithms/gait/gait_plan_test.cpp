// SPDX-License-Identifier: Apache-2.0
// What the gait tells of its plan is what it then does.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "tests/support/ideal_climb.hpp"

namespace polygmap {
namespace {

using test::IdealClimb;

constexpr std::int64_t kTick_ns = 2 * kNsPerMs;

GaitPlan plan_of(IdealClimb& climb) {
  GaitPlan plan;
  climb.gait().tell_plan(plan);
  return plan;
}
const PlannedStep* first_step(const GaitPlan& plan) { return plan.steps.empty() ? nullptr : &plan.steps[0]; }

TEST(GaitPlan, BeforeTheStart_IsNone) {
  IdealClimb climb({});
  ASSERT_TRUE(climb.tick());
  EXPECT_FALSE(plan_of(climb).planned);
  EXPECT_TRUE(plan_of(climb).bodies.empty());
}

// Lift-off and touch-down of every step of a climb: as announced when the weight set off, and when the foot lifted.
TEST(GaitPlan, EveryStep_LiftsAndLandsWhenAndWhereItSays) {
  IdealClimb climb({});
  std::uint32_t sequence = 0;
  std::optional<PlannedStep> shifting, lifted;
  int lift_offs_as_planned = 0, steps = 0;
  while (climb.tick() && climb.tick_count() < 20000) {
    const GaitPlan plan = plan_of(climb);
    const LatchedStep& step = climb.status().step;
    if (step.sequence != sequence) {  // it lifted in this tick
      sequence = step.sequence;
      ++steps;
      ASSERT_TRUE(shifting.has_value());
      EXPECT_EQ(shifting->certainty, StepCertainty::kPlanned);
      EXPECT_EQ(shifting->foot, step.foot);
      EXPECT_EQ(shifting->onto_tread, step.onto_tread);
      lift_offs_as_planned += shifting->lift_off_ns == step.latch_stamp_ns ? 1 : 0;
      lifted = *first_step(plan);
      EXPECT_EQ(lifted->certainty, StepCertainty::kLatched);
      EXPECT_EQ(lifted->lift_off_ns, step.latch_stamp_ns);
      EXPECT_EQ(lifted->target_m, step.odom_T_target.p_m);
      EXPECT_EQ(lifted->polygon_id, step.target.polygon_id);
      EXPECT_NEAR((lifted->target_m - shifting->target_m).norm(), 0.0, 0.015);
      // The swing of the shape that was found by then.
      EXPECT_EQ(lifted->touch_down_ns - lifted->lift_off_ns, shifting->touch_down_ns - shifting->lift_off_ns);
    }
    if (lifted && step.touch_down_stamp_ns != 0) {
      EXPECT_NEAR(seconds(step.touch_down_stamp_ns - lifted->touch_down_ns), 0.0, 0.012) << sequence;
      EXPECT_LT((step.odom_T_executed.p_m - lifted->target_m).norm(), 0.005);
      lifted.reset();
    }
    const PlannedStep* next = first_step(plan);
    if (next != nullptr && next->certainty == StepCertainty::kPlanned) shifting = *next;
  }
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_GE(steps, 10);
  EXPECT_EQ(lift_offs_as_planned, steps);
}

// The centre of mass goes where the plan said half a second before, and the base is over it.
TEST(GaitPlan, Bodies_AreWhereThePlanGoes) {
  struct Announced {
    PlannedBody body;
    std::uint32_t swing;
  };
  IdealClimb climb({});
  std::vector<Announced> announced;
  double com_off_m = 0.0, base_off_m = 0.0, zmp_off_m = 0.0, landing_off_m = 0.0;
  int compared = 0;
  std::optional<PlannedBody> landing;
  std::uint32_t swing = 0;
  while (climb.tick() && climb.tick_count() < 12000) {
    const GaitPlan plan = plan_of(climb);
    if (!plan.planned || climb.status().phase != GaitPhase::kSwing) continue;  // double support has several plans
    ASSERT_EQ(plan.bodies.size(), GaitPlan::kSamples);
    EXPECT_EQ(plan.bodies[0].stamp_ns, climb.status().stamp_ns);
    EXPECT_EQ(plan.odom_T_sole[0].p_m, climb.status().odom_T_sole_desired[0].p_m);
    EXPECT_EQ(plan.bodies[1].stamp_ns - plan.bodies[0].stamp_ns, GaitPlan::kSample_ticks * kTick_ns);
    EXPECT_LT((plan.bodies[0].p_com_m.head<2>() - climb.status().odom_p_com_desired_m).norm(), 0.005);
    for (const Announced& a : announced) {
      if (a.body.stamp_ns != plan.stamp_ns || a.swing != climb.status().step.sequence) continue;
      com_off_m = std::max(com_off_m, (a.body.p_com_m - plan.bodies[0].p_com_m).head<2>().norm());
      zmp_off_m = std::max(zmp_off_m, (a.body.zmp_m - plan.bodies[0].zmp_m).norm());
      base_off_m = std::max(base_off_m, (a.body.p_base_m - plan.bodies[0].p_base_m).norm());
      ++compared;
    }
    std::erase_if(announced, [&](const Announced& a) { return a.body.stamp_ns <= plan.stamp_ns; });
    // 0.3 s ahead, of the same plan: a swing's own, since the next one begins anew.
    if (climb.status().step.sequence != swing) landing = plan.landing;
    swing = climb.status().step.sequence;
    if (landing && plan.stamp_ns == landing->stamp_ns) {
      landing_off_m = std::max(landing_off_m, (landing->p_base_m - plan.bodies[0].p_base_m).norm());
    }
    announced.push_back({plan.bodies[6], climb.status().step.sequence});
  }
  EXPECT_GT(compared, 1000);
  EXPECT_LT(com_off_m, 0.001);
  EXPECT_LT(zmp_off_m, 0.001);
  // The base over it is told with the legs as they are.
  EXPECT_LT(base_off_m, 0.02);
  EXPECT_LT(landing_off_m, 0.03);
  EXPECT_GT(landing_off_m, 0.0);
}

TEST(GaitPlan, WhileALeadingFootSwings_TheRearOnesStepIsExpected) {
  IdealClimb climb({});
  bool expected = false;
  while (climb.tick() && climb.tick_count() < 20000 && !expected) {
    const GaitPlan plan = plan_of(climb);
    if (plan.steps.size() < 2) continue;
    expected = true;
    EXPECT_EQ(plan.steps[1].certainty, StepCertainty::kExpected);
    EXPECT_EQ(plan.steps[1].foot, other(plan.steps[0].foot));
    EXPECT_NEAR(plan.steps[1].target_m.z(), plan.steps[0].target_m.z(), 0.01);
    EXPECT_GT(plan.steps[1].lift_off_ns, plan.steps[0].touch_down_ns);
    EXPECT_GT(plan.steps[1].touch_down_ns, plan.steps[1].lift_off_ns);
  }
  EXPECT_TRUE(expected);
}

// A foot that finds no ground goes back: the target is where it stood, and no time is told.
TEST(GaitPlan, AFootThatGoesBack_ReturnsToWhereItStood) {
  IdealClimb climb({});
  ASSERT_TRUE(climb.run_until(GaitPhase::kSwing, 2));
  const Foot foot = climb.status().step.foot;
  const Vec3 stood_m = plan_of(climb).steps[0].target_m;
  climb.gait().request_stop(StopReason::kOperator);  // so early in the swing it is put back
  std::optional<PlannedStep> returning;
  for (int i = 0; i < 20 && !returning; ++i) {
    ASSERT_TRUE(climb.tick());
    const GaitPlan plan = plan_of(climb);
    if (!plan.steps.empty() && plan.steps[0].returns) returning = plan.steps[0];
  }
  ASSERT_TRUE(returning.has_value());
  EXPECT_EQ(returning->foot, foot);
  EXPECT_EQ(returning->touch_down_ns, 0);
  EXPECT_GT((returning->target_m - stood_m).norm(), 0.02);
}

}  // namespace
}  // namespace polygmap
