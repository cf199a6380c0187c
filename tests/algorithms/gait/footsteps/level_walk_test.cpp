// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/footsteps/level_walk.hpp"

#include <gtest/gtest.h>

#include "algorithms/geometry/line.hpp"
#include "algorithms/robot/robot_model.hpp"

namespace polygmap {
namespace {

using Outcome = LevelStep::Outcome;

class LevelWalkTest : public ::testing::Test {
 protected:
  const RobotModel robot_{};
  const LevelWalkParams params_{};
  const LevelWalk walk_{params_, robot_.sole, robot_.stance.half_width_m, {}, {}};
  SolePair soles_ = stand_at({0.0, 0.0}, 0.0);
  GroundView ground_ = everywhere();
  LevelWalk::LastSwing last_{Foot::kRight, 1, true};

  [[nodiscard]] SolePair stand_at(const Vec2& p_m, double yaw_rad) const {
    const TorsoPose torso{{p_m.x(), p_m.y(), 0.0}, yaw_rad};
    const double half_m = robot_.stance.half_width_m;
    return {foot_of_torso(torso, Foot::kLeft, half_m, 0.0), foot_of_torso(torso, Foot::kRight, half_m, 0.0)};
  }
  [[nodiscard]] static GroundView everywhere() {
    GroundView ground;
    ground.corner_m = Vec2{-32, -32} * GroundView::kCell_m;
    ground.level.fill(~std::uint64_t{0});
    return ground;
  }
  // Of all squares whose middles are there.
  template <typename There>
  void set(GroundView::Rows& rows, bool to, const There& there) const {
    for (std::int32_t y = 0; y < GroundView::kSide_cells; ++y) {
      for (std::int32_t x = 0; x < GroundView::kSide_cells; ++x) {
        const Vec2 p_m = ground_.corner_m + Vec2{x + 0.5, y + 0.5} * GroundView::kCell_m;
        const std::uint64_t bit = std::uint64_t{1} << static_cast<std::uint32_t>(x);
        if (there(p_m)) (rows[static_cast<std::size_t>(y)] &= ~bit) |= to ? bit : 0;
      }
    }
  }
  [[nodiscard]] LevelStep next(const WalkGoal& goal) {
    const LevelStep step = walk_.next(soles_, last_, goal, ground_);
    if (step.outcome != Outcome::kSteps) return step;
    soles_[index_of(step.foot)] = step.target;
    last_ = {step.foot, step.foot == last_.foot ? last_.in_a_row + 1 : 1, false};
    return step;
  }
  // Steps until none is left to do; the last outcome.
  [[nodiscard]] LevelStep walk_to(const WalkGoal& goal, int most_steps) {
    LevelStep step;
    for (int i = 0; i < most_steps; ++i) {
      step = next(goal);
      if (step.outcome != Outcome::kSteps) break;
    }
    return step;
  }
};

TEST_F(LevelWalkTest, GoalAllAround_StandsThereWithBothFeetAndItsHeading) {
  for (int i = 0; i < 12; ++i) {
    soles_ = stand_at({0.0, 0.0}, 0.3);
    last_.begins = true;
    const double bearing_rad = i * kPi / 6.0;
    const WalkGoal goal{0.9 * unit_at(bearing_rad), math::wrap_angle(2.0 - bearing_rad), true};
    EXPECT_EQ(walk_to(goal, 80).outcome, Outcome::kArrived) << bearing_rad;
    const TorsoPose middle = middle_of(soles_);
    EXPECT_LT((middle.position_m.head<2>() - goal.odom_p_m).norm(), 0.05) << bearing_rad;
    EXPECT_LT(std::abs(math::wrap_angle(middle.yaw_rad - goal.yaw_rad)), 0.07) << bearing_rad;
  }
}

TEST_F(LevelWalkTest, EveryStep_IsWithinTheLimitsAndClearOfTheOtherFoot) {
  const WalkGoal goal{{-0.8, 0.5}, 0.0, false};
  for (int i = 0; i < 60; ++i) {
    const SolePair before = soles_;
    const LevelStep step = next(goal);
    if (step.outcome != Outcome::kSteps) break;
    const SolePose& stance = before[index_of(other(step.foot))];
    const double outwards_rad = side_sign(step.foot) * math::wrap_angle(step.target.yaw_rad - stance.yaw_rad);
    EXPECT_LE(outwards_rad, params_.turn_out * FloorStepLimits{}.turn_rad + 1e-9);
    EXPECT_GE(outwards_rad, -FloorStepLimits{}.turn_rad - 1e-9);
    EXPECT_FALSE(overlap(foot_rectangle(robot_.sole.collision, step.target, 0.0),
                         foot_rectangle(robot_.sole.collision, stance, 0.0)));
  }
}

TEST_F(LevelWalkTest, GroundEndsOnTheWay_StopsBeforeItWithAllOfEverySole) {
  set(ground_.level, false, [](const Vec2& p_m) { return p_m.x() > 0.6; });
  EXPECT_EQ(walk_to({{1.2, 0.0}, 0.0, false}, 40).outcome, Outcome::kNoGround);
  for (const SolePose& sole : soles_) EXPECT_LT(sole.position_m.x() + robot_.sole.contact.toe_x_m, 0.6);
  EXPECT_GT(middle_of(soles_).position_m.x(), 0.2) << "and not long before";
}

TEST_F(LevelWalkTest, BoxOnTheWay_StopsAwayFromIt) {
  set(ground_.tall, true, [](const Vec2& p_m) { return p_m.x() > 0.8 && std::abs(p_m.y()) < 0.2; });
  EXPECT_EQ(walk_to({{1.2, 0.0}, 0.0, false}, 40).outcome, Outcome::kBlocked);
  EXPECT_LT(middle_of(soles_).position_m.x(), 0.8 - params_.body_m + 0.03);
}

TEST_F(LevelWalkTest, BoxBesideItWhereItStands_TurnsAwayAllTheSame) {
  set(ground_.tall, true, [](const Vec2& p_m) { return p_m.x() > 0.25 && p_m.x() < 0.35; });
  EXPECT_EQ(walk_to({{-0.8, 0.0}, 0.0, false}, 80).outcome, Outcome::kArrived);
}

// As it stands on a landing that it has just climbed: its heels are at the edge.
TEST_F(LevelWalkTest, EdgeBehindTheHeels_GoesAStepAheadBeforeItTurns) {
  set(ground_.level, false, [](const Vec2& p_m) { return p_m.x() < -0.10; });
  const WalkGoal goal{{0.3, 1.0}, 0.0, false};
  EXPECT_EQ(walk_to(goal, 80).outcome, Outcome::kArrived);
}

// The right foot has no place beside the edge for its next step, the left one has.
TEST_F(LevelWalkTest, EdgeBesideTheRightFoot_StepsWithTheLeftOneAndGoesOn) {
  const double edge_m = soles_[1].position_m.y() - robot_.sole.contact.half_width_m - 0.01;
  soles_[0].position_m.y() -= 0.06;  // as near as a step may end beside it
  set(ground_.level, false, [&](const Vec2& p_m) { return p_m.y() < edge_m; });
  last_ = {Foot::kLeft, 1, false};
  const WalkGoal goal{{0.8, 0.3}, 0.0, false};
  const LevelStep first = next(goal);
  EXPECT_EQ(first.outcome, Outcome::kSteps);
  EXPECT_EQ(first.foot, Foot::kLeft);
  EXPECT_EQ(walk_to(goal, 40).outcome, Outcome::kArrived);
}

TEST_F(LevelWalkTest, EdgeBesideTheRightFoot_StepsNotForEverWithTheLeftOne) {
  const double edge_m = soles_[1].position_m.y() - robot_.sole.contact.half_width_m - 0.01;
  set(ground_.level, false, [&](const Vec2& p_m) { return p_m.y() < edge_m; });
  soles_[0].position_m.y() -= 0.06;
  last_ = {Foot::kLeft, 3, false};
  EXPECT_EQ(next({{0.8, 0.3}, 0.0, false}).outcome, Outcome::kNoGround);
}

TEST_F(LevelWalkTest, EdgesOnBothSides_RepeatsNoStepInPlace) {
  set(ground_.level, false, [&](const Vec2& p_m) { return std::abs(p_m.y()) > 0.16; });
  EXPECT_NE(walk_to({{0.0, 2.0}, 0.0, false}, 40).outcome, Outcome::kSteps);
}

TEST_F(LevelWalkTest, GoalOnAnotherStorey_IsNotArrivedAt) {
  WalkGoal goal{.odom_z_m = 0.05, .has_height = true};
  EXPECT_TRUE(walk_.has_arrived(soles_, goal));
  goal.odom_z_m = 0.15;
  EXPECT_FALSE(walk_.has_arrived(soles_, goal));
  EXPECT_EQ(goal.is_by_rise(0.0, 0.15), std::optional(true));
  EXPECT_EQ(goal.is_by_rise(0.0, -0.15), std::optional(false));
  EXPECT_EQ(goal.is_by_rise(0.15, -0.15), std::nullopt);
  EXPECT_EQ(goal.is_by_rise(0.05, 0.22), std::optional(false)) << "farther beyond it than it is now";
  goal.has_height = false;
  EXPECT_TRUE(walk_.has_arrived(soles_, goal));
}

TEST_F(LevelWalkTest, GroundNeverSeen_TakesNoStep) {
  ground_ = {};
  EXPECT_EQ(next({{1.0, 0.0}, 0.0, false}).outcome, Outcome::kNoGround);
}

TEST_F(LevelWalkTest, RampOnTheWay_IsToldOfAndNoneAside) {
  ground_.steepest = 0.2;
  const auto column = static_cast<std::uint32_t>(GroundView::cell_of(0.5 - ground_.corner_m.x()));
  ground_.ramps.fill(~std::uint64_t{0} << column);
  EXPECT_EQ(LevelWalk::ramp_on_way(ground_, {0.0, 0.0}, {2.0, 0.0}), 0.2);
  EXPECT_EQ(LevelWalk::ramp_on_way(ground_, {0.0, 0.0}, {0.3, 0.0}), 0.0) << "it begins behind";
  EXPECT_EQ(LevelWalk::ramp_on_way(ground_, {0.0, 0.0}, {0.0, 2.0}), 0.0);
  ground_.ramps = {};
  EXPECT_EQ(LevelWalk::ramp_on_way(ground_, {0.0, 0.0}, {2.0, 0.0}), 0.0);
}

}  // namespace
}  // namespace polygmap
