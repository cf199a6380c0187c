// SPDX-License-Identifier: Apache-2.0
// The robot under physics: what it weighs, that it stands and falls, what its drives do.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>

#include "algorithms/robot/leg_dynamics.hpp"
#include "sim_stub/clearance.hpp"
#include "sim_stub/sim_robot.hpp"
#include "tests/support/physical_climb.hpp"
#include "tests/support/slow_machine.hpp"

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
  ASSERT_TRUE(robot.try_write(command));
  for (int i = 0; i < 3; ++i) robot.advance();
  command.joints[kKnee].tau_ff_nm = 7.0;
  ASSERT_TRUE(robot.try_write(command));
  JointFeedback feedback;
  robot.advance();  // 2 ms on the bus
  ASSERT_TRUE(robot.try_read(feedback));
  EXPECT_EQ(feedback.tau_nm[kKnee], 0.0);
  robot.advance();
  ASSERT_TRUE(robot.try_read(feedback));
  EXPECT_EQ(feedback.tau_nm[kKnee], 7.0);
}

SimOptions few_steps(std::uint64_t seed) {
  SimOptions options;
  options.seed = seed;
  options.stairs.steps = 2;
  return options;
}

TEST(PhysicalClimb, WithEverySensorsErrors_ClimbsAndStands) {
  for (const std::uint64_t seed : {1U, 4U}) {
    PhysicalClimb climb(few_steps(seed));
    climb.run(60.0);
    EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
    EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
    EXPECT_EQ(climb.status().treads_climbed, 2U);
    EXPECT_EQ(climb.truth().step_index[0], 1);
    EXPECT_EQ(climb.truth().step_index[1], 1);
    EXPECT_LT(climb.gait().balance().com_error_m().norm(), 0.02);
  }
}

TEST(PhysicalClimb, SameSeedTwice_RepeatsBitForBit) {
  PhysicalClimb one(few_steps(2)), two(few_steps(2));
  one.run(6.0);
  two.run(6.0);
  EXPECT_EQ(one.truth().true_T_base.p_m, two.truth().true_T_base.p_m);
  EXPECT_GT(one.status().step.sequence, 1U);
}

// Runs on for for_s after the gait ended: upright, on both feet, its centre of mass at rest where planned.
bool stands_for(PhysicalClimb& climb, double for_s) {
  const double end_s = climb.time_s() + for_s;
  while (climb.time_s() < end_s && !climb.truth().fell) (void)climb.tick();
  return !climb.truth().fell && climb.truth().in_contact[0] && climb.truth().in_contact[1] &&
         climb.gait().balance().com_error_m().norm() < 0.02;
}
bool run_to_swing_onto(PhysicalClimb& climb, std::uint32_t nth, double limit_s = 40.0) {
  std::uint32_t onto = 0, sequence = 0;
  while (climb.time_s() < limit_s && climb.tick()) {
    const LatchedStep& step = climb.status().step;
    if (step.sequence != sequence && step.onto_tread) ++onto;
    sequence = step.sequence;
    if (onto == nth) return true;
  }
  return false;
}

// Two gaits that differ in nothing but the feedback see the same climb. From a lift-off on the other one's commands are
// sent: the swing is under way, and no reason to stop comes before it ends.
TEST(PhysicalClimb, WithoutFeedbackOfTheDcmFromALiftOffOn_FallsInThatSwing) {
  for (const bool feedback : {true, false}) {
    Gait::Params params;
    if (!feedback) params.balance.dcm.gain = params.balance.dcm.integral_per_s = 0.0;
    const auto other = std::make_unique<Gait>();
    other->reset(params);
    PhysicalClimb climb(few_steps(1));
    JointCommand its_command;
    bool lifted = false;
    climb.tamper_command = [&](JointCommand& command, const FootholdSet& footholds, const JointFeedback& joints) {
      other->tick(command.stamp_ns, climb.state(), footholds, joints, its_command);
      if (lifted) command = its_command;
    };
    ASSERT_TRUE(run_to_swing_onto(climb, 1));
    lifted = true;
    const std::uint32_t swing = climb.status().step.sequence;
    climb.run(60.0);
    EXPECT_EQ(climb.truth().fell, !feedback) << climb.truth().fall_reason;
    if (feedback) continue;
    EXPECT_EQ(climb.status().step.sequence, swing);
    EXPECT_NE(climb.status().phase, GaitPhase::kStopped);
  }
}

TEST(PhysicalStop, RequestedAtAnyPhase_EndsOnBothFeet) {
  for (const double after_s : {0.0, 0.2, 0.45, 0.7, 1.0, 1.2}) {
    if (test::kSlowMachine && after_s != 0.45) continue;
    PhysicalClimb climb(few_steps(2));
    ASSERT_TRUE(run_to_swing_onto(climb, 2));
    climb.run(after_s);
    climb.gait().request_stop();
    climb.run(5.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped) << after_s;
    EXPECT_TRUE(climb.status().stands[0] && climb.status().stands[1]);
    EXPECT_TRUE(stands_for(climb, 3.0)) << after_s << climb.truth().fall_reason;
  }
}

TEST(PhysicalStop, PerceptionLostInSwing_FinishesTheStepsAndStandsOnBothFeet) {
  for (const std::uint32_t nth : {1U, 2U}) {
    PhysicalClimb climb(few_steps(2));
    ASSERT_TRUE(run_to_swing_onto(climb, nth));
    climb.tamper_footholds = [](FootholdSet& set) {
      set.has_p_star = false;
      set.obstruction = Obstruction::kNothingSeen;
    };
    climb.run(20.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_EQ(climb.status().stop_reason, Obstruction::kNothingSeen);
    EXPECT_EQ(climb.status().treads_climbed, 1U);
    EXPECT_TRUE(stands_for(climb, 3.0)) << climb.truth().fall_reason;
  }
}

TEST(PhysicalStop, StepBeyondTheLegs_StandsOnBothFeetAndSaysSo) {
  PhysicalClimb climb(few_steps(2));
  climb.tamper_footholds = [](FootholdSet& set) {
    for (Foothold& hold : set.p_star_feet) hold.position_m.z() += 0.2;
  };
  climb.run(40.0);
  EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
  EXPECT_EQ(climb.status().stop_reason, Obstruction::kLegsCannot);
  EXPECT_TRUE(stands_for(climb, 3.0)) << climb.truth().fall_reason;
}

Gait::Params single_step() {
  Gait::Params params;
  params.planner.pattern = GaitPattern::kSingleStep;
  return params;
}
SimOptions four_steps(std::uint64_t seed) {
  SimOptions options = few_steps(seed);
  options.stairs.steps = 4;
  return options;
}

TEST(PhysicalSingleStep, WithEverySensorsErrors_OneFootOnEveryStepAndBothOnTheLast) {
  for (const std::uint64_t seed : {1U, 4U}) {
    PhysicalClimb climb(four_steps(seed), single_step());
    climb.run(60.0);
    EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
    EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
    EXPECT_EQ(climb.status().treads_climbed, 4U);
    EXPECT_EQ(climb.truth().step_index[0], 3);
    EXPECT_EQ(climb.truth().step_index[1], 3);
    EXPECT_TRUE(stands_for(climb, 1.0));
  }
}

TEST(PhysicalSingleStep, StopRequestedAtAnyPhase_EndsOnBothFeet) {
  for (const double after_s : {0.0, 0.3, 0.6, 0.9, 1.0, 1.2}) {
    if (test::kSlowMachine && after_s != 0.6) continue;
    PhysicalClimb climb(four_steps(2), single_step());
    ASSERT_TRUE(run_to_swing_onto(climb, 3));
    climb.run(after_s);
    climb.gait().request_stop();
    climb.run(5.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped) << after_s;
    EXPECT_TRUE(stands_for(climb, 3.0)) << after_s << climb.truth().fall_reason;
  }
}

TEST(PhysicalSingleStep, PerceptionLostInSwing_EndsBesideTheFrontFoot) {
  for (const std::uint32_t nth : {1U, 2U, 3U}) {
    PhysicalClimb climb(four_steps(2), single_step());
    ASSERT_TRUE(run_to_swing_onto(climb, nth));
    climb.tamper_footholds = [](FootholdSet& set) {
      set.has_p_star = set.has_p_star_star = false;
      set.obstruction = Obstruction::kNothingSeen;
    };
    climb.run(20.0);
    EXPECT_EQ(climb.status().phase, GaitPhase::kStopped);
    EXPECT_EQ(climb.status().stop_reason, Obstruction::kNothingSeen);
    EXPECT_EQ(climb.status().treads_climbed, nth);
    EXPECT_TRUE(stands_for(climb, 3.0)) << climb.truth().fall_reason;
    EXPECT_EQ(climb.truth().step_index[0], climb.truth().step_index[1]);
  }
}

// Rises of the map 10 mm off, more with every stair, and no news: it falls or stops, and does not climb on.
TEST(PhysicalClimb, MapFrozenWithAWrongRise_StopsOrFalls) {
  for (const double per_stair_m : {0.010, -0.010}) {
    SimOptions options;
    options.seed = 2;
    PhysicalClimb climb(options);
    climb.tamper_footholds = [&](FootholdSet& set) {
      const double off_m = per_stair_m * (climb.status().treads_climbed + 1);
      for (Foothold& hold : set.p_star_feet) hold.position_m.z() += off_m;
    };
    climb.run(60.0);
    EXPECT_TRUE(climb.truth().fell || climb.status().phase == GaitPhase::kStopped) << per_stair_m;
  }
}

TEST(PhysicalFailure, ForceSensorDead_FootThatDoesNotGoDownStands) {
  for (const std::uint32_t nth : {1U, 2U}) {
    PhysicalClimb climb(few_steps(2));
    std::size_t dead = kFootCount;
    climb.tamper = [&](JointFeedback& joints) {
      if (dead < kFootCount) joints.foot_force_n[dead] = 0.0;
    };
    ASSERT_TRUE(run_to_swing_onto(climb, nth));
    dead = index_of(climb.status().step.foot);
    while (climb.status().phase == GaitPhase::kSwing && climb.tick()) {
    }
    dead = kFootCount;
    climb.run(60.0);
    EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
    EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  }
}

// 60 ms without the joint bus: the torques go on as planned, as if the body were too.
TEST(PhysicalFailure, JointsSilentForAMoment_TorquesDoNotLeap) {
  for (const double after_s : {0.25, 1.0, 1.2}) {  // in the swing, and while the weight moves
    PhysicalClimb climb(few_steps(2));
    ASSERT_TRUE(run_to_swing_onto(climb, 2));
    climb.run(after_s);
    double leap_nm = 0.0;
    for (int tick = 0; tick < 100; ++tick) {
      const JointCommand before = climb.command();
      climb.joints_silent = tick < 30;
      (void)climb.tick();
      if (tick > 30) continue;
      for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
        if (!climb.status().stands[index_of(foot)]) continue;
        const std::size_t n = joint_index(foot, kAnklePitch);
        leap_nm = std::max(leap_nm, std::abs(climb.command().joints[n].tau_ff_nm - before.joints[n].tau_ff_nm));
      }
    }
    EXPECT_LT(leap_nm, 15.0) << after_s;
    climb.run(60.0);
    EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
    EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  }
}

// Failures that a study of this climb met (six of them; the drives' and soles' are in footstep_test and above).
double worst_torque_ratio(PhysicalClimb& climb) {
  double worst = 0.0;
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const double limit_nm = joint_limits(static_cast<Foot>(n / kJointsPerLeg), n % kJointsPerLeg).torque_nm;
    worst = std::max(worst, std::abs(climb.plant().drive_tau_nm()[static_cast<Eigen::Index>(n)]) / limit_nm);
  }
  return worst;
}

TEST(PhysicalFailure, TreadHigherThanMapped_TouchesEarlyWithoutATorqueSpike) {
  PhysicalClimb climb(few_steps(2));
  climb.tamper_footholds = [](FootholdSet& set) {
    for (Foothold& hold : set.p_star_feet) hold.position_m.z() -= 0.015;
  };
  double worst = 0.0;
  while (climb.time_s() < 60.0 && climb.tick()) worst = std::max(worst, worst_torque_ratio(climb));
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_GT(climb.status().early_contacts, 1U);
  EXPECT_LT(worst, 0.95);
}

// A foot that is still unloading must not be taken for one that seeks the ground.
TEST(PhysicalFailure, FootThatLeavesLate_IsNotLowered) {
  PhysicalClimb climb(few_steps(2));
  climb.tamper = [&](JointFeedback& joints) {  // it feels its weight for another 0.2 s
    const LatchedStep& step = climb.status().step;
    const bool leaves =
        climb.status().phase == GaitPhase::kSwing && joints.stamp_ns < step.latch_stamp_ns + 200'000'000;
    if (leaves) joints.foot_force_n[index_of(step.foot)] = 50.0;
  };
  climb.run(60.0);
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
  EXPECT_EQ(climb.status().early_contacts, 0U);
}

// Both treads are lower than mapped: the weight is on its way, so the foot has to find them.
TEST(PhysicalFailure, TreadsLowerThanMapped_FootFindsThemInTime) {
  for (const double lower_m : {0.010, 0.015, 0.020, 0.030, 0.050}) {
    PhysicalClimb climb(few_steps(2));
    climb.tamper_footholds = [&](FootholdSet& set) {
      for (Foothold& hold : set.p_star_feet) hold.position_m.z() += lower_m;
    };
    climb.run(60.0);
    EXPECT_FALSE(climb.truth().fell) << lower_m << " " << climb.truth().fall_reason;
    EXPECT_EQ(climb.status().phase, GaitPhase::kFinished) << lower_m;
    EXPECT_GT(climb.status().late_contacts, 1U) << lower_m;
  }
}

TEST(PhysicalFailure, TreadsTenMillimetresNearer_ToesMissTheRisers) {
  PhysicalClimb climb(few_steps(2));
  climb.tamper_footholds = [](FootholdSet& set) {
    for (Foothold& hold : set.p_star_feet) hold.position_m += rotation_z(hold.yaw_rad) * Vec3{0.01, 0, 0};
  };
  const auto solids = stair_solids(climb.robot().stairs());
  double least_m = 1.0;  // of a toe in the air to the riser behind the tread it goes to
  while (climb.time_s() < 60.0 && climb.tick()) {
    if (climb.status().phase != GaitPhase::kSwing || !climb.status().step.onto_tread) continue;
    const std::size_t f = index_of(climb.status().step.foot);
    const int to = static_cast<int>(climb.status().treads_climbed);
    const std::array excluded{to - 1, to};
    least_m = std::min(least_m, clearance_m(collision_box(climb.truth().true_T_sole[f]), solids, excluded));
  }
  EXPECT_GT(least_m, 0.0);
  EXPECT_LT(least_m, 0.014);  // it was that near at all
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
}

TEST(PhysicalClimb, OtherBodyOrGroundThanBelieved_ClimbsAllTheSame) {
  struct Variant {
    double mass_scale, offset_x_m, friction;
  };
  for (const Variant& body :
       {Variant{0.9, 0.0, 0.8}, {1.2, 0.0, 0.8}, {1.0, -0.015, 0.8}, {1.0, 0.030, 0.8}, {1.0, 0.0, 0.4}}) {
    if (test::kSlowMachine && body.mass_scale == 1.0) continue;
    SimOptions options = few_steps(2);
    options.mujoco.torso_mass_scale = body.mass_scale;
    options.mujoco.torso_offset_x_m = body.offset_x_m;
    options.mujoco.friction = body.friction;
    PhysicalClimb climb(options);
    climb.run(30.0);
    SCOPED_TRACE(::testing::Message() << body.mass_scale << " " << body.offset_x_m << " " << body.friction);
    EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
    EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
    EXPECT_EQ(climb.status().treads_climbed, 2U);
  }
}

// Of both steps onto a tread, from the first lift-off on: the module is still climbing when each push comes. Each seed
// has its share of the eight moments.
struct PushedCase {
  std::uint64_t seed;
  GaitPattern pattern;
};
class Pushed : public testing::TestWithParam<PushedCase> {};

TEST_P(Pushed, AnyWayAtEightMomentsOfAStair_DoesNotFall) {
  const auto [seed, pattern] = GetParam();
  if (test::kSlowMachine && seed != 3) GTEST_SKIP() << "one seed of each gait";
  Gait::Params params;
  params.planner.pattern = pattern;
  PhysicalClimb calm(few_steps(seed), params);
  ASSERT_TRUE(run_to_swing_onto(calm, 1));
  const double begin_s = calm.time_s();
  for (int moment = static_cast<int>(seed % 3); moment < 8; moment += test::kSlowMachine ? 6 : 3) {
    for (const int axis : {0, 1}) {
      for (const double impulse_ns : {10.0, -10.0}) {
        SimOptions options = few_steps(seed);
        options.pushes = {{.at_s = begin_s + 0.32 * moment, .axis = axis, .impulse_ns = impulse_ns}};
        PhysicalClimb climb(options, params);
        climb.run(options.pushes.front().at_s - climb.time_s());
        EXPECT_LT(climb.status().treads_climbed, 2U);
        EXPECT_FALSE(climb.truth().fell);
        climb.run(3.0);
        for (int tick = 0; tick < 1000; ++tick) (void)climb.tick();  // where it stopped, it stands
        EXPECT_FALSE(climb.truth().fell) << "moment " << moment << ", axis " << axis << ", " << impulse_ns << " N s";
      }
    }
  }
}
INSTANTIATE_TEST_SUITE_P(
    Seeds, Pushed,
    testing::Values(PushedCase{2, GaitPattern::kDoubleStep}, PushedCase{3, GaitPattern::kDoubleStep},
                    PushedCase{4, GaitPattern::kDoubleStep}, PushedCase{5, GaitPattern::kDoubleStep},
                    PushedCase{3, GaitPattern::kSingleStep}, PushedCase{4, GaitPattern::kSingleStep}));

}  // namespace
}  // namespace polygmap::sim
