// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/footsteps/climb_planner.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace polygmap {
namespace {

// The standing foot slid and turned under a push, and the other one landed far out.
TEST(ClimbPlanner, ClosesUpBesideAFootThatTurned_LandsAsFarAlongTheTreadAsItsFoothold) {
  const RobotModel robot;
  ClimbPlanner planner;
  planner.reset({}, robot);
  constexpr double kYaw_rad = 0.4;  // of the stairs
  const Mat3 odom_R_stairs = rotation_z(kYaw_rad);
  ClimbPlanner::Decision landed;
  landed.has_step = true;
  landed.goal.kind = StepKind::kTrailing;
  landed.goal.target = {odom_R_stairs * Vec3{1.0, 0.1, 0.13}, kYaw_rad};
  landed.goal.foothold.polygon_id = 7;
  ClimbPlanner::Situation situation;
  situation.soles = {SolePose{odom_R_stairs * Vec3{0.96, 0.17, 0.131}, kYaw_rad},
                     SolePose{odom_R_stairs * Vec3{0.985, -0.105, 0.129}, kYaw_rad + 0.055}};
  planner.latched(situation, landed);
  planner.landed(std::nullopt);
  ClimbPlanner::Decision aborted;  // a swing that went back is none that landed
  aborted.goal.kind = StepKind::kLeading;
  aborted.goal.foot = Foot::kRight;
  aborted.goal.target = {odom_R_stairs * Vec3{1.3, -0.1, 0.26}, kYaw_rad};
  planner.latched(situation, aborted);
  planner.swing_aborted();
  ASSERT_TRUE(planner.close_up(situation));

  const ClimbPlanner::Decision closing = planner.decide(situation, {});
  ASSERT_TRUE(closing.has_step);
  EXPECT_EQ(closing.goal.kind, StepKind::kClosing);
  EXPECT_EQ(closing.goal.foot, Foot::kLeft);
  EXPECT_EQ(closing.goal.foothold.polygon_id, 7U);
  EXPECT_NEAR(closing.goal.target.yaw_rad, kYaw_rad, 1e-12);
  const Vec3 stairs_p_m = odom_R_stairs.transpose() * closing.goal.target.position_m;
  EXPECT_NEAR(stairs_p_m.x(), 1.0, 1e-12);
  EXPECT_NEAR(stairs_p_m.y(), -0.105 + 2.0 * robot.stance.half_width_m, 1e-12);
  EXPECT_NEAR(stairs_p_m.z(), 0.129, 1e-12);
}

// The feet stand closer than usual, between posts, and odometry wandered while it waited.
TEST(ClimbPlanner, TrailingStepAfterALongPause_KeepsTheSpacingOfTheFootholds) {
  const RobotModel robot;
  ClimbPlanner planner;
  const ClimbPlanner::Params params;
  planner.reset(params, robot);
  ClimbPlanner::Decision leading;
  leading.goal = {StepKind::kLeading, Foot::kRight, {{1.0, -0.07, 0.13}, 0.0}, {}};
  leading.goal.foothold.polygon_id = 7;
  leading.trailing.foothold.position_m = {1.01, 0.08, 0.13};
  leading.trailing.foothold.polygon_id = 7;
  leading.trailing.foothold.last_seen_ns = 5;
  leading.trailing.foothold.side_room_m = {0.02, 0.03};
  planner.latched({}, leading);
  planner.landed(std::nullopt);
  ClimbPlanner::Situation situation;
  situation.stamp_ns = params.remembered_ns + 6;
  situation.soles = {SolePose{{0.7, 0.1, 0.0}, 0.0}, SolePose{{1.05, -0.10, 0.131}, 0.0}};

  const StepGoal goal = planner.decide(situation, {}).goal;
  EXPECT_EQ(goal.kind, StepKind::kTrailing);
  EXPECT_NEAR((goal.target.position_m - Vec3{1.06, 0.05, 0.131}).norm(), 0.0, 1e-12);
  EXPECT_EQ(goal.foothold.side_room_m, leading.trailing.foothold.side_room_m);
  EXPECT_EQ(goal.foothold.last_seen_ns, 0) << "nothing steers it";
}

TEST(ClimbPlanner, PassingFootLandsBesideAFootThatTurned_AsFarAlongTheTreadAsItsFoothold) {
  const RobotModel robot;
  ClimbPlanner planner;
  planner.reset({}, robot);
  ClimbPlanner::Decision leading;  // of the right foot onto tread 7, where the left one would have this foothold
  leading.goal.kind = StepKind::kLeading;
  leading.goal.foot = Foot::kRight;
  leading.goal.foothold.polygon_id = 7;
  leading.trailing.foothold.position_m = {1.0, 0.1, 0.13};
  leading.trailing.foothold.polygon_id = 7;
  planner.latched({}, leading);
  planner.landed(std::nullopt);
  ClimbPlanner::Decision passing;
  passing.goal.kind = StepKind::kPassing;
  passing.goal.foot = Foot::kLeft;
  passing.goal.foothold.polygon_id = 8;
  passing.trailing.foothold.position_m = {1.3, -0.1, 0.26};
  passing.trailing.foothold.polygon_id = 8;
  planner.latched({}, passing);

  const SolePose stance{{0.99, -0.105, 0.129}, 0.055};
  const SolePose beside = planner.beside_passed(stance, Foot::kLeft);
  EXPECT_NEAR(beside.position_m.x(), 1.0, 1e-12);
  EXPECT_NEAR(beside.position_m.y(), stance.position_m.y() + 2.0 * robot.stance.half_width_m, 1e-12);
  EXPECT_NEAR(beside.position_m.z(), 0.129, 1e-12);
  EXPECT_EQ(beside.yaw_rad, 0.0);
}

// Both feet on tread 7, the left one landed last.
struct OnATread {
  RobotModel robot;
  ClimbPlanner::Params params;
  ClimbPlanner planner;
  ClimbPlanner::Situation situation;

  OnATread() {
    planner.reset(params, robot);
    situation.soles = {SolePose{{1.0, 0.1, 0.13}, 0.0}, SolePose{{1.0, -0.1, 0.13}, 0.0}};
    ClimbPlanner::Decision trailing;
    trailing.goal = {StepKind::kTrailing, Foot::kLeft, situation.soles[0], {}};
    trailing.goal.foothold.polygon_id = 7;
    planner.latched(situation, trailing);
    planner.landed(situation.soles);
  }
  void land_on(const StepGoal& goal) {
    ClimbPlanner::Decision closing;
    closing.goal = goal;
    planner.latched(situation, closing);
    situation.soles[index_of(goal.foot)] = goal.target;
    planner.landed(situation.soles);
  }
};

TEST(ClimbPlanner, FootSlidOnATread_IsSetBackBesideTheOtherOne_AsOftenAsItMayBe) {
  OnATread on;
  for (std::uint32_t n = 0; n < on.params.slid.max_set_back; ++n) {
    on.situation.soles[1].position_m += Vec3{-0.011, -0.006, 0.0};
    on.planner.watch_feet(on.situation.soles);
    const ClimbPlanner::Decision decision = on.planner.decide(on.situation, {});
    ASSERT_TRUE(decision.has_step);
    EXPECT_EQ(decision.goal.kind, StepKind::kClosing);
    EXPECT_EQ(decision.goal.foot, Foot::kRight);
    EXPECT_EQ(decision.goal.foothold.polygon_id, 7U);
    EXPECT_NEAR(decision.goal.target.position_m.x(), 1.0, 1e-12);
    EXPECT_NEAR(decision.goal.target.position_m.y(), 0.1 - 2.0 * on.robot.stance.half_width_m, 1e-12);
    on.land_on(decision.goal);
  }
  on.situation.soles[1].position_m.x() -= 0.02;
  on.planner.watch_feet(on.situation.soles);
  EXPECT_FALSE(on.planner.decide(on.situation, {}).has_step);
}

TEST(ClimbPlanner, OdometryCarriesAndTurnsBothFeet_NoneSlid) {
  OnATread on;
  const Mat3 turned = rotation_z(0.1);
  for (SolePose& sole : on.situation.soles) sole = {turned * sole.position_m + Vec3{0.05, 0, 0}, sole.yaw_rad + 0.1};
  on.planner.watch_feet(on.situation.soles);
  EXPECT_FALSE(on.planner.decide(on.situation, {}).has_step);
  on.situation.soles[1].position_m.x() += on.params.slid.off_m - 1e-4;
  on.planner.watch_feet(on.situation.soles);
  EXPECT_FALSE(on.planner.decide(on.situation, {}).has_step);
}

TEST(ClimbPlanner, FootThatSlidComesNearer_IsSetBackAllTheSame) {
  OnATread on;
  on.situation.soles[1].position_m.x() += on.params.slid.off_m + 1e-4;
  on.planner.watch_feet(on.situation.soles);
  on.situation.soles[1].position_m.x() -= 2e-4;
  on.planner.watch_feet(on.situation.soles);
  EXPECT_EQ(on.planner.decide(on.situation, {}).goal.foot, Foot::kRight);
}

TEST(ClimbPlanner, LegsCannotSetTheSlidFootBack_GoesOnWithout) {
  OnATread on;
  EXPECT_FALSE(on.planner.leave_slid_foot()) << "none slid";
  on.situation.soles[0].position_m.x() -= 0.02;
  on.planner.watch_feet(on.situation.soles);
  ASSERT_TRUE(on.planner.decide(on.situation, {}).has_step);
  EXPECT_TRUE(on.planner.leave_slid_foot());
  EXPECT_FALSE(on.planner.decide(on.situation, {}).has_step);
}

// The next tread, as seen from there.
FootholdSet next_tread(const OnATread& on) {
  FootholdSet set;
  set.map_stamp_ns = 1;
  set.obstruction = StopReason::kNone;
  set.has_p_star = true;
  set.tread = {{1.2, 0.5, 0.26}, {1.2, -0.5, 0.26}};
  for (std::size_t i = 0; i < kFootCount; ++i) {
    set.p_star_feet[i].position_m = on.situation.soles[i].position_m + Vec3{0.3, 0.0, 0.13};
    set.p_star_feet[i].polygon_id = 8;
  }
  set.ground.corner_m = Vec2{1.0, 0.0} - Vec2::Constant(32 * GroundView::kCell_m);
  set.ground.height_m = 0.13;
  set.ground.level.fill(~std::uint64_t{0});
  return set;
}

TEST(ClimbPlanner, AmidAFlight_ClimbsOnThoughTheGoalLiesBehindIt) {
  OnATread on;
  on.planner.go_to({-1.0, -2.0, 0.0, false});
  on.planner.lay_out_destination(on.situation.soles);
  const ClimbPlanner::Decision decision = on.planner.look_and_decide(on.situation, next_tread(on));
  ASSERT_TRUE(decision.has_step);
  EXPECT_EQ(decision.goal.kind, StepKind::kLeading);
}

TEST(ClimbPlanner, GoalOnTheTreadItStandsOn_WalksThere) {
  OnATread on;
  on.planner.go_to({0.0, -0.4, 0.0, false});
  on.planner.lay_out_destination(on.situation.soles);
  const ClimbPlanner::Decision decision = on.planner.look_and_decide(on.situation, next_tread(on));
  ASSERT_TRUE(decision.has_step);
  EXPECT_TRUE(decision.walks);
  EXPECT_EQ(decision.goal.kind, StepKind::kFloor);
}

TEST(ClimbPlanner, FlightGoesOnPastTheGoalsStorey_WalksToTheGoal) {
  OnATread on;
  on.planner.go_to({.ahead_m = 0.0, .left_m = -2.0, .up_m = 0.0, .has_height = true});
  on.planner.lay_out_destination(on.situation.soles);
  FootholdSet up = next_tread(on);
  up.measured_rise_m = 0.13;
  const ClimbPlanner::Decision decision = on.planner.look_and_decide(on.situation, up);
  ASSERT_TRUE(decision.has_step);
  EXPECT_TRUE(decision.walks);
}

// As where the flight above a landing turns back over the one below.
TEST(ClimbPlanner, StairsLeadUpToAGoalAboveAndBehind_ClimbsThemAndNoneDown) {
  OnATread on;
  on.planner.go_to({.ahead_m = -3.0, .up_m = 1.0, .has_height = true});
  on.planner.lay_out_destination(on.situation.soles);
  FootholdSet next = next_tread(on);
  next.measured_rise_m = 0.13;
  EXPECT_EQ(on.planner.look_and_decide(on.situation, next).goal.kind, StepKind::kLeading);
  next.measured_rise_m = -0.13;
  EXPECT_TRUE(on.planner.look_and_decide(on.situation, next).walks);
}

// Over a platform to a goal at the height of the floor that it came from.
TEST(ClimbPlanner, FlightLeadsAwayFromTheGoalsHeightFirst_GoesOnAsItWent) {
  OnATread on;
  on.planner.go_to({.ahead_m = 4.0, .up_m = -0.13, .has_height = true});
  on.planner.lay_out_destination(on.situation.soles);
  FootholdSet next = next_tread(on);
  next.measured_rise_m = 0.13;
  EXPECT_EQ(on.planner.look_and_decide(on.situation, next).goal.kind, StepKind::kLeading);
}

TEST(ClimbPlanner, NextTreadLiesFartherPastTheGoalsHeightThanThisOneBeforeIt_WalksToTheGoal) {
  OnATread on;
  on.planner.go_to({.ahead_m = 4.0, .left_m = 3.0, .up_m = 0.095, .has_height = true});
  on.planner.lay_out_destination(on.situation.soles);
  FootholdSet next = next_tread(on);
  next.measured_rise_m = 0.18;
  EXPECT_EQ(on.planner.look_and_decide(on.situation, next).goal.kind, StepKind::kLeading);
  next.measured_rise_m = 0.2;
  EXPECT_TRUE(on.planner.look_and_decide(on.situation, next).walks);
}

TEST(ClimbPlanner, StandsBelowItsGoal_SaysThatItSawNoWayUp) {
  OnATread on;
  on.planner.go_to({.up_m = 1.0, .has_height = true});
  on.planner.lay_out_destination(on.situation.soles);
  FootholdSet nothing = next_tread(on);
  nothing.has_p_star = false;
  nothing.obstruction = StopReason::kNoStaircase;
  EXPECT_TRUE(on.planner.look_and_decide(on.situation, nothing).walks);
  for (int i = 0; i < 50; ++i) static_cast<void>(on.planner.look_and_decide(on.situation, nothing));
  EXPECT_EQ(on.planner.look_and_decide(on.situation, nothing).obstruction, StopReason::kNoWayUpOrDown);
}

TEST(ClimbPlanner, AskedWithAFootInTheAir_HeightCountsFromTheOtherOne) {
  OnATread on;
  on.planner.go_to({.has_height = true});
  SolePair soles = on.situation.soles;
  soles[0].position_m.z() += 0.2;
  on.planner.lay_out_destination(soles);
  FootholdSet nothing = next_tread(on);
  nothing.has_p_star = false;
  nothing.obstruction = StopReason::kNoStaircase;
  EXPECT_EQ(on.planner.look_and_decide(on.situation, nothing).obstruction, StopReason::kAtGoal);
}

// A deep tread below the lip that both feet stand before: from x = 1.2 to 1.56.
constexpr double kNextLip_x_m = 1.56;
FootholdSet deep_tread_below(const OnATread& on) {
  FootholdSet set = next_tread(on);
  set.measured_rise_m = -0.15;
  const double heel_m = on.robot.sole.collision.heel_x_m;
  set.lip_beyond = {{kNextLip_x_m, 0.5, -0.02}, {kNextLip_x_m, -0.5, -0.02}};
  set.has_lip_beyond = true;
  for (std::size_t i = 0; i < kFootCount; ++i) {
    set.p_star_feet[i].position_m.x() = 1.22 - heel_m;
    set.p_star_feet[i].position_m.z() = -0.02;
    set.p_star_feet[i].toe_clearance_m = std::numeric_limits<double>::infinity();
  }
  return set;
}
double toe_to_next_lip_m(const OnATread& on, const SolePose& sole) {
  return kNextLip_x_m - sole.position_m.x() - on.robot.sole.collision.toe_x_m;
}
// Both toes stand before the lip, as if they had been lined up there.
void stand_at_lip(OnATread& on) {
  const double toe_m = on.robot.sole.collision.toe_x_m;
  for (SolePose& sole : on.situation.soles) sole.position_m.x() = 1.2 - on.params.lip.stand_off_m - toe_m;
}

TEST(ClimbPlanner, DeepTreadBelow_TrailingFootGoesOnToItsLip) {
  OnATread on;
  stand_at_lip(on);
  const ClimbPlanner::Decision decision = on.planner.decide(on.situation, deep_tread_below(on));
  ASSERT_EQ(decision.goal.kind, StepKind::kLeading);
  EXPECT_TRUE(decision.trails_to_lip);
  EXPECT_GT(toe_to_next_lip_m(on, decision.goal.target), 0.06);
  EXPECT_NEAR(toe_to_next_lip_m(on, decision.trailing.target), on.params.lip.trailing_stand_off_m, 1e-9);
  EXPECT_EQ(decision.trailing.foothold.position_m, decision.trailing.target.position_m);
}

TEST(ClimbPlanner, NextLipIsNotSeenOrNearAnyway_TrailsBeside) {
  OnATread on;
  stand_at_lip(on);
  FootholdSet set = deep_tread_below(on);
  set.has_lip_beyond = false;
  EXPECT_FALSE(on.planner.decide(on.situation, set).trails_to_lip);
  set = deep_tread_below(on);
  set.lip_beyond.nosing_a_m.x() = set.lip_beyond.nosing_b_m.x() = kNextLip_x_m - 0.08;
  EXPECT_FALSE(on.planner.decide(on.situation, set).trails_to_lip) << "a usual tread";
  set.lip_beyond.nosing_a_m.x() = set.lip_beyond.nosing_b_m.x() = kNextLip_x_m + 0.2;
  EXPECT_FALSE(on.planner.decide(on.situation, set).trails_to_lip) << "a landing";
}

TEST(ClimbPlanner, SomethingOnTheTreadBeforeTheLip_TrailsBesideIt) {
  OnATread on;
  stand_at_lip(on);
  FootholdSet set = deep_tread_below(on);
  for (Foothold& foot : set.p_star_feet) foot.toe_clearance_m = 0.05;
  EXPECT_FALSE(on.planner.decide(on.situation, set).trails_to_lip);
}

TEST(ClimbPlanner, LipIsSlanted_TrailsToItWhereThereIsRoomAside) {
  OnATread on;
  stand_at_lip(on);
  FootholdSet set = deep_tread_below(on);
  set.lip_beyond.nosing_a_m.x() += 0.05;
  set.lip_beyond.nosing_b_m.x() -= 0.05;
  const ClimbPlanner::Decision wide = on.planner.decide(on.situation, set);
  EXPECT_TRUE(wide.trails_to_lip);
  EXPECT_NEAR(wide.trailing.target.yaw_rad, -0.1, 1e-3) << "it turns with the tread";
  for (Foothold& foot : set.p_star_feet) foot.side_room_m[1] = 0.02;
  EXPECT_FALSE(on.planner.decide(on.situation, set).trails_to_lip);
}

TEST(ClimbPlanner, TrailingFootWasToGoBesideANarrowStance_KeepsItsPlaceWhenTheLegsRefuseTheLip) {
  OnATread on;
  stand_at_lip(on);
  FootholdSet set = deep_tread_below(on);
  for (std::size_t i = 0; i < kFootCount; ++i) set.p_star_feet[i].position_m.y() *= 0.7;
  const ClimbPlanner::Decision leading = on.planner.decide(on.situation, set);
  ASSERT_TRUE(leading.trails_to_lip);
  on.planner.latched(on.situation, leading);
  on.situation.soles[index_of(leading.goal.foot)] = leading.goal.target;
  on.planner.landed(on.situation.soles);
  EXPECT_TRUE(on.planner.trail_beside());
  const StepGoal beside = on.planner.decide(on.situation, {}).goal;
  EXPECT_NEAR((beside.target.position_m - set.p_star_feet[index_of(beside.foot)].position_m).norm(), 0.0, 1e-9);
}

TEST(ClimbPlanner, LegsCannotTrailToTheLip_TrailsBesideFromThenOn) {
  OnATread on;
  stand_at_lip(on);
  const ClimbPlanner::Decision leading = on.planner.decide(on.situation, deep_tread_below(on));
  ASSERT_TRUE(leading.trails_to_lip);
  on.planner.latched(on.situation, leading);
  on.situation.soles[index_of(leading.goal.foot)] = leading.goal.target;
  on.planner.landed(on.situation.soles);
  const ClimbPlanner::Decision ahead = on.planner.decide(on.situation, {});
  EXPECT_NEAR(toe_to_next_lip_m(on, ahead.goal.target), on.params.lip.trailing_stand_off_m, 1e-9);

  EXPECT_TRUE(on.planner.trail_beside());
  EXPECT_FALSE(on.planner.trail_beside()) << "it does already";
  const ClimbPlanner::Decision beside = on.planner.decide(on.situation, {});
  EXPECT_NEAR(beside.goal.target.position_m.x(), leading.goal.target.position_m.x(), 1e-9);
}

TEST(ClimbPlanner, OneFootAtTheLip_ItCarriesAndTheOtherOneLeads) {
  for (const Foot rear : {Foot::kLeft, Foot::kRight}) {
    OnATread on;
    stand_at_lip(on);
    on.situation.soles[index_of(rear)].position_m.x() -= 0.09;
    const ClimbPlanner::Decision decision = on.planner.decide(on.situation, deep_tread_below(on));
    ASSERT_EQ(decision.goal.kind, StepKind::kLeading);
    EXPECT_EQ(decision.goal.foot, rear);
    EXPECT_NEAR(decision.to_lip_m, on.params.lip.stand_off_m, 1e-9);
  }
}

TEST(ClimbPlanner, LegsCannotLeadFromTheLip_LinesBothFeetUpThereFirst) {
  OnATread on;
  stand_at_lip(on);
  on.situation.soles[0].position_m.x() -= 0.09;
  const ClimbPlanner::Decision leading = on.planner.decide(on.situation, deep_tread_below(on));
  EXPECT_TRUE(on.planner.come_nearer(leading));
  EXPECT_EQ(on.planner.decide(on.situation, deep_tread_below(on)).goal.kind, StepKind::kFloor);
  EXPECT_FALSE(on.planner.come_nearer(leading)) << "it does already";
}

// A ramp is a surface that rises, and so is the landing behind it.
TEST(ClimbPlanner, TreadBehindARamp_IsNotClimbedAndTheRampIsTheReason) {
  OnATread on;
  on.planner.go_to({.ahead_m = 3.0});
  on.planner.lay_out_destination(on.situation.soles);
  FootholdSet next = next_tread(on);
  EXPECT_EQ(on.planner.look_and_decide(on.situation, next).goal.kind, StepKind::kLeading);
  next.ground.level = {};
  next.ground.ramps.fill(~std::uint64_t{0});
  next.ground.steepest = 0.1;
  ClimbPlanner::Decision decision = on.planner.look_and_decide(on.situation, next);
  EXPECT_TRUE(decision.walks);
  for (int i = 0; i < 5 && decision.obstruction == StopReason::kNone; ++i)
    decision = on.planner.look_and_decide(on.situation, next);
  EXPECT_FALSE(decision.has_step);
  EXPECT_EQ(decision.obstruction, StopReason::kTooSteep);
  EXPECT_EQ(decision.measured_m, 0.1);
}

}  // namespace
}  // namespace polygmap
