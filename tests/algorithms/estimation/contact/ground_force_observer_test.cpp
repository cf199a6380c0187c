// SPDX-License-Identifier: Apache-2.0
#include "algorithms/estimation/contact/ground_force_observer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "algorithms/estimation/contact/contacts.hpp"
#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

constexpr double kDt_s = 0.002;

// A base that sways and legs that move, all by sines; velocities and accelerations are differences over a microsecond.
struct Motion {
  [[nodiscard]] static Transform world_T_base(double t_s) {
    return {rotation_zyx(0.1 * std::sin(2.0 * t_s), 0.15 * std::sin(3.0 * t_s), 0.1 * std::cos(4.0 * t_s)),
            Vec3{0.05 * std::sin(5.0 * t_s), 0.04 * std::sin(6.0 * t_s), 0.8 + 0.03 * std::cos(7.0 * t_s)}};
  }
  [[nodiscard]] static LegVector q_rad(double t_s) {
    LegVector q;
    q << 0.05, 0.1, -0.5, 1.1, -0.5, 0.02;
    for (Eigen::Index j = 0; j < q.size(); ++j) {
      q[j] += (j == kKnee || j == kHipPitch ? 0.4 : 0.1) * std::sin((6.0 + static_cast<double>(j)) * t_s);
    }
    return q;
  }
  [[nodiscard]] static std::array<Vec3, kJointsPerLeg> world_p_links(Foot foot, double t_s) {
    JointVector both;
    both << q_rad(t_s), q_rad(t_s);
    const BodyFrames frames = body_frames({}, both);
    auto links = base_p_links_m({}, frames).leg[index_of(foot)];
    for (Vec3& link : links) link = world_T_base(t_s) * link;
    return links;
  }
};
constexpr double kStep_s = 1e-4;
template <class Value>
auto rate(const Value& of, double t_s) {
  return ((of(t_s + kStep_s) - of(t_s - kStep_s)) / (2.0 * kStep_s)).eval();
}
template <class Value>
auto acceleration(const Value& of, double t_s) {
  return ((of(t_s + kStep_s) - 2.0 * of(t_s) + of(t_s - kStep_s)) / math::square(kStep_s)).eval();
}

struct Sample {
  JointFeedback joints;
  ImuSample base;
  Vec3 base_up;
};
// What drives and IMU tell of that motion while the ground gives each foot that force.
Sample sample(const RobotModel& robot, double t_s, const std::array<double, kFootCount>& up_n, double friction_nm,
              double armature_kgm2 = RobotModel{}.drives.armature_kgm2) {
  Sample s;
  const Transform base = Motion::world_T_base(t_s);
  const Vec3 up = base.R.transpose() * Vec3::UnitZ();
  const auto base_p = [](double t) { return Motion::world_T_base(t).p_m; };
  s.base_up = up;
  s.base.accel_mps2 = base.R.transpose() * (acceleration(base_p, t_s) + Vec3{0, 0, kGravity_mps2});
  const Mat3 turn = base.R.transpose() *
                    (Motion::world_T_base(t_s + kStep_s).R - Motion::world_T_base(t_s - kStep_s).R) / (2.0 * kStep_s);
  s.base.gyro_radps = {turn(2, 1), turn(0, 2), turn(1, 0)};
  s.joints.stamp_ns = std::llround(t_s * 1e9);
  s.base.stamp_ns = s.joints.stamp_ns;
  const LegVector q = Motion::q_rad(t_s), dq = rate(Motion::q_rad, t_s), ddq = acceleration(Motion::q_rad, t_s);
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    std::array<Vec3, kJointsPerLeg> specific_mps2;
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
      const auto link = [&](double t) { return Motion::world_p_links(foot, t)[j]; };
      specific_mps2[j] = base.R.transpose() * (Vec3{0, 0, -kGravity_mps2} - acceleration(link, t_s));
    }
    const SoleWrench ground{up_n[index_of(foot)] * up, Vec3::Zero()};
    LegVector tau = leg_torques_nm(robot.masses, foot, leg_frames(robot.legs, foot, q), specific_mps2, ground) +
                    armature_kgm2 * ddq;
    for (Eigen::Index j = 0; j < tau.size(); ++j) tau[j] += friction_nm * std::tanh(dq[j] / 0.02);
    const auto at = static_cast<Eigen::Index>(joint_index(foot, 0));
    s.joints.q_rad.segment<6>(at) = q;
    s.joints.dq_radps.segment<6>(at) = dq;
    s.joints.tau_nm.segment<6>(at) = tau;
  }
  return s;
}

// Greatest error of both feet after so many ticks. hangs: the observer is told so.
double worst_error_n(const std::array<double, kFootCount>& up_n, const GroundForceObserver::Params& params,
                     double friction_nm, bool hangs = false, int from = 125) {
  const RobotModel robot;
  GroundForceObserver observer;
  observer.reset(params);
  double worst_n = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const Sample s = sample(robot, i * kDt_s, up_n, friction_nm);
    const auto force_n =
        observer.update(robot, body_frames(robot.legs, s.joints.q_rad), s.joints, s.base, s.base_up, {hangs, hangs});
    if (i < from) continue;
    for (std::size_t f = 0; f < kFootCount; ++f) worst_n = std::max(worst_n, std::abs(force_n[f] - up_n[f]));
  }
  return worst_n;
}

TEST(GroundForceObserver, LegsThatSwingOnABaseThatSways_PressOnNothing) {
  GroundForceObserver::Params params;
  params.friction_nm = 0.0;
  EXPECT_LT(worst_error_n({0.0, 0.0}, params, 0.0), 8.0);
  const auto massless = [&] {
    RobotModel robot;
    for (LinkMass& link : robot.masses.leg) link.mass_kg = 0.0;
    robot.drives.armature_kgm2 = 0.0;
    GroundForceObserver observer;
    observer.reset(params);
    double most_n = 0.0;
    for (int i = 0; i < 1000; ++i) {
      const Sample s = sample(RobotModel{}, i * kDt_s, {0.0, 0.0}, 0.0);
      most_n = std::max(most_n, std::abs(observer.update(robot, body_frames(robot.legs, s.joints.q_rad), s.joints,
                                                         s.base, s.base_up, {})[0]));
    }
    return most_n;
  }();
  EXPECT_GT(massless, 40.0) << "who leaves out the leg's own motion takes it for ground";
}

TEST(GroundForceObserver, ForceOnEachFoot_IsFound) {
  GroundForceObserver::Params params;
  params.friction_nm = 0.0;
  EXPECT_LT(worst_error_n({300.0, 120.0}, params, 0.0), 20.0);
}

TEST(GroundForceObserver, FrictionOfAsMuchAsToldAndTwiceThat_FeignsLittle) {
  GroundForceObserver::Params params;
  EXPECT_LT(worst_error_n({0.0, 0.0}, params, 1.0), 14.0);
  EXPECT_LT(worst_error_n({0.0, 0.0}, params, 2.0), 28.0);
}

TEST(GroundForceObserver, LegsHang_FrictionIsLearnt) {
  GroundForceObserver::Params params;
  const double unlearnt_n = worst_error_n({0.0, 0.0}, params, 3.0, false, 750);
  EXPECT_LT(worst_error_n({0.0, 0.0}, params, 3.0, true, 750), 0.5 * unlearnt_n);

  const RobotModel robot;
  GroundForceObserver observer;
  observer.reset(params);
  for (int i = 0; i < 1000; ++i) {  // the left leg hangs, the right one is not known to
    const Sample s = sample(robot, i * kDt_s, {0.0, 0.0}, 3.0);
    (void)observer.update(robot, body_frames(robot.legs, s.joints.q_rad), s.joints, s.base, s.base_up, {true, false});
  }
  for (Eigen::Index j = 0; j < observer.friction_nm(Foot::kLeft).size(); ++j) {
    EXPECT_NEAR(observer.friction_nm(Foot::kLeft)[j], 3.0, 0.5) << j;
    EXPECT_EQ(observer.friction_nm(Foot::kRight)[j], params.friction_nm) << j;
  }
}

// Four times as much as the robot's file says, and less than it says.
TEST(GroundForceObserver, LegsHang_ArmatureIsLearnt) {
  const RobotModel robot;
  for (const double armature_kgm2 : {0.2, 0.02}) {
    GroundForceObserver observer;
    observer.reset({});
    std::array<double, kFootCount> last_n{};
    for (int i = 0; i < 1000; ++i) {  // the left leg hangs, the right one is not known to
      const Sample s = sample(robot, i * kDt_s, {0.0, 0.0}, 1.0, armature_kgm2);
      const auto force_n =
          observer.update(robot, body_frames(robot.legs, s.joints.q_rad), s.joints, s.base, s.base_up, {true, false});
      if (i < 750) continue;
      for (std::size_t f = 0; f < kFootCount; ++f) last_n[f] = std::max(last_n[f], std::abs(force_n[f]));
    }
    for (const Eigen::Index j : {Eigen::Index{kHipPitch}, Eigen::Index{kKnee}}) {
      EXPECT_NEAR(observer.armature_kgm2(Foot::kLeft)[j], armature_kgm2, 0.015) << j;
      EXPECT_EQ(observer.armature_kgm2(Foot::kRight)[j], robot.drives.armature_kgm2) << j;
    }
    EXPECT_LT(last_n[0], 0.7 * last_n[1]) << "what is not learnt is taken for ground";
  }
}

// Of the left foot, which the ground presses with 270 N: the worst error in two seconds after the leg has hung or not.
// The true robot has that friction, armature and legs so many times as heavy as its file says.
struct TrueLegs {
  double friction_nm = 1.0;
  double armature_kgm2 = RobotModel{}.drives.armature_kgm2;
  double mass_scale = 1.0;
};
double error_on_the_ground_n(bool hung_before, const TrueLegs& legs) {
  const RobotModel robot;
  RobotModel true_robot;
  for (LinkMass& link : true_robot.masses.leg) link.mass_kg *= legs.mass_scale;
  GroundForceObserver observer;
  observer.reset({});
  double worst_n = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const bool hangs = i < 1000;
    const Sample s = sample(true_robot, i * kDt_s, {hangs ? 0.0 : 270.0, 0.0}, legs.friction_nm, legs.armature_kgm2);
    const auto force_n = observer.update(robot, body_frames(robot.legs, s.joints.q_rad), s.joints, s.base, s.base_up,
                                         {hangs && hung_before, false});
    if (i > 1050) worst_n = std::max(worst_n, std::abs(force_n[0] - 270.0));
  }
  return worst_n;
}

TEST(GroundForceObserver, FootOnTheGround_FrictionLearntInTheAirCounts) {
  const TrueLegs legs{.friction_nm = 3.0};
  EXPECT_LT(error_on_the_ground_n(true, legs), 0.6 * error_on_the_ground_n(false, legs));
}

TEST(GroundForceObserver, FootOnTheGround_ArmatureLearntInTheAirCounts) {
  const TrueLegs legs{.armature_kgm2 = 0.2};
  EXPECT_LT(error_on_the_ground_n(true, legs), 0.8 * error_on_the_ground_n(false, legs));
}

// What is learnt in the air is then a part of the masses' error, too, which on the ground is none of the drives': it
// may add no more than a foot in the air may press.
TEST(GroundForceObserver, LegsATenthHeavierOrLighter_WhatIsLearntInTheAirAddsLittleOnTheGround) {
  const double most_n = ContactEstimator::Params{}.force_air_n;
  for (const double mass_scale : {0.9, 1.1}) {
    const TrueLegs legs{.mass_scale = mass_scale};
    EXPECT_LT(error_on_the_ground_n(true, legs), error_on_the_ground_n(false, legs) + most_n) << mass_scale;
  }
}

TEST(GroundForceObserver, StandingStill_FirstSampleTellsTheForce) {
  const RobotModel robot;
  GroundForceObserver observer;
  observer.reset({});
  Sample s = sample(robot, 0.0, {270.0, 0.0}, 0.0);
  s.joints.dq_radps.setZero();
  s.base = {s.joints.stamp_ns, Vec3::Zero(), kGravity_mps2 * s.base_up};
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    std::array<Vec3, kJointsPerLeg> gravity_mps2;
    gravity_mps2.fill(-kGravity_mps2 * s.base_up);
    const LegVector q = leg_joints(s.joints.q_rad, foot);
    const SoleWrench ground{(foot == Foot::kLeft ? 270.0 : 0.0) * s.base_up, Vec3::Zero()};
    s.joints.tau_nm.segment<6>(static_cast<Eigen::Index>(joint_index(foot, 0))) =
        leg_torques_nm(robot.masses, foot, leg_frames(robot.legs, foot, q), gravity_mps2, ground);
  }
  const auto force_n = observer.update(robot, body_frames(robot.legs, s.joints.q_rad), s.joints, s.base, s.base_up, {});
  EXPECT_NEAR(force_n[0], 270.0, 6.0);
  EXPECT_NEAR(force_n[1], 0.0, 3.0);
}

}  // namespace
}  // namespace polygmap
