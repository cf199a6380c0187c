// SPDX-License-Identifier: Apache-2.0
// The plant under physics: what it weighs, that it stands and falls, what its drives do.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>

#include "algorithms/robot/leg_dynamics.hpp"
#include "sim_stub/sim_robot.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

constexpr double kWeight_n = 55.0 * kGravity_mps2;

struct Body {
  StairWorld world;
  RobotErrors errors = draw_errors(ErrorParams::none(), 1);
  MujocoPlant::Params params;

  [[nodiscard]] std::unique_ptr<MujocoPlant> stand(double x_m = -1.0, double base_height_m = kNominalBaseHeight_m) {
    q_rad = home(base_height_m);
    return std::make_unique<MujocoPlant>(params, world, errors, Transform{Mat3::Identity(), Vec3{x_m, 0, 0}}, q_rad);
  }
  [[nodiscard]] static JointVector home(double base_height_m) {
    JointVector q;
    for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
      // The soles so that the weight is over the middle of what the ankles can hold.
      const Transform sole{Mat3::Identity(), Vec3{-0.02, side_sign(foot) * kStanceHalfWidth_m, -base_height_m}};
      q.segment<static_cast<int>(kJointsPerLeg)>(static_cast<Eigen::Index>(joint_index(foot, 0))) =
          solve_leg({}, foot, sole).q_rad;
    }
    return q;
  }
  // Stiff drives and what the links weigh, half of it on each sole.
  [[nodiscard]] JointCommand hold() const {
    JointCommand command;
    const BodyFrames frames = body_frames({}, q_rad);
    const Vec3 base_p_com = centre_of_mass_m({}, base_p_links_m({}, frames));
    for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
      const LegVector q = leg_joints(q_rad, foot);
      const Vec3 force_n{0, 0, 0.5 * kWeight_n};
      const Vec3 from_sole_m = base_p_com - base_T_sole({}, foot, q).p_m;
      const SoleWrench ground{force_n, Vec3{0, -from_sole_m.x() * force_n.z(), 0}};
      std::array<Vec3, kJointsPerLeg> gravity_mps2;
      gravity_mps2.fill({0, 0, -kGravity_mps2});
      const LegVector tau = leg_torques_nm({}, foot, frames[index_of(foot)], gravity_mps2, ground);
      for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
        const auto i = static_cast<Eigen::Index>(j);
        command.joints[joint_index(foot, j)] = {q[i], 0.0, tau[i], 1000.0, 30.0};
      }
    }
    return command;
  }
  JointVector q_rad;
};

TEST(MujocoPlant, Biped_Weighs55kgAsTheModuleBelieves) {
  Body body;
  EXPECT_NEAR(body.stand()->total_mass_kg(), 55.0, 1e-3);
  EXPECT_NEAR(MassModel{}.total_kg(), 55.0, 1e-3);
  body.params.torso_mass_scale = 1.2;
  EXPECT_NEAR(body.stand()->total_mass_kg(), 55.0 + 0.2 * 37.012, 1e-3);
}

TEST(MujocoPlant, CentreOfMass_IsWhereTheModuleComputesIt) {
  Body body;
  const auto plant = body.stand();
  const Vec3 base_p_com = centre_of_mass_m({}, base_p_links_m({}, body_frames({}, body.q_rad)));
  EXPECT_LT((plant->true_T_base() * base_p_com - plant->true_p_com_m()).norm(), 1e-6);
}

TEST(MujocoPlant, TorsoOffset_MovesTheCentreOfMassByTheTorsosShare) {
  Body body;
  const Vec3 before_m = body.stand()->true_p_com_m(), offset_m{0.01, 0.02, -0.03};
  body.params.torso_offset_x_m = offset_m.x();
  body.params.torso_offset_y_m = offset_m.y();
  body.params.torso_offset_z_m = offset_m.z();
  const Vec3 moved_m = body.stand()->true_p_com_m() - before_m;
  EXPECT_LT((moved_m - 37.012 / 55.0 * offset_m).norm(), 1e-5);
}

TEST(MujocoPlant, HeldAtHomeWithGravityTorques_StandsStillForFiveSeconds) {
  Body body;
  const auto plant = body.stand();
  const Transform before = plant->true_T_base();
  double highest_mps = 0.0;
  Vec3 last_m = before.p_m;
  for (int tick = 0; tick < 2500; ++tick) {
    plant->step(body.hold());
    if (tick > 1250) highest_mps = std::max(highest_mps, (plant->true_T_base().p_m - last_m).norm() / kPlantTick_s);
    last_m = plant->true_T_base().p_m;
  }
  EXPECT_FALSE(plant->fell()) << plant->fall_reason();
  EXPECT_LT((plant->true_T_base().p_m - before.p_m).norm(), 0.005);
  EXPECT_LT(highest_mps, 1e-3);
  EXPECT_NEAR(plant->foot_force_n(0) + plant->foot_force_n(1), kWeight_n, 1.0);
  EXPECT_NEAR(plant->load_share(0), 0.5, 0.01);
  // What the drives give is what the torques of the links' weights say.
  EXPECT_NEAR(plant->drive_tau_nm()[kKnee], body.hold().joints[kKnee].tau_ff_nm, 3.0);
}

TEST(MujocoPlant, PushedOver_Falls) {
  Body body;
  const auto plant = body.stand();
  plant->push({250.0, 0, 0});
  for (int tick = 0; tick < 1500 && !plant->fell(); ++tick) plant->step(body.hold());
  EXPECT_TRUE(plant->fell());
  EXPECT_NE(plant->fall_reason().find("base"), std::string::npos) << plant->fall_reason();
}

TEST(MujocoPlant, SameRunTwice_RepeatsBitForBit) {
  Body body;
  const auto one = body.stand(), two = body.stand();
  for (const auto& plant : {one.get(), two.get()}) {
    plant->push({30.0, 20.0, 0});
    for (int tick = 0; tick < 500; ++tick) plant->step(body.hold());
  }
  EXPECT_EQ(one->true_T_base().p_m, two->true_T_base().p_m);
  EXPECT_EQ(one->drive_q_rad(), two->drive_q_rad());
  EXPECT_EQ(one->foot_force_n(0), two->foot_force_n(0));
}

TEST(MujocoPlant, FootDroppedOnATread_StandsAtItsHeight) {
  Body body;
  body.world.steps = {{-2.0, -2.0, 2.0, 0.10}};
  body.q_rad = Body::home(kNominalBaseHeight_m);
  // The right foot stands beside the staircase, the left one hangs 15 mm over it.
  const Transform sole{Mat3::Identity(), Vec3{-0.02, kStanceHalfWidth_m, 0.115 - kNominalBaseHeight_m}};
  body.q_rad.head<6>() = solve_leg({}, Foot::kLeft, sole).q_rad;
  MujocoPlant plant(body.params, body.world, body.errors, {Mat3::Identity(), Vec3{0, -0.6, 0}}, body.q_rad);
  EXPECT_FALSE(plant.in_contact(0));
  for (int tick = 0; tick < 500; ++tick) plant.step(body.hold());
  EXPECT_FALSE(plant.fell()) << plant.fall_reason();
  EXPECT_TRUE(plant.in_contact(0));
  EXPECT_EQ(plant.step_index(0), 0);
  EXPECT_EQ(plant.step_index(1), -1);
  double lowest_m = 1.0;
  for (const Vec3& corner_m : sole_contacts_m()) {
    lowest_m = std::min(lowest_m, (plant.true_T_sole(0) * corner_m).z());
  }
  EXPECT_NEAR(lowest_m, 0.10, 2e-3);
}

TEST(MujocoPlant, ToeThatScrapesDownARiser_IsFeltButStandsOnNothing) {
  Body body;
  constexpr double kSole_x_m = -0.02;
  const double riser_x_m = kSole_x_m + kCollisionRectangle.toe_x_m + 0.001;
  body.world.steps = {{riser_x_m, riser_x_m, 2.0, 0.10}};  // below the shank
  body.q_rad = Body::home(kNominalBaseHeight_m);
  const auto left_foot_at = [&](double x_m, double height_m) {
    const Transform sole{Mat3::Identity(), Vec3{x_m, kStanceHalfWidth_m, height_m - kNominalBaseHeight_m}};
    body.q_rad.head<6>() = solve_leg({}, Foot::kLeft, sole).q_rad;
  };
  left_foot_at(kSole_x_m, 0.06);
  // The right foot stands beside the staircase.
  MujocoPlant plant(body.params, body.world, body.errors, {Mat3::Identity(), Vec3{0, -0.6, 0}}, body.q_rad);
  double most_n = 0.0;
  for (int tick = 0; tick < 40; ++tick) {
    left_foot_at(kSole_x_m + 0.02, 0.06 - 0.0005 * tick);  // 20 mm too far ahead
    JointCommand command = body.hold();
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) command.joints[j].tau_ff_nm = 0.0;  // that leg carries nothing
    plant.step(command);
    most_n = std::max(most_n, plant.foot_force_n(0));
    EXPECT_FALSE(plant.in_contact(0)) << tick;
  }
  EXPECT_GT(most_n, 15.0);
}

// The sole's box carries on what is left on the tread; soles of points would slip off its nosing.
TEST(MujocoPlant, HeelHangs15mmOverTheNosing_StandsStill) {
  Body body;
  constexpr double kSole_x_m = -0.02;
  const double nosing_x_m = kSole_x_m + kContactRectangle.heel_x_m + 0.015;
  body.world.steps = {{nosing_x_m, nosing_x_m, 2.0, 0.10}};
  body.q_rad = Body::home(kNominalBaseHeight_m);
  const Transform sole{Mat3::Identity(), Vec3{kSole_x_m, kStanceHalfWidth_m, 0.105 - kNominalBaseHeight_m}};
  body.q_rad.head<6>() = solve_leg({}, Foot::kLeft, sole).q_rad;
  MujocoPlant plant(body.params, body.world, body.errors, {Mat3::Identity(), Vec3{0, -0.6, 0}}, body.q_rad);
  for (int tick = 0; tick < 500; ++tick) plant.step(body.hold());
  ASSERT_TRUE(plant.in_contact(0));
  const Vec3 landed_m = plant.true_T_sole(0).p_m;
  for (int tick = 0; tick < 1500; ++tick) plant.step(body.hold());
  EXPECT_FALSE(plant.fell()) << plant.fall_reason();
  EXPECT_TRUE(plant.in_contact(0));
  EXPECT_LT((plant.true_T_sole(0).p_m - landed_m).norm(), 0.002);
}

TEST(MujocoPlant, Drive_SaturatesAtItsTorqueLimit) {
  Body body;
  const auto plant = body.stand();
  JointCommand command = body.hold();
  command.joints[kKnee].q_rad += 3.0;
  command.joints[kAnklePitch].q_rad -= 3.0;
  plant->step(command);
  EXPECT_EQ(plant->drive_tau_nm()[kKnee], 180.0);
  EXPECT_EQ(plant->drive_tau_nm()[kAnklePitch], -36.0);
}

TEST(MujocoPlant, CommandOverTheBus_TakesHold2msLater) {
  SimOptions options;
  options.plant_kind = PlantKind::kMujoco;
  options.errors = ErrorParams::none();
  options.camera.silent = {{0, std::numeric_limits<std::int64_t>::max()}};
  SimRobot robot(options);
  JointCommand command;  // no stiffness: only the torque asked for
  command.joints[kKnee].tau_ff_nm = 1.0;
  ASSERT_TRUE(robot.try_write(command).is_all());
  for (int i = 0; i < 3; ++i) robot.advance();
  command.joints[kKnee].tau_ff_nm = 7.0;
  ASSERT_TRUE(robot.try_write(command).is_all());
  JointFeedback feedback;
  robot.advance();  // 2 ms on the bus
  ASSERT_TRUE(robot.try_read(feedback));
  EXPECT_EQ(feedback.tau_nm[kKnee], 1.0);
  robot.advance();
  ASSERT_TRUE(robot.try_read(feedback));
  EXPECT_EQ(feedback.tau_nm[kKnee], 7.0);
}

}  // namespace
}  // namespace polygmap::sim
