// SPDX-License-Identifier: Apache-2.0
// Stairs as they were built and worn: what the errors make of them, and the truth that is judged against.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "sim_stub/plant/mujoco_plant.hpp"
#include "sim_stub/world/clearance.hpp"
#include "sim_stub/world/stair_world.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

const StairParams kDrawing{.steps = 6, .jitter_m = 0.0};

// A sole flat on step k with its origin so far behind the nosing and beside the middle.
Transform on_tread(const Step& step, double behind_m, double beside_m) {
  return step.true_T_step * Transform{Mat3::Identity(), {step.nosing_x_m + behind_m, beside_m, step.height_m}};
}

TEST(BuiltStairs, NoErrors_EveryStepHasTheWorldsAxes) {
  for (const Step& step : make_stairs(kDrawing, 4).steps) {
    EXPECT_FALSE(step.turned());
    EXPECT_EQ(step.true_T_step.p_m, Vec3(Vec3::Zero()));
    EXPECT_EQ(step.edge_x_m(), step.nosing_x_m);
    EXPECT_EQ(step.beneath_m, 0.0);
  }
}

TEST(BuiltStairs, EachItem_FillsItsRangeAndMovesNothingElse) {
  StairParams many = kDrawing;
  many.steps = 200;
  const StairWorld drawn = make_stairs(many, 5);
  const auto most = [&](const StairErrors& errors) {
    Vec3 turned_rad = Vec3::Zero();
    double rise_m = 0.0;
    const StairWorld world = make_stairs(many, 5, errors);
    for (std::size_t k = 0; k < world.steps.size(); ++k) {
      const Step& step = world.steps[k];
      const Mat3& R = step.true_T_step.R;
      turned_rad = turned_rad.cwiseMax(Vec3(std::asin(R(2, 1)), std::asin(R(2, 0)), yaw_of(R)).cwiseAbs());
      const double below_m = k == 0 ? 0.0 : world.steps[k - 1].height_m;
      rise_m = std::max(rise_m, std::abs(step.height_m - below_m - many.rise_m));
      EXPECT_EQ(step.nosing_x_m, drawn.steps[k].nosing_x_m);
      const Vec3 nosing_m{step.nosing_x_m, 0.0, step.height_m};
      EXPECT_LT((step.true_T_step * nosing_m - nosing_m).norm(), 1e-9);  // it turns about its middle
    }
    return std::array{turned_rad.x(), turned_rad.y(), turned_rad.z(), rise_m};
  };
  const std::array<StairErrors, 4> alone{
      {{.tread_cant_rad = 0.03}, {.tread_slope_rad = 0.03}, {.tread_yaw_rad = 0.03}, {.rise_error_m = 0.01}}};
  for (std::size_t item = 0; item < alone.size(); ++item) {
    const std::array<double, 4> found = most(alone[item]);
    for (std::size_t i = 0; i < found.size(); ++i) {
      const double full = i == item ? (item == 3 ? 0.01 : 0.03) : 0.0;
      EXPECT_LE(found[i], full + 1e-9) << item << " " << i;
      EXPECT_GE(found[i], 0.95 * full) << item << " " << i;
    }
  }
}

TEST(BuiltStairs, TreadsThatFall_HaveTheirNosingLowest) {
  for (const Step& step : make_stairs(kDrawing, 1, {.tread_fall_rad = 0.03}).steps) {
    const double behind_m = step.top_m(step.nosing_x_m + 0.2, 0.0) - step.top_m(step.nosing_x_m, 0.0);
    EXPECT_NEAR(behind_m, 0.2 * std::tan(0.03), 1e-9);
  }
}

TEST(BuiltStairs, AnywhereOnTurnedTreads_SolidsEndWhereTheWorldSays) {
  const StairWorld world =
      make_stairs(kDrawing, 7, {.tread_slope_rad = 0.05, .tread_cant_rad = 0.05, .tread_yaw_rad = 0.08});
  const std::vector<SolidBox> solids = solids_of(world);
  for (double x_m = -0.05; x_m < 2.2; x_m += 0.013) {
    for (double y_m = -0.5; y_m < 0.5; y_m += 0.07) {
      constexpr double kLean_m = 0.01;  // by which the foot of a riser that leans comes forward
      int step = kFloorStep, ahead = kFloorStep;
      const double top_m = world.height_m(x_m, y_m, &step);
      static_cast<void>(world.height_m(x_m + kLean_m, y_m, &ahead));
      if (step != ahead) continue;
      const auto point_at = [&](double z_m) {
        return OrientedBox{{Mat3::Identity(), {x_m, y_m, z_m}}, Vec3::Constant(1e-5)};
      };
      EXPECT_GT(clearance_m(point_at(top_m + 0.0005), solids), 0.0) << x_m << " " << y_m;
      if (top_m == 0.0) continue;
      EXPECT_LT(clearance_m(point_at(top_m - 0.0005), solids), 0.0) << x_m << " " << y_m;
    }
  }
}

TEST(BuiltStairs, SoleFlatOnASlopedTread_TouchesItAndHasItsMarginAlongTheTread) {
  const StairWorld world = make_stairs(kDrawing, 2, {.tread_fall_rad = 0.04, .tread_cant_rad = 0.04});
  const std::vector<SolidBox> solids = solids_of(world);
  const double heel_m = -kContactRectangle.heel_x_m;
  const Transform sole = on_tread(world.steps[2], heel_m + 0.011, 0.1);
  EXPECT_NEAR(sole_margin_m(sole, world, 2), 0.011, 1e-6);
  EXPECT_NEAR(clearance_m(collision_box(kSole, sole), solids), 0.0, 1e-6);
  EXPECT_GT(clearance_m(collision_box(kSole, sole), solids, std::array{2}), 0.005);
  const Transform level{Mat3::Identity(), sole.p_m};
  EXPECT_LT(clearance_m(collision_box(kSole, level), solids), -0.003);  // in the tread
}

TEST(BuiltStairs, TreadTurnedAway_LeavesLessMarginAtOneCornerOfTheSole) {
  StairWorld world = make_stairs(kDrawing, 2);
  Step& step = world.steps[2];
  const double yaw_rad = 0.05, heel_m = -kContactRectangle.heel_x_m;
  const Vec3 nosing_m{step.nosing_x_m, 0.0, step.height_m};
  step.true_T_step = {rotation_z(yaw_rad), nosing_m - rotation_z(yaw_rad) * nosing_m};
  const Transform sole{Mat3::Identity(), {step.nosing_x_m + heel_m + 0.015, -0.1, step.height_m}};
  // To the right the nosing lies farther up the stairs.
  const double inner_m = kContactRectangle.half_width_m;
  EXPECT_NEAR(sole_margin_m(sole, world, 2), 0.015 * std::cos(yaw_rad) - (0.1 + inner_m) * std::sin(yaw_rad), 1e-9);
  // The tread before it ends at this step's riser, as it is turned.
  const double toe_m = kContactRectangle.toe_x_m;
  const Transform before{Mat3::Identity(), {step.riser_x_m - toe_m - 0.02, 0.1, world.steps[1].height_m}};
  EXPECT_NEAR(sole_margin_m(before, world, 1), 0.02 * std::cos(yaw_rad) - (0.1 + inner_m) * std::sin(yaw_rad), 1e-9);
}

TEST(BuiltStairs, WornNosing_CarriesFromWhereItHasFallenByAMillimetreAndIsClearedByItsRound) {
  constexpr double kWorn_m = 0.012;
  const StairWorld world = make_stairs(kDrawing, 2, {.worn_nosing_m = kWorn_m});
  const double heel_m = -kContactRectangle.heel_x_m;
  EXPECT_NEAR(sole_margin_m(on_tread(world.steps[2], heel_m + 0.02, 0.1), world, 2),
              0.02 - kWorn_m + std::sqrt(math::square(kWorn_m) - math::square(kWorn_m - 0.001)), 1e-9);
  // A corner at 45 degrees before the edge: the round is nearer to it than the edge was far.
  const std::vector<SolidBox> solids = solids_of(world);
  constexpr double kHalf_m = 0.01, kGap_m = 0.004;
  const OrientedBox box{
      {Mat3::Identity(),
       {world.steps[2].nosing_x_m - kGap_m - kHalf_m, 0.0, world.steps[2].height_m + kGap_m + kHalf_m}},
      Vec3::Constant(kHalf_m)};
  EXPECT_NEAR(clearance_m(box, solids), std::sqrt(2.0) * (kGap_m + kWorn_m) - kWorn_m, 1e-9);
}

// Under physics the sole comes to lie as the tread does.
TEST(BuiltStairs, RobotOnASlopedTread_SoleLiesOnItUnderPhysics) {
  constexpr double kFall_rad = 0.01;
  StairWorld world;
  Step step{-1.2, -1.2, -0.2, 0.0005};
  const Vec3 nosing_m{step.nosing_x_m, 0.0, step.height_m};
  step.true_T_step = {rotation_y(-kFall_rad), nosing_m - rotation_y(-kFall_rad) * nosing_m};
  world.steps.push_back(step);
  const RobotErrors errors = draw_errors(ErrorParams::none(), 1);
  JointVector q_rad;
  JointCommand hold;
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    const Vec3 p_m{-0.02, side_sign(foot) * kStanceHalfWidth_m, -kNominalBaseHeight_m};
    q_rad.segment<6>(static_cast<Eigen::Index>(joint_index(foot, 0))) =
        solve_leg({}, foot, {Mat3::Identity(), p_m}).q_rad;
  }
  for (std::size_t j = 0; j < kJointCount; ++j) {
    hold.joints[j] = {q_rad[static_cast<Eigen::Index>(j)], 0.0, 0.0, 2000.0, 40.0};
  }
  MujocoPlant plant({}, world, errors, {Mat3::Identity(), {-1.0, 0.0, 0.0}}, q_rad);
  for (int i = 0; i < 500; ++i) plant.step(hold);
  ASSERT_FALSE(plant.fell()) << plant.fall_reason();
  for (std::size_t f = 0; f < kFootCount; ++f) {
    const Transform& sole = plant.true_T_sole(f);
    EXPECT_EQ(plant.step_index(f), 0);
    EXPECT_NEAR(std::asin(sole.R(2, 0)), kFall_rad, 0.002);
    EXPECT_NEAR(sole.p_m.z(), step.top_m(sole.p_m.x(), sole.p_m.y()), 0.001);
  }
}

}  // namespace
}  // namespace polygmap::sim
