// SPDX-License-Identifier: Apache-2.0
// Steps as a whole, their knots and the proof that the legs can do them.
#include "algorithms/gait/trajectories/step_search.hpp"

#include <gtest/gtest.h>

#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

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

// Down from a platform, both steps.
StepSearch::State search_down(const StepParams& params, double drop_m, double ahead_m) {
  StepGoal lead, trail;
  lead.kind = StepKind::kLeading, lead.foot = Foot::kRight, lead.target = {{ahead_m, -0.1, -drop_m}, 0};
  trail.kind = StepKind::kTrailing, trail.foot = Foot::kLeft, trail.target = {{ahead_m, 0.1, -drop_m}, 0};
  const std::array<Transform, kFootCount> soles{SolePose{{0, 0.1, 0}, 0}.transform(),
                                                SolePose{{0, -0.1, 0}, 0}.transform()};
  StepSearch search;
  search.begin(nominal_robot(), params, lead, trail, params.durations.stair_shift_ticks,
               TorsoTrajectory::at_rest({Mat3::Identity(), {0.0, 0.0, 0.79}}), soles);
  while (search.step(nominal_robot(), params) == StepSearch::State::kSearching) continue;
  return search.state();
}

TEST(StepSearch, DropsOfTheStairs_LegsCanDoAllOfThem) {
  for (const double drop_m : {0.04, 0.08, 0.10, 0.12, 0.13, 0.15, 0.17}) {
    for (const double ahead_m : {0.27, 0.285, 0.30}) {
      EXPECT_EQ(search_down({}, drop_m, ahead_m), StepSearch::State::kFound) << drop_m << " " << ahead_m;
    }
  }
}

TEST(StepSearch, DropOfAFifthOfAMetre_IsRefused) {
  EXPECT_EQ(search_down({}, 0.20, 0.285), StepSearch::State::kImpossible);
}

TEST(StepSearch, HighDropWithATorsoThatLeansNoMore_IsRefused) {
  StepParams params;
  params.down.most_share = 1.0;
  EXPECT_EQ(search_down(params, 0.17, 0.285), StepSearch::State::kImpossible);
}

TEST(StepPlan, DownAfterTheOtherFoot_HeelRisesAboutTheToesEdge) {
  const StepParams params;
  StepGoal goal;
  goal.kind = StepKind::kTrailing, goal.foot = Foot::kLeft, goal.target = {{0.28, 0.1, -0.13}, 0};
  const SolePair soles{SolePose{{0, 0.1, 0}, 0}, SolePose{{0.28, -0.1, -0.13}, 0}};
  ASSERT_TRUE(goes_down(goal, soles));
  const StepPlan plan = plan_step(params, goal, soles, tries_for(params, goal, soles)[0]);
  EXPECT_GT(plan.heel_up_rad, 0.2);
  EXPECT_EQ(plan.heel_up_rad_at(0), 0.0);
  EXPECT_EQ(plan.heel_up_rad_at(plan.shift_ticks), plan.heel_up_rad);
  const Vec3 toe_m{kContactRectangle.toe_x_m, 0.0, 0.0};
  const Transform turned = turned_about_toe(nominal_robot().sole, plan.heel_up_rad);
  EXPECT_LT((turned * toe_m - toe_m).norm(), 1e-12);
  EXPECT_GT((turned * Vec3{kContactRectangle.heel_x_m, 0.0, 0.0}).z(), 0.03);
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
                                    << check.speed_share << " torque " << check.torque_share;
      }
    }
  }
}

// The leg left behind on the lower tread: with a level sole its ankle runs out of range.
TEST(StepFeasibility, TrailingSwingWithALevelSole_MeetsTheAnklesLimitThatAPitchedOneKeepsOff) {
  std::array<Transform, kFootCount> soles;
  TorsoTrajectory::State from;
  StepPlan plan = stair_step(StepKind::kTrailing, 0.17, 0.28, soles, from);
  plan.joint_margin_rad = 0.0;
  const StepParams params;
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

// By hand: with all weight in the torso and a step so slow that nothing accelerates, the knee holds the weight over
// its distance from the zero-moment point.
TEST(StepFeasibility, SlowStepOfATorsoOnly_KneeHoldsTheWeightOverItsArm) {
  std::array<Transform, kFootCount> soles;
  TorsoTrajectory::State from;
  StepPlan plan = stair_step(StepKind::kTrailing, 0.13, 0.28, soles, from);
  TorsoTrajectory::set_horizontal(from, {from[0].position * Vec2::UnitX() + from[1].position * Vec2::UnitY()});
  plan.shift_ticks = plan.swing_ticks = 4000;
  plan.rise_ticks = 3000;
  RobotModel robot = nominal_robot();
  robot.masses.torso.mass_kg = robot.masses.total_kg();
  for (auto& link : robot.masses.leg) link.mass_kg = 0.0;
  StepParams params;
  params.torque_share = 10.0;
  params.knot_ticks = 40;
  const StepKnots knots(robot, params, params.knot_ticks, plan, from, soles);
  StepFeasibility proof;
  proof.begin(robot, knots);
  ASSERT_TRUE(proof.advance(robot, params, knots.count()));

  double by_hand = 0.0;
  for (std::int32_t i = 0; i < knots.count(); ++i) {
    StepKnot knot = knots[i];
    if (!knots.swings_at(knot.tick)) continue;
    const Vec3 odom_centre_m = knot.odom_T_base.R * robot.masses.torso.centre_m;
    knot.odom_T_base.p_m.head<2>() -= odom_centre_m.head<2>();
    const Foot stance = knots.stance();
    const LegVector q =
        solve_leg(robot.legs, stance, knot.odom_T_base.inverse() * knot.odom_T_sole[index_of(stance)]).q_rad;
    const Vec3 odom_p_knee = knot.odom_T_base * leg_frames(robot.legs, stance, q).joint[kKnee].p_m;
    const double arm_m = std::abs(odom_p_knee.x() - knot.odom_zmp_m.x());
    const double limit_nm = robot.drives.limits[joint_index(stance, kKnee)].torque_nm;
    by_hand = std::max(by_hand, robot.masses.total_kg() * kGravity_mps2 * arm_m / limit_nm);
  }
  EXPECT_GT(by_hand, 0.5);
  EXPECT_NEAR(proof.check().torque_share, by_hand, 0.03 * by_hand);
}

StepSearch::State finish(StepSearch& search, const StepParams& params = {}, int most_calls = 1000,
                         const RobotModel& robot = nominal_robot()) {
  while (most_calls-- > 0 && search.step(robot, params) == StepSearch::State::kSearching) {
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
StepSearch searched(const PassingStep& step, const StepParams& params = {}, const RobotModel& robot = nominal_robot()) {
  StepSearch search;
  search.begin(robot, params, step.goal, step.trailing, params.durations.stair_shift_ticks, step.from, step.soles);
  finish(search, params, 1000, robot);
  return search;
}

TEST(StepSearch, PassingStepOfTheStairs_IsFoundWithTheTrailingStepAfterIt) {
  for (const double rise : {0.10, 0.13, 0.15, 0.17}) {
    for (const double ahead : {0.27, 0.285, 0.308}) {
      const StepSearch search = searched(passing_step(rise, ahead));
      EXPECT_EQ(search.state(), StepSearch::State::kFound) << rise << " " << ahead;
      EXPECT_EQ(search.plan().goal.kind, StepKind::kPassing);
      EXPECT_EQ(search.plan().swing_ticks, StepParams{}.durations.passing_swing_ticks);
    }
  }
}

TEST(StepSearch, PassingStepThatTheKneeCannotLiftInTime_IsDoneMoreSlowlyOrNotAtAll) {
  const PassingStep step = passing_step(0.17, 0.285);
  const auto tried_with = [&](double torque_share) {
    StepParams weak;
    weak.torque_share = torque_share;
    const StepSearch search = searched(step, weak);
    EXPECT_EQ(search.state(), StepSearch::State::kFound) << torque_share;
    return search.plan().tried;
  };
  EXPECT_EQ(tried_with(1.0).longer, 1.0);
  EXPECT_GT(tried_with(0.85).longer, 1.0);
  EXPECT_EQ(tried_with(0.85).rise_longer, 1.0);
  EXPECT_GT(tried_with(0.81).rise_longer, 1.0);
  StepParams too_weak;
  too_weak.torque_share = 0.6;
  EXPECT_EQ(searched(step, too_weak).state(), StepSearch::State::kImpossible);
}

// The knee bends deeper than on lower stairs, and balance and weak drives take their share of it.
TEST(StepSearch, TrailingStepUpAHighRise_IsDoneSlowlyAndKeepsTorqueBack) {
  for (const double rise : {0.17, 0.19, 0.2, 0.21, 0.22}) {
    std::array<Transform, kFootCount> soles;
    TorsoTrajectory::State from;
    const StepPlan plan = stair_step(StepKind::kTrailing, rise, 0.28, soles, from);
    StepSearch search;
    search.begin(nominal_robot(), {}, plan.goal, {}, StepParams{}.durations.stair_shift_ticks, from, soles);
    ASSERT_EQ(finish(search), StepSearch::State::kFound) << rise;
    EXPECT_EQ(search.plan().tried.longer > 1.0, rise > StepParams{}.high.from_m) << rise;
    const StepKnots knots(nominal_robot(), {}, 2, search.plan(), from, soles);
    StepFeasibility proof;
    proof.begin(nominal_robot(), knots);
    ASSERT_TRUE(proof.advance(nominal_robot(), {}, knots.count()));
    EXPECT_LT(proof.check().torque_share, 0.9) << rise;
  }
}

// All else alike: a drive that has all its torque at rest only.
TEST(StepSearch, PassingStepForWhichTheTurningKneeLacksTorque_IsDoneMoreSlowlyOrNotAtAll) {
  const auto searched_with = [](double no_load_radps) {
    RobotModel robot = nominal_robot();
    for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
      JointLimits& knee = robot.drives.limits[joint_index(leg, kKnee)];
      knee.corner_radps = 0.1;
      knee.no_load_radps = no_load_radps;
    }
    return searched(passing_step(0.17, 0.285), {}, robot);
  };
  EXPECT_EQ(searched_with(12.0).state(), StepSearch::State::kFound);
  EXPECT_EQ(searched_with(12.0).plan().tried.longer, 1.0);
  EXPECT_EQ(searched_with(7.5).state(), StepSearch::State::kFound);
  EXPECT_GT(searched_with(7.5).plan().tried.longer, 1.0);
  EXPECT_EQ(searched_with(5.0).state(), StepSearch::State::kImpossible);
}

TEST(StepSearch, PassingStepThatIsPossibleWithNoTrailingStepAfterIt_IsImpossible) {
  PassingStep step = passing_step(0.13, 0.28);
  step.trailing.target.position_m.z() += 0.3;
  EXPECT_EQ(searched(step).state(), StepSearch::State::kImpossible);
  StepParams fast;
  fast.durations.passing_swing_ticks = 220;
  EXPECT_EQ(searched(passing_step(0.13, 0.28), fast).state(), StepSearch::State::kImpossible);
}

// The left foot, on a tread, landed so far out that the ankle left behind hardly reaches: no step would have led there,
// but the way on from there is none the less the rear foot's.
TEST(StepSearch, TrailingStepFromAWideStance_IsDoneWhereNoLeadingStepWouldHaveLed) {
  StepParams params;
  params.stair_swing.air_roll_rad = 0.0;  // the ankle in the air, which either step has alike, is not the question
  const auto search_from = [&](double wider_m, StepKind kind) {
    std::array<Transform, kFootCount> soles;
    TorsoTrajectory::State from;
    StepPlan plan = stair_step(kind, 0.13, 0.28, soles, from);
    StepGoal trailing = plan.goal;
    if (kind == StepKind::kTrailing) {
      soles[0].p_m.y() += wider_m;
    } else {
      plan.goal.target.position_m.y() += wider_m;
      trailing = {StepKind::kTrailing, Foot::kRight, {{0.28, -0.1, 0.13}, 0}, {}};
    }
    StepSearch search;
    search.begin(nominal_robot(), params, plan.goal, trailing, params.durations.stair_shift_ticks, from, soles);
    return finish(search, params);
  };
  int rescued = 0;
  for (double wider_m = 0.0; wider_m < 0.1; wider_m += 0.0025) {
    const bool leads = search_from(wider_m, StepKind::kLeading) == StepSearch::State::kFound;
    const bool trails = search_from(wider_m, StepKind::kTrailing) == StepSearch::State::kFound;
    EXPECT_TRUE(trails || !leads) << wider_m;
    rescued += trails && !leads;
  }
  EXPECT_GE(rescued, 2);
}

// A leg that leans far out while its foot is in the air: there the sole may roll where the ankle's range ends.
TEST(StepSearch, FootBroughtBackFromAWideStance_IsPossibleWhereTheSoleMayRollInTheAir) {
  const auto closes = [](double wider_m, double air_roll_rad) {
    StepParams params;
    params.floor_swing.air_roll_rad = air_roll_rad;
    const std::array<Transform, kFootCount> soles{SolePose{{0, 0.1 + wider_m, 0}, 0}.transform(),
                                                  SolePose{{0, -0.1, 0}, 0}.transform()};
    StepGoal goal;
    goal.kind = StepKind::kClosing;
    goal.foot = Foot::kLeft;
    goal.target = {{0, 0.1, 0}, 0};
    const auto from = TorsoTrajectory::at_rest({Mat3::Identity(), {0.0, 0.5 * wider_m, 0.76}});
    StepSearch search;
    search.begin(nominal_robot(), params, goal, {}, params.durations.floor_shift_ticks, from, soles);
    return finish(search, params) == StepSearch::State::kFound;
  };
  EXPECT_TRUE(closes(0.0, 0.0));
  int gained = 0;
  for (double wider_m = 0.0; wider_m < 0.1; wider_m += 0.0025) {
    const bool level = closes(wider_m, 0.0), rolled = closes(wider_m, 0.1);
    EXPECT_TRUE(rolled || !level) << wider_m;
    gained += rolled && !level;
  }
  EXPECT_GE(gained, 2);
  EXPECT_FALSE(closes(0.2, 0.1)) << "on the ground, before it lifts, the sole lies flat";
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
  search.begin(nominal_robot(), params, plan.goal, trailing, params.durations.stair_shift_ticks, from, soles);
  return search;
}

TEST(StepSearch, RiseTooFastForTheDrives_IsDoneInALongerSwing) {
  StepParams fast;
  fast.durations.stair_swing_ticks = 430;
  StepSearch search = leading_search(0.182, 0.35, fast);
  EXPECT_EQ(finish(search, fast), StepSearch::State::kFound);
  EXPECT_GT(search.plan().swing_ticks, fast.durations.stair_swing_ticks);
}

TEST(StepSearch, RiseBeyondTheLegs_IsImpossibleBeforeTheFirstLiftOff) {
  constexpr int kAShift = 160;  // calls, one a tick: it is known before the foot would leave
  for (const double rise : {0.30, 0.5}) {
    StepSearch search = leading_search(rise, 0.3);
    EXPECT_EQ(finish(search, {}, kAShift), StepSearch::State::kImpossible) << rise;
  }
}

TEST(StepSearch, ShiftFasterThanTheDrives_IsNotProvenByASlowerOne) {
  std::array<Transform, kFootCount> soles;
  TorsoTrajectory::State from;
  const StepPlan plan = stair_step(StepKind::kTrailing, 0.13, 0.28, soles, from);
  from[2].position -= 0.05;  // the torso has a way to go
  for (const std::int32_t shift_ticks : {StepParams{}.durations.stair_shift_ticks, 15}) {
    StepSearch search;
    search.begin(nominal_robot(), {}, plan.goal, {}, shift_ticks, from, soles);
    EXPECT_EQ(finish(search) == StepSearch::State::kFound, shift_ticks > 15);
  }
}

}  // namespace
}  // namespace polygmap
