// SPDX-License-Identifier: Apache-2.0
// Plan of the centre of mass, feedback, split of the ground's force, torques: each by itself.
#include "algorithms/gait/balance/balance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "algorithms/gait/trajectories/com_plan.hpp"
#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

JointVector bent_q_rad() {
  JointVector q;
  q << 0.05, 0.1, -0.5, 0.9, -0.4, -0.03, -0.04, -0.1, -0.3, 0.7, -0.35, 0.06;
  return q;
}

PerLink links_m(const JointVector& q_rad) { return base_p_links_m({}, body_frames({}, q_rad)); }

ZmpKnots knots(std::initializer_list<ZmpKnot> list) {
  ZmpKnots result;
  for (const ZmpKnot& knot : list) EXPECT_TRUE(result.try_push_back(knot));
  return result;
}

// Two steps to the left and on.
const ZmpKnots kWalk = knots({{75, {0, 0}}, {355, {0.1, 0.09}}, {850, {0.1, 0.09}}, {1130, {0.35, -0.09}}});

TEST(ComPlan, FromRest_StartsAndEndsAtRestAndKeepsThePendulumsLaw) {
  ComPlan plan;
  plan.plan({}, {}, kWalk);
  EXPECT_LT(plan.at(0).position_m.norm() + plan.at(0).velocity_mps.norm(), 1e-12);
  EXPECT_LT((plan.at(4000).position_m - Vec2(0.35, -0.09)).norm(), 1e-6);
  EXPECT_LT(plan.at(4000).velocity_mps.norm(), 1e-6);
  const double w = ComPlan::Params{}.omega_radps;
  for (int tick = 1; tick < 3000; ++tick) {
    const HorizontalMotion before = plan.at(tick - 1), now = plan.at(tick), after = plan.at(tick + 1);
    // Speeds are those of the positions, accelerations those of the pendulum over the zero-moment point.
    EXPECT_LT(((after.position_m - before.position_m) / (2 * kTick_s) - now.velocity_mps).norm(), 1e-4) << tick;
    EXPECT_LT((now.acceleration_mps2 - w * w * (now.position_m - plan.zmp_m(tick))).norm(), 1e-9) << tick;
    EXPECT_LT((after.acceleration_mps2 - now.acceleration_mps2).norm(), 0.06) << tick;  // no jump of the ZMP
  }
}

TEST(ComPlan, AfterThePush_ZmpIsOnItsStraightWay) {
  ComPlan plan;
  plan.plan({}, {}, kWalk);
  EXPECT_GT(plan.zmp_offset_m(), 0.005);
  EXPECT_LT((plan.zmp_m(200) - (200.0 - 75.0) / 280.0 * Vec2(0.1, 0.09)).norm(), 1e-12);
  EXPECT_EQ(plan.zmp_m(600), Vec2(0.1, 0.09));
}

TEST(ComPlan, MadeAgainOnItsWay_NeedsNoPush) {
  ComPlan plan;
  plan.plan({}, {}, kWalk);
  ComPlan again;
  again.plan({}, plan.at(400), knots({{450, {0.1, 0.09}}, {730, {0.35, -0.09}}}));
  EXPECT_LT(again.zmp_offset_m(), 1e-9);
  EXPECT_LT((again.at(300).position_m - plan.at(700).position_m).norm(), 1e-9);
}

TEST(ComPlan, InMotion_ComesToRest) {
  ComPlan plan;
  const HorizontalMotion moving{{0.1, 0.0}, {0.2, -0.1}, {0.3, 0.1}};
  plan.plan({}, moving, knots({{200, {0.12, 0.01}}}));
  EXPECT_LT((plan.at(0).velocity_mps - moving.velocity_mps).norm(), 1e-9);
  EXPECT_LT((plan.at(0).acceleration_mps2 - moving.acceleration_mps2).norm(), 1e-9);
  EXPECT_LT((plan.at(3000).position_m - Vec2(0.12, 0.01)).norm(), 1e-6);
}

TEST(DcmStabiliser, PendulumOffItsPlace_ReturnsAndWithoutFeedbackFalls) {
  for (const double gain : {2.0, 0.0}) {
    DcmStabiliser::Params params;
    params.gain = gain;
    DcmStabiliser stabiliser;
    const double w = 3.5;
    Vec2 x{0.01, -0.02}, v = Vec2::Zero();
    for (int tick = 0; tick < 1500; ++tick) {
      const Vec2 zmp = stabiliser.zmp_m(params, {}, x, v, w, kTick_s);
      v += kTick_s * w * w * (x - zmp);
      x += kTick_s * v;
    }
    EXPECT_EQ(x.norm() < 0.01, gain > 0.0) << gain << ": " << x.norm();
  }
}

TEST(DcmStabiliser, LastingError_IntegralIsLimited) {
  DcmStabiliser stabiliser;
  Vec2 zmp = Vec2::Zero();
  for (int tick = 0; tick < 100'000; ++tick) {
    zmp = stabiliser.zmp_m({}, {}, Vec2(0.01, 0), Vec2::Zero(), 3.5, kTick_s);
  }
  EXPECT_NEAR(zmp.x(), DcmStabiliser::Params{}.gain * 0.01 + 0.02, 1e-12);
}

// Both legs bent, soles level, and pressed off their middles.
struct PressedSoles {
  MassModel masses;
  JointFeedback felt;
  std::array<Transform, kFootCount> odom_T_sole;
  Vec2 zmp_m = Vec2::Zero();
  Vec2 slope{0.03, -0.05};

  PressedSoles() {
    const std::array<Vec3, kFootCount> local_m{Vec3{0.05, 0.01, 0.0}, Vec3{-0.02, -0.02, 0.0}};
    constexpr std::array kForce_n{200.0, 340.0};
    for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
      const std::size_t f = index_of(leg);
      odom_T_sole[f] = {rotation_z(0.2), Vec3{0.2 * static_cast<double>(f), 0.11 * side_sign(leg), -0.75}};
      const LegVector q_rad = solve_leg({}, leg, odom_T_sole[f]).q_rad;  // the base at odometry's origin
      const Vec3 force_n = kForce_n[f] * Vec3{slope.x(), slope.y(), 1.0};
      std::array<Vec3, kJointsPerLeg> weight_mps2;
      weight_mps2.fill({0, 0, -kGravity_mps2});
      const SoleWrench ground{force_n, (odom_T_sole[f].R * local_m[f]).cross(force_n)};
      felt.tau_nm.segment<6>(static_cast<Eigen::Index>(joint_index(leg, 0))) =
          leg_torques_nm(masses, leg, leg_frames({}, leg, q_rad), weight_mps2, ground);
      felt.foot_force_n[f] = kForce_n[f];
      zmp_m += kForce_n[f] / 540.0 * (odom_T_sole[f] * local_m[f]).head<2>();
    }
  }
  [[nodiscard]] bool try_measure(Vec2& measured_m) const {
    return try_measure_zmp({}, nominal_robot(), felt, odom_T_sole, slope, measured_m);
  }
};

TEST(ZmpMeasurement, SolesPressedOffTheirMiddles_AreFound) {
  Vec2 measured_m;
  const PressedSoles soles;
  ASSERT_TRUE(soles.try_measure(measured_m));
  EXPECT_LT((measured_m - soles.zmp_m).norm(), 0.3e-3);  // the foot is also weighed
}

TEST(ZmpMeasurement, NothingTold_IsNone) {
  const Vec2 before{7.0, 8.0};
  Vec2 measured_m = before;
  PressedSoles no_torque;
  no_torque.felt.tau_nm[kAnklePitch] = std::nan("");
  EXPECT_FALSE(no_torque.try_measure(measured_m));
  PressedSoles drives_that_tell_none;
  drives_that_tell_none.felt.tau_nm.setZero();
  EXPECT_FALSE(drives_that_tell_none.try_measure(measured_m));
  PressedSoles no_force;
  no_force.felt.foot_force_n.fill(std::nan(""));
  EXPECT_FALSE(no_force.try_measure(measured_m));
  PressedSoles dead_sensor;
  dead_sensor.felt.foot_force_n[1] = 0.0;
  EXPECT_FALSE(dead_sensor.try_measure(measured_m));
  EXPECT_EQ(measured_m, before);
}

Support standing(double left_z_m = 0.0) {
  Support support;
  support.odom_T_sole[0].p_m = {0.0, 0.1, left_z_m};
  support.odom_T_sole[1].p_m = {0.0, -0.1, 0.0};
  return support;
}

TEST(WrenchDistribution, ForceBetweenTheSoles_IsSharedByPlace) {
  const Pressure middle = distribute(standing(), {}, {0, 0, 0.8}, Vec2::Zero());
  EXPECT_NEAR(middle.share[0], 0.5, 1e-12);
  EXPECT_LT(middle.zmp_m.head<2>().norm(), 1e-12);
  const Pressure left = distribute(standing(), {}, {0, 0.08, 0.8}, Vec2::Zero());
  EXPECT_EQ(left.share[0], 1.0);  // 30 mm inward of the left sole's middle line it carries everything
  EXPECT_NEAR(left.zmp_m.y(), 0.08, 1e-12);
}

TEST(WrenchDistribution, WrenchesOfBothSoles_AddUpToTheForceThroughTheCentreOfMass) {
  const Support support = standing(0.13);
  const Vec3 com_m{0.02, 0.03, 0.9};
  const Vec2 slope{0.02, -0.03};
  const Pressure pressure = distribute(support, {}, com_m, slope);
  const Vec3 force_n{540 * slope.x(), 540 * slope.y(), 540};
  Vec3 sum_n = Vec3::Zero(), moment_nm = Vec3::Zero();
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    const SoleWrench wrench = sole_wrench(pressure, support, foot, force_n, Mat3::Identity());
    sum_n += wrench.force_n;
    moment_nm += wrench.moment_nm + (support.odom_T_sole[index_of(foot)].p_m - com_m).cross(wrench.force_n);
  }
  EXPECT_LT((sum_n - force_n).norm(), 1e-9);
  EXPECT_LT(moment_nm.norm(), 1.0);  // feet at two heights: the line meets their connection within 2 mm
}

TEST(WrenchDistribution, ForceBeyondTheSole_StopsAtItsLimits) {
  Support support = standing();
  support.stands = {true, false};
  const PressureLimits limits;
  const Pressure far = distribute(support, limits, {0.3, 0.3, 0.8}, Vec2::Zero());
  EXPECT_EQ(far.share[0], 1.0);
  EXPECT_NEAR(far.zmp_m.x(), limits.ahead_m, 1e-12);
  EXPECT_NEAR(far.zmp_m.y(), 0.1 + limits.aside_m, 1e-12);
  const Pressure behind = distribute(support, limits, {-0.3, -0.3, 0.8}, Vec2::Zero());
  EXPECT_NEAR(behind.zmp_m.x(), -limits.behind_m, 1e-12);
  EXPECT_NEAR(behind.zmp_m.y(), 0.1 - limits.aside_m, 1e-12);
}

// What the ankles hold is a torque: of half the force at twice the distance.
TEST(WrenchDistribution, ForceFarAheadOfTwoSoles_IsPressedTwiceAsFarAheadAsOfOne) {
  const PressureLimits limits;
  const Pressure half = distribute(standing(), limits, {0.12, 0.0, 0.8}, Vec2::Zero());
  EXPECT_NEAR(half.zmp_m.x(), 0.12, 1e-9);
  EXPECT_NEAR(half.share[0], 0.5, 1e-9);
  const Pressure far = distribute(standing(), limits, {0.3, 0.0, 0.8}, Vec2::Zero());
  for (std::size_t f = 0; f < kFootCount; ++f) {
    EXPECT_LE(far.share[f] * far.centre_m[f].x(), limits.ahead_m + 1e-9);
    EXPECT_LE(far.centre_m[f].x(), limits.toe_m + 1e-9);
  }
  EXPECT_GT(far.zmp_m.x(), 1.9 * limits.ahead_m);
  PressureLimits short_soles;
  short_soles.toe_m = 0.1;
  EXPECT_NEAR(distribute(standing(), short_soles, {0.3, 0.0, 0.8}, Vec2::Zero()).zmp_m.x(), 0.1, 1e-9);
}

// Of all shares, with what remains pressed within both soles: how close to a vertical line through the point they come.
double closest_m(const Support& support, const PressureLimits& limits, const Vec2& line_m) {
  double closest = 1e3;
  const std::array side{1.0, -1.0};
  std::array<Vec2, kFootCount> carrier_m;
  for (std::size_t f = 0; f < kFootCount; ++f) {
    carrier_m[f] = support.odom_T_sole[f].p_m.head<2>() - Vec2{0.0, side[f] * limits.inward_m};
  }
  for (int i = 0; i <= 1000; ++i) {
    const std::array share{1e-3 * i, 1.0 - 1e-3 * i};
    const Vec2 rest_m = line_m - share[0] * carrier_m[0] - share[1] * carrier_m[1];
    Vec2 zmp_m = Vec2::Zero();
    for (std::size_t f = 0; f < kFootCount; ++f) {
      const Vec2 local_m = rest_m - Vec2{0.0, side[f] * limits.inward_m};
      const double ahead_m = std::min(limits.ahead_m / std::max(share[f], 1e-3), limits.toe_m);
      zmp_m += share[f] *
               (support.odom_T_sole[f].p_m.head<2>() + Vec2{math::clamp(local_m.x(), -limits.behind_m, ahead_m),
                                                            math::clamp(local_m.y(), -limits.aside_m, limits.aside_m)});
    }
    closest = std::min(closest, (zmp_m - line_m).norm());
  }
  return closest;
}

// One foot on the next tread: sideways the soles' hull is narrow, and shares by the place between them give up ground.
TEST(WrenchDistribution, ForceBeyondBothSoles_ComesAboutAsCloseAsAnyShares) {
  Support support = standing();
  support.odom_T_sole[0].p_m = {-0.28, 0.1, -0.13};
  const PressureLimits limits;
  double most_m = 0.0;
  for (double x_m = -0.4; x_m < 0.15; x_m += 0.05) {
    for (double y_m = -0.2; y_m < 0.25; y_m += 0.05) {
      const Vec2 line_m{x_m, y_m};
      const Pressure pressure = distribute(support, limits, {x_m, y_m, 0.8}, Vec2::Zero());
      most_m = std::max(most_m, closest_m(support, limits, line_m));
      EXPECT_LT((pressure.zmp_m.head<2>() - line_m).norm(), closest_m(support, limits, line_m) + 0.007) << line_m;
    }
  }
  EXPECT_GT(most_m, 0.1);
  const Vec2 pushed_m{0.03, 0.02};
  EXPECT_LT((distribute(support, limits, {0.03, 0.02, 0.8}, Vec2::Zero()).zmp_m.head<2>() - pushed_m).norm(),
            closest_m(support, limits, pushed_m) + 0.001);
}

TEST(Balance, FootThatHangs_DoesNotMoveThePlan) {
  JointVector q_rad = bent_q_rad();
  Balance::Reference reference;
  for (std::size_t f = 0; f < kFootCount; ++f) reference.plan_T_sole[f] = body_frames({}, q_rad)[f].sole;
  q_rad[static_cast<Eigen::Index>(joint_index(Foot::kRight, kHipPitch))] += 0.1;
  const auto moved_m = [&](double right_n) {
    Balance balance;
    Balance::Body body;
    body.q_rad = q_rad;
    JointFeedback feedback;
    feedback.foot_force_n = {500.0, right_n};
    (void)balance.torques_nm({}, nominal_robot(), reference, body, feedback, kTick_s);
    return balance.odom_p_com_planned_m().norm();
  };
  EXPECT_LT(moved_m(0.0), 1e-12);
  EXPECT_GT(moved_m(100.0), 0.02);
  EXPECT_EQ(moved_m(std::nan("")), moved_m(100.0));  // without forces both count
}

TEST(LegDynamics, CentreOfMassSpeed_IsItsDifference) {
  const JointVector q = bent_q_rad();
  for (int j = 0; j < 12; ++j) {
    const JointVector dq = 1e-6 * JointVector::Unit(j);
    const Vec3 difference = centre_of_mass_m({}, links_m(q + dq)) - centre_of_mass_m({}, links_m(q));
    EXPECT_LT((base_v_com_mps({}, body_frames({}, q), links_m(q), dq) - difference).norm(), 1e-11) << j;
  }
}

// Virtual work: torques hold the links' weights and the sole's wrench against any small motion of the joints.
TEST(LegDynamics, Torques_DoTheWorkOfWeightsAndGround) {
  const JointVector q = bent_q_rad();
  const MassModel masses;
  const Vec3 gravity{0.3, -0.2, -9.8};
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const SoleWrench ground{{20, -30, 250}, {5, -12, 3}};
    std::array<Vec3, kJointsPerLeg> specific;
    specific.fill(gravity);
    const LegVector torque = leg_torques_nm(masses, leg, body_frames({}, q)[index_of(leg)], specific, ground);
    const LegJacobian jacobian = leg_jacobian({}, leg, leg_joints(q, leg));
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
      const double step = 1e-6;
      JointVector moved = q;
      moved[static_cast<Eigen::Index>(joint_index(leg, j))] += step;
      const PerLink before = links_m(q), after = links_m(moved);
      double work = 0.0;
      for (std::size_t l = 0; l < kJointsPerLeg; ++l) {
        work += masses.leg[l].mass_kg * gravity.dot(after.leg[index_of(leg)][l] - before.leg[index_of(leg)][l]) / step;
      }
      const auto c = static_cast<Eigen::Index>(j);
      work += ground.force_n.dot(jacobian.col(c).head<3>()) + ground.moment_nm.dot(jacobian.col(c).tail<3>());
      EXPECT_NEAR(torque[c], -work, 1e-3) << j;
    }
  }
}

TEST(LinkMotion, EvenAcceleration_IsFoundAndForgottenAtARestart) {
  LinkMotion motion;
  const Vec3 a{1.0, -2.0, 0.5};
  LinkMotion::Acceleration found;
  for (int tick = 0; tick < 5; ++tick) {
    const double t = tick * kTick_s;
    found = motion.update({Mat3::Identity(), 0.5 * t * t * a}, links_m(bent_q_rad()), bent_q_rad());
    EXPECT_EQ(found.plan_mps2.torso.norm() > 0.0, tick >= 2);
  }
  EXPECT_LT((found.plan_mps2.torso - a).norm(), 1e-6);
  EXPECT_LT((found.plan_mps2.leg[1][kKnee] - a).norm(), 1e-6);
  // A body that moves as one does not turn.
  EXPECT_LT(angular_momentum_rate_nm({}, links_m(bent_q_rad()), found.plan_mps2).norm(), 1e-5);
  motion.restart();
  EXPECT_EQ(motion.update({}, links_m(bent_q_rad()), bent_q_rad()).plan_mps2.torso.norm(), 0.0);
}

TEST(LinkMotion, SwingingFoot_TurnsTheBody) {
  PerLink p = links_m(JointVector::Zero()), a;
  a.leg[0][kAnkleRoll] = {10.0, 0, 0};  // forward, far below the centre of mass
  const MassModel masses;
  const double lever_m = p.leg[0][kAnkleRoll].z() - centre_of_mass_m(masses, p).z();
  EXPECT_NEAR(angular_momentum_rate_nm(masses, p, a).y(), masses.leg[kAnkleRoll].mass_kg * 10.0 * lever_m, 1e-9);
}

}  // namespace
}  // namespace polygmap
