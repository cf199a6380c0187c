// SPDX-License-Identifier: Apache-2.0
// How far the centre of mass is from where body and masses have it: the observer by itself, and in Balance.
#include "algorithms/gait/balance/dcm_bias.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "algorithms/gait/balance/balance.hpp"
#include "algorithms/robot/leg_kinematics.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap {
namespace {

// A pendulum held up by an estimate that is wrong by bias_m; push_mps: at 12 s.
struct BiasedPendulum {
  BiasedPendulum(const Vec2& bias, double heading) : bias_m(bias), heading_rad(heading) {}

  Vec2 bias_m;
  double heading_rad;
  Vec2 push_mps = Vec2::Zero();
  DcmBias observer;
  Vec2 x_m{0.004, -0.006};

  void run(double seconds, bool seen = true) {
    constexpr double kOmega_radps = 3.5;
    const Mat2 heading = rotation_z(heading_rad).topLeftCorner<2, 2>();
    Vec2 v_mps = Vec2::Zero();
    DcmStabiliser stabiliser;
    for (int tick = 0; tick < seconds / kTick_s; ++tick) {
      if (tick == 6000) v_mps += push_mps;
      const Vec2 estimate_m = x_m + bias_m;
      const Vec2 zmp_m = stabiliser.zmp_m({}, {}, estimate_m - observer.odom_bias_m(), v_mps, kOmega_radps, kTick_s);
      if (seen) {
        observer.update({}, estimate_m + v_mps / kOmega_radps, zmp_m, heading, kOmega_radps, kTick_s);
      } else {
        observer.missed(heading);
      }
      v_mps += kTick_s * math::square(kOmega_radps) * (x_m - zmp_m);
      x_m += kTick_s * v_mps;
    }
  }
};

TEST(DcmBias, WronglyEstimatedPendulum_IsFoundAndHeldInItsPlace) {
  BiasedPendulum pendulum{{0.012, -0.009}, 0.7};
  pendulum.run(10.0);
  EXPECT_LT((pendulum.observer.odom_bias_m() - pendulum.bias_m).norm(), 0.2e-3);
  EXPECT_LT(pendulum.x_m.norm(), 1e-3);
  BiasedPendulum unseen{{0.012, -0.009}, 0.7};
  unseen.run(10.0, false);
  EXPECT_EQ(unseen.observer.odom_bias_m().norm(), 0.0);
  EXPECT_GT(unseen.x_m.norm(), 0.01);
}

TEST(DcmBias, RobotThatTurns_BiasTurnsWithIt) {
  BiasedPendulum pendulum{{0.01, 0.0}, 0.0};
  pendulum.run(10.0);
  pendulum.heading_rad = 0.5 * kPi;
  pendulum.run(2 * kTick_s, false);  // measured or not
  EXPECT_LT((pendulum.observer.odom_bias_m() - Vec2{0.0, 0.01}).norm(), 0.5e-3);
}

// The attitude of a robot that was balanced by a wrong one is corrected: the body stays where it was.
TEST(DcmBias, EstimateIsCorrectedAndTheBiasToldOfIt_NothingMoves) {
  BiasedPendulum pendulum{{0.026, -0.004}, 0.7};
  pendulum.run(10.0);
  BiasedPendulum untold = pendulum;
  const Vec2 shift_m{-0.026, 0.004};
  pendulum.observer.shift(shift_m, rotation_z(pendulum.heading_rad).topLeftCorner<2, 2>());
  pendulum.bias_m += shift_m;
  EXPECT_LT(pendulum.observer.odom_bias_m().norm(), 0.5e-3);
  pendulum.run(0.3);
  EXPECT_LT(pendulum.x_m.norm(), 1e-3);
  untold.bias_m += shift_m;
  untold.run(0.3);
  EXPECT_GT(untold.x_m.norm(), 0.01);
}

TEST(DcmBias, Push_IsNoBias) {
  BiasedPendulum pendulum{{0.005, 0.005}, 0.0};
  pendulum.push_mps = {0.0, 10.0 / MassModel{}.total_kg()};
  pendulum.run(12.5);
  EXPECT_LT((pendulum.observer.odom_bias_m() - pendulum.bias_m).norm(), 2e-3);
}

// A robot on two soles whose centre of mass is not where the masses have it. It moves as a pendulum over where its
// drives press, which the wrenches of both legs tell: -J'^-1 of the torques beyond what the links weigh.
struct MisweighedRobot {
  static constexpr double kBase_m = 0.75, kOmega_radps = 3.5;
  MisweighedRobot(const Vec2& bias, bool tells) : bias_m(bias), tells_torques(tells) {}

  Vec2 bias_m;  // believed minus true
  bool tells_torques;
  Balance balance;
  Vec2 moved_m{0.004, -0.003}, moves_mps = Vec2::Zero();  // of base and true centre of mass, from the plan
  JointVector torque_nm = JointVector::Zero();
  Vec2 zmp_m = Vec2::Zero();
  std::array<double, kFootCount> force_n{};

  [[nodiscard]] static Transform sole(Foot foot) {
    return {Mat3::Identity(), Vec3{0.0, side_sign(foot) * kStanceHalfWidth_m, 0.0}};
  }
  [[nodiscard]] JointVector q_rad() const {
    JointVector q;
    const Transform base{Mat3::Identity(), Vec3{moved_m.x(), moved_m.y(), kBase_m}};
    for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
      q.segment<6>(static_cast<Eigen::Index>(joint_index(foot, 0))) =
          solve_leg({}, foot, base.inverse() * sole(foot)).q_rad;
    }
    return q;
  }
  [[nodiscard]] Vec2 believed_com_m() const {
    return moved_m + centre_of_mass_m({}, base_p_links_m({}, body_frames({}, q_rad()))).head<2>();
  }
  [[nodiscard]] Vec2 true_com_m() const { return believed_com_m() - bias_m; }

  void run(double duration_s) {
    const Vec2 plan_m = believed_com_m() - moved_m;
    for (int tick = 0; tick < duration_s / kTick_s; ++tick) {
      const JointVector q = q_rad();
      Balance::Reference reference;
      reference.com.position_m = plan_m;
      for (const Foot foot : {Foot::kLeft, Foot::kRight}) reference.plan_T_sole[index_of(foot)] = sole(foot);
      Balance::Body body;
      body.odom_T_base.p_m = {moved_m.x(), moved_m.y(), kBase_m};
      body.odom_v_base_mps = {moves_mps.x(), moves_mps.y(), 0.0};
      body.q_rad = q;
      JointFeedback felt;
      felt.tau_nm = torque_nm;
      if (!tells_torques) felt.tau_nm.setConstant(std::nan(""));
      felt.foot_force_n = force_n;
      felt.dq_radps = (q - before_rad_) / kTick_s;
      if (tick == 0) felt.dq_radps.setZero();
      before_rad_ = q;
      torque_nm = balance.torques_nm({}, nominal_robot(), reference, body, felt, kTick_s);
      press(q);
      moves_mps += kTick_s * math::square(kOmega_radps) * (true_com_m() - zmp_m);
      moved_m += kTick_s * moves_mps;
    }
  }

 private:
  void press(const JointVector& q) {
    const BodyFrames frames = body_frames({}, q);
    std::array<Vec3, kJointsPerLeg> weight_mps2;
    weight_mps2.fill({0, 0, -kGravity_mps2});
    Vec2 moment_nm = Vec2::Zero();
    for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
      const std::size_t f = index_of(foot);
      const LegVector own_nm = leg_torques_nm({}, foot, frames[f], weight_mps2, {});
      const LegJacobian J = leg_jacobian(frames[f]);
      const Eigen::Matrix<double, 6, 1> wrench =
          -J.transpose().partialPivLu().solve(leg_joints(torque_nm, foot) - own_nm);
      force_n[f] = wrench.z();
      moment_nm += wrench.z() * sole(foot).p_m.head<2>() + Vec2{-wrench[4], wrench[3]};
    }
    zmp_m = moment_nm / (force_n[0] + force_n[1]);
  }
  JointVector before_rad_ = JointVector::Zero();
};

TEST(Balance, MassesBelievedTenMillimetresOff_ZeroMomentPointEndsUnderTheTrueOnes) {
  for (const Vec2& bias_m : {Vec2{0.01, 0.0}, Vec2{-0.01, 0.0}, Vec2{0.006, 0.008}}) {
    MisweighedRobot robot(bias_m, true);
    const Vec2 plan_m = robot.believed_com_m() - robot.moved_m;
    robot.run(12.0);
    EXPECT_LT((robot.balance.odom_com_bias_m() - bias_m).norm(), 1e-3) << bias_m;
    EXPECT_LT((robot.true_com_m() - plan_m).norm(), 1e-3) << bias_m;
    EXPECT_LT((robot.zmp_m - plan_m).norm(), 1e-3) << bias_m;
    MisweighedRobot blind(bias_m, false);
    blind.run(12.0);
    EXPECT_EQ(blind.balance.odom_com_bias_m().norm(), 0.0);
    EXPECT_GT((blind.zmp_m - plan_m).norm(), 8e-3) << bias_m;
  }
}

}  // namespace
}  // namespace polygmap
