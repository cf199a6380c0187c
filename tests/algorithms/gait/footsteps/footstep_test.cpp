// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>

#include "algorithms/gait/footsteps/footstep_plan.hpp"
#include "algorithms/gait/trajectories/step_search.hpp"
#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

TEST(FootOfTorso_Eq31, TurnedTorso_FeetStandBesideIt) {
  const TorsoPose torso{{1.0, 2.0, 0.9}, kPi / 2};  // eq. (29): x, y, z, phi
  const SolePose left = foot_of_torso(torso, Foot::kLeft, 0.1, 0.8);
  const SolePose right = foot_of_torso(torso, Foot::kRight, 0.1, 0.8);
  EXPECT_LT((left.position_m - Vec3(0.9, 2.0, 0.1)).norm(), 1e-12);
  EXPECT_LT((right.position_m - Vec3(1.1, 2.0, 0.1)).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(left.yaw_rad, kPi / 2);
}

TEST(FootOfTorso_Eq31, ThereAndBack_IsTheSameTorso) {
  const TorsoPose torso{{-0.3, 0.7, 0.8}, -2.9};
  const TorsoPose back = torso_of_foot(foot_of_torso(torso, Foot::kRight, 0.11, 0.79), Foot::kRight, 0.11, 0.79);
  EXPECT_LT((back.position_m - torso.position_m).norm(), 1e-12);
  EXPECT_NEAR(back.yaw_rad, torso.yaw_rad, 1e-12);
}

TEST(Overlap_Eq34, RandomRectangles_AgreesWithSampledPoints) {
  std::mt19937 random(7);
  std::uniform_real_distribution<> place(-0.3, 0.3), angle(-kPi, kPi);
  int together = 0, apart = 0;
  for (int i = 0; i < 1500; ++i) {
    const OrientedRectangle a{{place(random), place(random)}, 0.13, 0.048, angle(random)};
    const OrientedRectangle b{{place(random), place(random)}, 0.13, 0.048, angle(random)};
    const auto depth_in_b = [&](const Vec2& p) {  // how deep a point is inside b
      const Vec2 d = p - b.centre_m;
      const double along = math::cos(b.yaw_rad) * d.x() + math::sin(b.yaw_rad) * d.y();
      const double across = -math::sin(b.yaw_rad) * d.x() + math::cos(b.yaw_rad) * d.y();
      return std::min(b.half_length_m - std::abs(along), b.half_width_m - std::abs(across));
    };
    double deepest = -1.0;
    for (int u = -20; u <= 20; ++u) {
      for (int v = -20; v <= 20; ++v) {
        const double x = u / 20.0 * a.half_length_m, y = v / 20.0 * a.half_width_m;
        const Vec2 heading{math::cos(a.yaw_rad), math::sin(a.yaw_rad)};
        deepest = std::max(deepest, depth_in_b(a.centre_m + x * heading + y * Vec2{-heading.y(), heading.x()}));
      }
    }
    if (std::abs(deepest) < 0.01) continue;  // too close to call for a grid
    EXPECT_EQ(overlap(a, b), deepest > 0.0) << i;
    EXPECT_EQ(overlap(a, b), overlap(b, a)) << i;
    (deepest > 0.0 ? together : apart)++;
  }
  EXPECT_GT(together, 150);
  EXPECT_GT(apart, 150);
}

TEST(Displacement_Eq35, TurnedFrame_IsLocal) {
  const TorsoPose before{{1, 1, 0}, kPi / 2}, after{{1, 1.2, 0}, kPi / 2 + 0.1};
  const TorsoDisplacement step = displacement(before, after);
  EXPECT_LT((step.local_m - Vec3(0.2, 0, 0)).norm(), 1e-12);
  EXPECT_NEAR(step.turn_rad, 0.1, 1e-12);
}

TEST(Displacement_Eq35, AcrossTheCut_TurnsTheShortWay) {
  EXPECT_NEAR(displacement({{}, 3.1}, {{}, -3.1}).turn_rad, 2 * kPi - 6.2, 1e-12);
}

TEST(SwingFoot_Eq36, TurnsAndSideSteps_PickTheirSide) {
  const SwingRule rule;
  EXPECT_EQ(swing_foot({{0.1, 0.05, 0}, 0.0}, Foot::kRight, rule), Foot::kLeft);
  EXPECT_EQ(swing_foot({{0.1, -0.05, 0}, 0.0}, Foot::kLeft, rule), Foot::kRight);
  EXPECT_EQ(swing_foot({{0.1, 0, 0}, 0.1}, Foot::kRight, rule), Foot::kLeft);
  EXPECT_EQ(swing_foot({{0.1, 0, 0}, -0.1}, Foot::kLeft, rule), Foot::kRight);
}

TEST(SwingFoot_Eq36, StraightAhead_GaitStateDecides) {
  const SwingRule rule;
  EXPECT_EQ(swing_foot({{0.2, 0.002, 0}, 0.001}, Foot::kLeft, rule), Foot::kLeft);
  EXPECT_EQ(swing_foot({{0.2, -0.002, 0}, -0.001}, Foot::kRight, rule), Foot::kRight);
}

TEST(FloorStep_Eq34, RandomGoals_FeetNeverOverlapAndStayInLimits) {
  std::mt19937 random(3);
  std::uniform_real_distribution<> place(-0.6, 0.6), angle(-0.6, 0.6);
  const FloorStepLimits limits;
  for (int i = 0; i < 5000; ++i) {
    const Foot foot = i % 2 == 0 ? Foot::kLeft : Foot::kRight;
    const SolePose stance{{place(random), place(random), 0.02}, angle(random)};
    const TorsoPose goal{{place(random), place(random), 0.0}, angle(random)};
    const SolePose step = floor_step(kCollisionRectangle, stance, foot, goal, kStanceHalfWidth_m, limits);
    EXPECT_FALSE(
        overlap(foot_rectangle(kCollisionRectangle, step, 0.0), foot_rectangle(kCollisionRectangle, stance, 0.0)));
    EXPECT_DOUBLE_EQ(step.position_m.z(), stance.position_m.z());
    EXPECT_LE(std::abs(math::wrap_angle(step.yaw_rad - stance.yaw_rad)), limits.turn_rad + 1e-12);
    const Vec3 local = rotation_z(stance.yaw_rad).transpose() * (step.position_m - stance.position_m);
    EXPECT_LE(std::abs(local.x()), limits.forward_m + kStanceHalfWidth_m * limits.turn_rad + 1e-9);
    EXPECT_GT(side_sign(foot) * local.y(), 0.09);
    EXPECT_LT(side_sign(foot) * local.y(), 0.2 + limits.lateral_m + 0.13);
  }
}

TEST(FloorStep, GoalWithinOneStep_LandsBesideIt) {
  const SolePose stance{{0, -0.1, 0}, 0};
  const SolePose step = floor_step(kCollisionRectangle, stance, Foot::kLeft, {{0.15, 0.03, 0}, 0.1}, 0.1, {});
  const SolePose wanted = foot_of_torso({{0.15, 0.03, 0}, 0.1}, Foot::kLeft, 0.1, 0.0);
  EXPECT_LT((step.position_m - wanted.position_m).norm(), 1e-12);
}

StepPlan stair_step(StepKind kind, double rise_m, double ahead_m, std::array<Transform, kFootCount>& soles,
                    TorsoTrajectory::State& from) {
  const SolePose left{{kind == StepKind::kTrailing ? ahead_m : 0.0, 0.1, kind == StepKind::kTrailing ? rise_m : 0.0},
                      0};
  const SolePose right{{0, -0.1, 0}, 0};
  soles = {left.transform(), right.transform()};
  StepGoal goal;
  goal.kind = kind;
  goal.foot = kind == StepKind::kLeading ? Foot::kLeft : Foot::kRight;
  goal.target = {{ahead_m, side_sign(goal.foot) * 0.1, rise_m}, 0};
  const StepParams params;
  if (kind == StepKind::kTrailing) {
    StepGoal lead = goal;
    lead.kind = StepKind::kLeading;
    lead.foot = Foot::kLeft;
    lead.target = left;
    const StepPlan before = plan_step(params, lead, {SolePose{{0, 0.1, 0}, 0}, right}, kStepTries[0]);
    const auto start = TorsoTrajectory::at_rest({Mat3::Identity(), {0.0, 0.0, 0.79}});
    const StepKnots knots(nominal_robot(), params, params.knot_ticks, before, start,
                          {SolePose{{0, 0.1, 0}, 0}.transform(), right.transform()});
    from = TorsoTrajectory::at_rest({Mat3::Identity(), knots.torso_at_landing().position_m});
    TorsoTrajectory::set_horizontal(from, knots.com_at_landing());
  } else {
    from = TorsoTrajectory::at_rest({Mat3::Identity(), {0.0, 0.0, 0.79}});
  }
  return plan_step(params, goal, {left, right}, kStepTries[0]);
}

TEST(StepKnots_Eq30Eq37, WholeStep_KnotsAreEvenInTimeAndEndOnTheTarget) {
  std::array<Transform, kFootCount> soles;
  TorsoTrajectory::State from;
  const StepPlan plan = stair_step(StepKind::kLeading, 0.13, 0.28, soles, from);
  const StepParams params;
  const StepKnots knots(nominal_robot(), params, params.knot_ticks, plan, from, soles);
  ASSERT_EQ(knots.count(), 1 + (plan.shift_ticks + plan.swing_ticks + params.knot_ticks - 1) / params.knot_ticks);
  for (std::int32_t i = 0; i < knots.count(); ++i) EXPECT_EQ(knots[i].tick, params.knot_ticks * i);
  const StepKnot last = knots[knots.count() - 1];
  EXPECT_LT((last.odom_T_sole[0].p_m - plan.goal.target.position_m).norm(), 1e-9);
  EXPECT_NEAR(last.odom_T_base.p_m.z(), knots.torso_at_landing().position_m.z(), 1e-9);
  EXPECT_LT((knots[0].odom_T_sole[0].p_m - soles[0].p_m).norm(), 1e-12);
}

// Every rise and tread that the module climbs, from the floor and from a tread, at both ends of the stand-off.
TEST(StepSearch, RisesAndTreadsOfTheStairs_LegsCanDoAllOfThem) {
  StepParams params;
  params.knot_ticks = 2;
  for (const double rise : {0.10, 0.12, 0.13, 0.15, 0.17, 0.175}) {
    for (const double ahead : {0.27, 0.275, 0.285, 0.29, 0.298, 0.308}) {
      for (const StepKind kind : {StepKind::kLeading, StepKind::kTrailing}) {
        std::array<Transform, kFootCount> soles;
        TorsoTrajectory::State from;
        const StepPlan plan = stair_step(kind, rise, ahead, soles, from);
        const StepKnots knots(nominal_robot(), params, params.knot_ticks, plan, from, soles);
        StepFeasibility proof;
        proof.begin(nominal_robot(), knots);
        ASSERT_TRUE(proof.advance(nominal_robot(), params, knots.count()));
        const StepCheck& check = proof.check();
        EXPECT_TRUE(check.feasible) << rise << " " << ahead << " kind " << static_cast<int>(kind) << ": margin "
                                    << check.joint_margin_rad << " knee " << check.knee_rad << " speed "
                                    << check.speed_share;
      }
    }
  }
}

// The leg left behind on the lower tread: with a level sole its ankle runs out of range.
TEST(StepFeasibility, TrailingSwingWithALevelSole_MeetsTheAnklesLimitThatAPitchedOneKeepsOff) {
  std::array<Transform, kFootCount> soles;
  TorsoTrajectory::State from;
  StepPlan plan = stair_step(StepKind::kTrailing, 0.17, 0.28, soles, from);
  StepParams params;
  params.joint_margin_rad = 0.0;
  const auto ankle_margin_rad = [&](double toe_down_rad) {
    plan.shape.toe_down_rad = toe_down_rad;
    const StepKnots knots(nominal_robot(), params, params.knot_ticks, plan, from, soles);
    StepFeasibility proof;
    proof.begin(nominal_robot(), knots);
    EXPECT_TRUE(proof.advance(nominal_robot(), params, knots.count()));
    return proof.check().joint_margin_rad;
  };
  EXPECT_LT(ankle_margin_rad(0.0), 0.0);
  EXPECT_GT(ankle_margin_rad(kStepTries[0].toe_down_rad), StepParams{}.joint_margin_rad);
}

StepSearch::State finish(StepSearch& search, const StepParams& params = {}, int most_calls = 1000) {
  while (most_calls-- > 0 && search.step(nominal_robot(), params) == StepSearch::State::kSearching) {
  }
  return search.state();
}

// The rear foot, on the floor, passes the one that has just landed on the first tread.
struct PassingStep {
  std::array<Transform, kFootCount> soles;
  TorsoTrajectory::State from;
  StepGoal goal, trailing;
};
PassingStep passing_step(double rise_m, double ahead_m) {
  PassingStep step;
  (void)stair_step(StepKind::kTrailing, rise_m, ahead_m, step.soles, step.from);
  step.goal = {StepKind::kPassing, Foot::kRight, {{ahead_m + 0.28, -0.1, 2 * rise_m}, 0}, {}};
  step.trailing = {StepKind::kTrailing, Foot::kLeft, {{ahead_m + 0.28, 0.1, 2 * rise_m}, 0}, {}};
  return step;
}
StepSearch searched(const PassingStep& step, const StepParams& params = {}) {
  StepSearch search;
  search.begin(nominal_robot(), params, step.goal, step.trailing, params.stair_shift_ticks, step.from, step.soles);
  finish(search, params);
  return search;
}

TEST(StepSearch, PassingStepOfTheStairs_IsFoundWithTheTrailingStepAfterIt) {
  for (const double rise : {0.10, 0.13, 0.15, 0.17}) {
    for (const double ahead : {0.27, 0.285, 0.308}) {
      const StepSearch search = searched(passing_step(rise, ahead));
      EXPECT_EQ(search.state(), StepSearch::State::kFound) << rise << " " << ahead;
      EXPECT_EQ(search.plan().goal.kind, StepKind::kPassing);
      EXPECT_EQ(search.plan().swing_ticks, StepParams{}.passing_swing_ticks);
    }
  }
}

TEST(StepSearch, PassingStepThatIsPossibleWithNoTrailingStepAfterIt_IsImpossible) {
  PassingStep step = passing_step(0.13, 0.28);
  step.trailing.target.position_m.z() += 0.3;
  EXPECT_EQ(searched(step).state(), StepSearch::State::kImpossible);
  StepParams fast;
  fast.passing_swing_ticks = 300;
  EXPECT_EQ(searched(passing_step(0.13, 0.28), fast).state(), StepSearch::State::kImpossible);
}

// The left foot onto a tread, and the right one after it.
StepSearch leading_search(double rise_m, double ahead_m, const StepParams& params = {}) {
  std::array<Transform, kFootCount> soles;
  TorsoTrajectory::State from;
  const StepPlan plan = stair_step(StepKind::kLeading, rise_m, ahead_m, soles, from);
  StepGoal trailing = plan.goal;
  trailing.kind = StepKind::kTrailing;
  trailing.foot = Foot::kRight;
  trailing.target.position_m.y() = -0.1;
  StepSearch search;
  search.begin(nominal_robot(), params, plan.goal, trailing, params.stair_shift_ticks, from, soles);
  return search;
}

TEST(StepSearch, RiseTooFastForTheDrives_IsDoneInALongerSwing) {
  StepParams fast;
  fast.stair_swing_ticks = 430;
  StepSearch search = leading_search(0.182, 0.35, fast);
  EXPECT_EQ(finish(search, fast), StepSearch::State::kFound);
  EXPECT_GT(search.plan().swing_ticks, fast.stair_swing_ticks);
}

TEST(StepSearch, RiseBeyondTheLegs_IsImpossibleBeforeTheFirstLiftOff) {
  constexpr int kHalfAShift = 160;  // calls, one a tick: it is known before the foot would leave
  for (const double rise : {0.30, 0.5}) {
    StepSearch search = leading_search(rise, 0.3);
    EXPECT_EQ(finish(search, {}, kHalfAShift), StepSearch::State::kImpossible) << rise;
  }
}

TEST(StepSearch, ShiftFasterThanTheDrives_IsNotProvenByASlowerOne) {
  std::array<Transform, kFootCount> soles;
  TorsoTrajectory::State from;
  const StepPlan plan = stair_step(StepKind::kTrailing, 0.13, 0.28, soles, from);
  from[2].position -= 0.05;  // the torso has a way to go
  for (const std::int32_t shift_ticks : {StepParams{}.stair_shift_ticks, 15}) {
    StepSearch search;
    search.begin(nominal_robot(), {}, plan.goal, {}, shift_ticks, from, soles);
    EXPECT_EQ(finish(search) == StepSearch::State::kFound, shift_ticks > 15);
  }
}

TEST(ReachHeight, AtThatHeight_LegHasThatLength) {
  const LegGeometry g;
  std::mt19937 random(5);
  std::uniform_real_distribution<> place(-0.15, 0.15);
  for (int i = 0; i < 200; ++i) {
    const Foot leg = i % 2 == 0 ? Foot::kLeft : Foot::kRight;
    const SolePose sole{{place(random), side_sign(leg) * 0.1 + 0.5 * place(random), place(random)}, 0};
    const double z = reach_height_m(g, Vec3::Zero(), 0.0, leg, sole, 0.6);
    const LegSolution s = solve_leg(g, leg, Transform{Mat3::Identity(), Vec3{0, 0, z}}.inverse() * sole.transform());
    const double length = math::sqrt(g.thigh_m * g.thigh_m + g.shank_m * g.shank_m +
                                     2 * g.thigh_m * g.shank_m * math::cos(s.q_rad[kKnee]));
    EXPECT_NEAR(length, 0.6, 0.001);
  }
}

}  // namespace
}  // namespace polygmap
