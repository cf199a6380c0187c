// SPDX-License-Identifier: Apache-2.0
// Failures of sensors, map and ground under physics. A study of this climb met six; the drives' are in footstep_test,
// the soles' in sim_mujoco_plant_test.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "sim_stub/world/clearance.hpp"
#include "tests/support/nominal_robot.hpp"
#include "tests/support/physical_climb.hpp"

namespace polygmap::sim {
namespace {

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
    least_m = std::min(least_m, clearance_m(collision_box(kSole, climb.truth().true_T_sole[f]), solids, excluded));
  }
  EXPECT_GT(least_m, 0.0);
  EXPECT_LT(least_m, 0.014);  // it was that near at all
  EXPECT_FALSE(climb.truth().fell) << climb.truth().fall_reason;
  EXPECT_EQ(climb.status().phase, GaitPhase::kFinished);
}

}  // namespace
}  // namespace polygmap::sim
