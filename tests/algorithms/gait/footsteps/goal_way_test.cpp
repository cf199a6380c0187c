// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/footsteps/goal_way.hpp"

#include <gtest/gtest.h>

#include "algorithms/geometry/line.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {
namespace {

class GoalWayTest : public ::testing::Test {
 protected:
  const RobotModel robot_{};
  const GoalWayParams params_{};
  GoalWay way_;
  FootholdSet footholds_ = level_everywhere();
  SolePair soles_ = stand_at({0.0, 0.0}, 0.0);
  WalkGoal goal_{{0.5, 3.0}, 0.0, false};

  [[nodiscard]] SolePair stand_at(const Vec2& p_m, double yaw_rad) const {
    const TorsoPose torso{{p_m.x(), p_m.y(), 0.0}, yaw_rad};
    const double half_m = robot_.stance.half_width_m;
    return {foot_of_torso(torso, Foot::kLeft, half_m, 0.0), foot_of_torso(torso, Foot::kRight, half_m, 0.0)};
  }
  [[nodiscard]] Vec2 soles_middle() const { return middle_of(soles_).position_m.head<2>(); }
  [[nodiscard]] static FootholdSet level_everywhere() {
    FootholdSet set;
    set.ground.corner_m = Vec2{-32, -32} * GroundView::kCell_m;
    set.ground.level.fill(~std::uint64_t{0});
    return set;
  }
  // Stairs in the direction of y, whose nosing is seen from left to right.
  void see_stairs(double left_m, double right_m, double ahead_m, StopReason obstruction) {
    footholds_.tread = {{left_m, ahead_m, 0.13}, {right_m, ahead_m, 0.13}};
    footholds_.obstruction = obstruction;
  }
  void watch(int ticks, bool climbs = false) {
    for (int i = 0; i < ticks; ++i) way_.watch(params_, {soles_, footholds_, goal_, climbs});
  }
  void walked(int ticks, LevelStep::Outcome outcome, const GoalWay::Refusal& refusal = {}) {
    for (int i = 0; i < ticks; ++i) {
      watch(1);
      way_.walked(params_, {soles_, footholds_, goal_}, outcome, refusal);
    }
  }
};

TEST_F(GoalWayTest, NothingInTheWay_NextIsTheGoal) {
  EXPECT_FALSE(way_.next(goal_));
  watch(1);
  ASSERT_TRUE(way_.next(goal_));
  EXPECT_EQ(way_.next(goal_)->odom_p_m, goal_.odom_p_m);
  EXPECT_FALSE(way_.is_on_its_way());
}

TEST_F(GoalWayTest, RefusedStairsSeenFromAside_GoesBeforeTheirMiddleAndBelievesTheRefusalThere) {
  see_stairs(0.1, 0.9, 0.5, StopReason::kTooNarrow);
  watch(1);
  ASSERT_TRUE(way_.looks_first());
  const WalkGoal place = way_.next(goal_).value();
  EXPECT_NEAR((place.odom_p_m - Vec2{0.5, 0.5 - params_.look_from_m}).norm(), 0.0, 1e-9);
  EXPECT_NEAR(place.yaw_rad, 0.5 * kPi, 1e-9);
  way_.stepped();
  soles_ = stand_at({0.3, 0.05}, 0.0);  // it looks elsewhere
  see_stairs(0.0, 0.0, 0.0, StopReason::kNoStaircase);
  watch(1);
  EXPECT_NEAR((way_.next(goal_)->odom_p_m - place.odom_p_m).norm(), 0.0, 1e-9) << "it remembers";
  soles_ = stand_at(place.odom_p_m, place.yaw_rad);
  see_stairs(0.1, 0.9, 0.5, StopReason::kTooNarrow);
  watch(1);
  EXPECT_FALSE(way_.looks_first());
}

TEST_F(GoalWayTest, MoreOfTheNosingSeenFromThere_LooksOnceMore) {
  see_stairs(0.4, 0.9, 0.5, StopReason::kTooNarrow);
  watch(1);
  soles_ = stand_at(way_.next(goal_)->odom_p_m, 0.5 * kPi);
  see_stairs(-0.3, 0.9, 0.5, StopReason::kTooNarrow);
  watch(1);
  ASSERT_TRUE(way_.looks_first());
  EXPECT_NEAR(way_.next(goal_)->odom_p_m.x(), 0.3, 1e-9);
}

TEST_F(GoalWayTest, SecondTreadSeenFirst_LooksFromBeforeTheFirst) {
  see_stairs(0.1, 0.9, 0.9, StopReason::kRiseTooHigh);
  footholds_.measured_rise_m = 0.3;
  watch(1);
  ASSERT_TRUE(way_.looks_first());
  EXPECT_NEAR(way_.next(goal_)->odom_p_m.y(), 0.9 - params_.look_from_m - 0.3, 1e-9);
}

TEST_F(GoalWayTest, NoOtherWayIsLeft_TakesTheStairsThatItSaw) {
  goal_.odom_p_m = {0.5, -1.0};
  footholds_.has_p_star = true;
  see_stairs(0.1, 0.9, 0.7, StopReason::kNone);
  walked(params_.sure_ticks, LevelStep::Outcome::kBlocked);
  EXPECT_FALSE(way_.takes_any_stairs());
  see_stairs(0.0, 0.0, 0.0, StopReason::kNoStaircase);
  walked(params_.sure_ticks, LevelStep::Outcome::kBlocked);
  EXPECT_TRUE(way_.takes_any_stairs());
  ASSERT_TRUE(way_.looks_first());
  watch(30);
  EXPECT_NEAR(way_.next(goal_)->odom_p_m.y(), 0.7 - params_.look_from_m, 1e-9);
}

TEST_F(GoalWayTest, SideOfATread_IsNoFront) {
  see_stairs(0.3, 0.6, 0.5, StopReason::kTooNarrow);
  watch(1);
  EXPECT_FALSE(way_.looks_first());
}

TEST_F(GoalWayTest, StairsSeenSquarely_OrNotToTheGoal_NeedNoLook) {
  soles_ = stand_at({0.5, 0.0}, 0.5 * kPi);
  see_stairs(0.1, 0.9, 0.5, StopReason::kTooNarrow);
  watch(1);
  EXPECT_FALSE(way_.looks_first());
  soles_ = stand_at({0.0, 0.0}, 0.0);
  goal_.odom_p_m = {3.0, -1.0};
  watch(1);
  EXPECT_FALSE(way_.looks_first());
}

TEST_F(GoalWayTest, StairsUpToAGoalAbove_AreLookedAtWhereverItLies) {
  footholds_.has_p_star = true;
  see_stairs(0.1, 0.9, 0.5, StopReason::kNone);
  footholds_.measured_rise_m = 0.13;
  goal_ = {.odom_p_m = {0.5, -1.0}, .odom_z_m = 2.0, .has_height = true};
  watch(1);
  EXPECT_TRUE(way_.looks_first());
  way_.forget();
  goal_.odom_z_m = -2.0;
  watch(1);
  EXPECT_FALSE(way_.looks_first()) << "they lead up, and the goal is below";
  footholds_.measured_rise_m = -0.13;
  watch(1);
  EXPECT_TRUE(way_.looks_first());
}

TEST_F(GoalWayTest, ArrivedBelowTheGoal_LooksRoundSoOften) {
  goal_ = {.odom_p_m = {0.0, 0.0}, .odom_z_m = 2.0, .has_height = true};
  double yaw_rad = 0.0;
  for (int i = 0; i < params_.most_turns; ++i) {
    walked(params_.sure_ticks, LevelStep::Outcome::kArrived);
    ASSERT_TRUE(way_.looks_first()) << i;
    yaw_rad = math::wrap_angle(yaw_rad + 0.5 * kPi);
    EXPECT_NEAR(way_.next(goal_)->yaw_rad, yaw_rad, 1e-9);
    soles_ = stand_at({0.0, 0.0}, yaw_rad);
    watch(1);
    EXPECT_FALSE(way_.looks_first()) << i;
  }
  walked(params_.sure_ticks, LevelStep::Outcome::kArrived);
  EXPECT_FALSE(way_.looks_first());
}

TEST_F(GoalWayTest, ArrivedAtAGoalOfNoHeight_LooksNotRound) {
  goal_ = {.odom_p_m = {0.0, 0.0}};
  walked(params_.sure_ticks, LevelStep::Outcome::kArrived);
  EXPECT_FALSE(way_.looks_first());
}

TEST_F(GoalWayTest, StairsThatLeadAwayFromTheGoalsHeight_AreNoLastWay) {
  goal_ = {.odom_p_m = {0.5, -1.0}, .odom_z_m = 2.0, .has_height = true};
  footholds_.has_p_star = true;
  footholds_.measured_rise_m = -0.13;
  see_stairs(0.1, 0.9, 0.7, StopReason::kNone);
  walked(2 * params_.sure_ticks, LevelStep::Outcome::kBlocked);
  EXPECT_FALSE(way_.takes_any_stairs());
}

// As beside the open side of the flight below: where it cannot turn to what is in the way it has looked all it can.
TEST_F(GoalWayTest, RefusedWithoutFacingTheGoal_GoesRoundAtOnce) {
  goal_.odom_p_m = {-2.0, 0.0};
  for (std::size_t y = 26; y < 36; ++y) footholds_.ground.tall[y] = std::uint64_t{0xF} << 14U;
  watch(2 * params_.sure_ticks);
  EXPECT_FALSE(way_.is_on_its_way());
  walked(params_.sure_ticks, LevelStep::Outcome::kNoGround);
  watch(30);
  EXPECT_TRUE(way_.is_on_its_way());
}

TEST_F(GoalWayTest, GoesRoundBelowTheGoal_FacesWhatIsInTheWayAgainFartherOn) {
  goal_ = {.odom_p_m = {2.0, 0.0}, .odom_z_m = 2.0, .has_height = true};
  for (std::size_t y = 0; y < 48; ++y) footholds_.ground.tall[y] = std::uint64_t{0xF} << 46U;
  watch(2 * params_.sure_ticks);
  ASSERT_TRUE(way_.is_on_its_way());
  const auto go_on = [&](double left_m) {
    soles_ = stand_at({0.0, left_m}, 0.5 * kPi);
    way_.stepped();
    watch(30);
    return way_.is_on_its_way();
  };
  EXPECT_TRUE(go_on(params_.face_again_m - 0.1));
  EXPECT_FALSE(go_on(params_.face_again_m + 0.1));
}

TEST_F(GoalWayTest, CannotComeToWhereItWouldLook_JudgesFromWhereItIs) {
  see_stairs(0.1, 0.9, 0.5, StopReason::kTooNarrow);
  walked(params_.sure_ticks, LevelStep::Outcome::kNoGround);
  EXPECT_FALSE(way_.looks_first());
}

TEST_F(GoalWayTest, ThingInTheWay_LooksAtItForAWhileThenGoesRound) {
  goal_.odom_p_m = {2.0, 0.0};
  for (std::size_t y = 26; y < 36; ++y) footholds_.ground.tall[y] = std::uint64_t{0xF} << 46U;
  watch(params_.sure_ticks / 2);
  EXPECT_FALSE(way_.next(goal_)) << "it may be stairs";
  watch(params_.sure_ticks);
  ASSERT_TRUE(way_.next(goal_));
  EXPECT_GT(std::abs(way_.next(goal_)->odom_p_m.y()), 0.3);
  way_.stepped();
  watch(30);
  EXPECT_TRUE(way_.next(goal_)) << "and goes on at once";
}

TEST_F(GoalWayTest, NoGroundAheadForAWhile_GoesRoundIt_WhereverTheViewIs) {
  goal_.odom_p_m = {2.0, 0.0};
  for (std::size_t y = 28; y < 36; ++y) footholds_.ground.level[y] &= ~(std::uint64_t{0x3FF} << 40U);
  walked(params_.sure_ticks, LevelStep::Outcome::kNoGround);
  watch(2 * params_.sure_ticks);
  ASSERT_TRUE(way_.next(goal_));
  EXPECT_GT(std::abs(way_.next(goal_)->odom_p_m.y()), 0.15);
  way_.stepped();
  footholds_.ground.corner_m += Vec2{3, 2} * GroundView::kCell_m;
  footholds_.ground.level.fill(~std::uint64_t{0});
  for (std::size_t y = 26; y < 34; ++y) footholds_.ground.level[y] &= ~(std::uint64_t{0x3FF} << 37U);
  watch(30);
  ASSERT_TRUE(way_.next(goal_));
  EXPECT_GT(std::abs(way_.next(goal_)->odom_p_m.y()), 0.15);
}

TEST_F(GoalWayTest, RefusedAgainAndAgain_GivesUpForWhatWasInTheWayFirst) {
  const auto refuse = [&](const GoalWay::Refusal& refusal) {
    walked(params_.sure_ticks, LevelStep::Outcome::kNoGround, refusal);
    way_.stepped();
  };
  refuse({StopReason::kDropTooDeep, 0.4});
  for (int i = 1; i < params_.most_refusals; ++i) refuse({StopReason::kGroundEnds, 0.0});
  EXPECT_FALSE(way_.gave_up_for());
  refuse({StopReason::kGroundEnds, 0.0});
  ASSERT_TRUE(way_.gave_up_for());
  EXPECT_EQ(way_.gave_up_for()->reason, StopReason::kDropTooDeep);
  EXPECT_EQ(way_.gave_up_for()->measured_m, 0.4);
  soles_ = stand_at({0.05, 0.5}, 0.0);
  watch(1);
  EXPECT_FALSE(way_.gave_up_for()) << "nearer to the goal there may be a way";
}

TEST_F(GoalWayTest, StandsBeforeAThingForLong_IsOnePlace) {
  walked(3 * params_.most_refusals * params_.sure_ticks, LevelStep::Outcome::kBlocked, {StopReason::kObstacle, 0.0});
  EXPECT_FALSE(way_.gave_up_for());
}

TEST_F(GoalWayTest, ArrivedOnItsWay_IsNoReasonToGiveUp) {
  for (int i = 0; i <= params_.most_refusals; ++i) {
    walked(params_.sure_ticks, LevelStep::Outcome::kArrived);
    way_.stepped();
  }
  EXPECT_FALSE(way_.gave_up_for());
}

// A detour leads away from the goal for a while; one that never comes nearer is none.
TEST_F(GoalWayTest, SoManyStepsWithoutComingNearer_GivesUpAtTheNextRefusal) {
  const auto walk = [&](int steps, double nearer_m) {
    for (int i = 0; i < steps; ++i) {
      soles_ = stand_at(soles_middle() + Vec2{0.0, nearer_m}, 0.0);
      watch(1);
      way_.stepped();
    }
  };
  walk(params_.most_steps - 1, -0.01);
  walked(params_.sure_ticks, LevelStep::Outcome::kBlocked, {StopReason::kObstacle, 0.0});
  EXPECT_FALSE(way_.gave_up_for());
  walk(8, 0.15);  // nearer than ever
  walk(params_.most_steps - 2, -0.01);
  walked(params_.sure_ticks, LevelStep::Outcome::kBlocked, {StopReason::kObstacle, 0.0});
  EXPECT_FALSE(way_.gave_up_for());
  walk(3, -0.01);
  walked(params_.sure_ticks, LevelStep::Outcome::kBlocked, {StopReason::kObstacle, 0.0});
  EXPECT_TRUE(way_.gave_up_for());
}

}  // namespace
}  // namespace polygmap
