// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/balance/balance.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace polygmap {
namespace {

// What each foot says of the place of the plan: those that stand, alike, but one that is pressed less than pressed_n
// hangs and moves.
std::array<double, kFootCount> held_by(double pressed_n, const std::array<bool, kFootCount>& stands,
                                       const std::array<double, kFootCount>& force_n) noexcept {
  std::array<double, kFootCount> holds{};
  for (std::size_t f = 0; f < kFootCount; ++f) {
    if (stands[f]) holds[f] = math::clamp(force_n[f] / pressed_n, 0.0, 1.0);
  }
  if (!(holds[0] + holds[1] > 0.5) || !std::isfinite(force_n[0] + force_n[1])) {  // no force is told, or none is there
    holds = {stands[0] ? 1.0 : 0.0, stands[1] ? 1.0 : 0.0};
  }
  const double sum = holds[0] + holds[1];
  return {holds[0] / sum, holds[1] / sum};
}

Mat2 heading_of(const Mat3& odom_R_base) noexcept {
  const Vec2 ahead = odom_R_base.col(0).head<2>().normalized();
  return (Mat2() << ahead.x(), -ahead.y(), ahead.y(), ahead.x()).finished();
}

}  // namespace

void Balance::reset() noexcept {
  stabiliser_.reset();
  bias_.reset();
  bias_tick_ = 0;
  share_ = {0.5, 0.5};
  odom_p_com_planned_m_.setZero();
  com_error_m_.setZero();
  slope_.setZero();
}

Vec2 Balance::turn(const RobotModel& robot, const Body& body, const Vec3& odom_turned_rad) noexcept {
  const BodyFrames frames = body_frames(robot.legs, body.q_rad);
  // The centre of mass above the soles, which rest: it is seen elsewhere now.
  const Vec3 base_up_m = centre_of_mass_m(robot.masses, base_p_links_m(robot.masses, frames)) -
                         0.5 * (frames[0].sole.p_m + frames[1].sole.p_m);
  const Vec2 odom_shift_m = odom_turned_rad.cross(body.odom_T_base.R * base_up_m).head<2>();
  bias_.shift(odom_shift_m, heading_of(body.odom_T_base.R));
  return odom_shift_m;
}

Balance::Pendulum Balance::pendulum_of(const MassModel& masses, const BodyFrames& frames, const Body& body,
                                       const JointVector& dq_radps, const PerLink& links_mps2,
                                       double ground_m) noexcept {
  const Mat3& R = body.odom_T_base.R;
  const PerLink base_p_m = base_p_links_m(masses, frames);
  const Vec3 base_p_com_m = centre_of_mass_m(masses, base_p_m);
  const Vec3 base_v_com = base_v_com_mps(masses, frames, base_p_m, dq_radps);
  Pendulum p;
  p.odom_p_com_m = body.odom_T_base * base_p_com_m;
  p.odom_v_com_mps = body.odom_v_base_mps + R * (base_v_com + body.base_w_base_radps.cross(base_p_com_m));

  constexpr double kLeastHeight_m = 0.3;  // a falling robot still gets finite numbers
  p.height_m = std::max(p.odom_p_com_m.z() - ground_m, kLeastHeight_m);
  double lift_n = masses.torso.mass_kg * links_mps2.torso.z();
  for (const auto& leg : links_mps2.leg) {
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) lift_n += masses.leg[j].mass_kg * leg[j].z();
  }
  constexpr double kLeastUp_mps2 = 0.2 * kGravity_mps2;  // no plan falls freely
  const double up_mps2 = std::max(kGravity_mps2 + lift_n / masses.total_kg(), kLeastUp_mps2);
  p.omega_radps = math::sqrt(up_mps2 / p.height_m);
  // Legs that swing turn the body: the ground's force passes beside the centre of mass by as much as that takes.
  PerLink turned_m;
  turned_m.torso = R * base_p_m.torso;
  for (std::size_t f = 0; f < kFootCount; ++f) {
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) turned_m.leg[f][j] = R * base_p_m.leg[f][j];
  }
  const Vec3 turning_nm = angular_momentum_rate_nm(masses, turned_m, links_mps2);
  p.vertical_n = masses.total_kg() * up_mps2;
  p.beside_m = {-turning_nm.y() / p.vertical_n, turning_nm.x() / p.vertical_n};
  return p;
}

void Balance::observe_bias(const Params& params, const RobotModel& robot, const Body& body,
                           const JointFeedback& feedback, const Support& support, const Pendulum& pendulum,
                           double tick_s) noexcept {
  if (++bias_tick_ < params.bias_ticks) return;
  bias_tick_ = 0;
  const Mat2 odom_R_heading = heading_of(body.odom_T_base.R);
  Vec2 zmp_felt_m;
  if (!try_measure_zmp(params.zmp, robot, feedback, support.odom_T_sole, slope_, zmp_felt_m)) {
    bias_.missed(odom_R_heading);
    return;
  }
  bias_.update(params.bias, pendulum.odom_p_com_m.head<2>() + pendulum.odom_v_com_mps.head<2>() / pendulum.omega_radps,
               zmp_felt_m - pendulum.beside_m, odom_R_heading, pendulum.omega_radps, params.bias_ticks * tick_s);
}

JointVector Balance::leg_torques(const MassModel& masses, const BodyFrames& frames, const PerLink& links_mps2,
                                 const Mat3& odom_R_base, const Support& support, const Pressure& pressure,
                                 const Vec3& force_n) noexcept {
  JointVector torque_nm;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const SoleWrench ground = sole_wrench(pressure, support, leg, force_n, odom_R_base);
    std::array<Vec3, kJointsPerLeg> specific_mps2;
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
      specific_mps2[j] = odom_R_base.transpose() * (Vec3{0, 0, -kGravity_mps2} - links_mps2.leg[index_of(leg)][j]);
    }
    torque_nm.segment<static_cast<int>(kJointsPerLeg)>(static_cast<Eigen::Index>(joint_index(leg, 0))) =
        leg_torques_nm(masses, leg, frames[index_of(leg)], specific_mps2, ground);
  }
  return torque_nm;
}

JointVector Balance::torques_nm(const Params& params, const RobotModel& robot, const Reference& reference,
                                const Body& body, const JointFeedback& feedback, double tick_s) noexcept {
  const BodyFrames frames = body_frames(robot.legs, body.q_rad);
  Support support;
  support.stands = reference.stands;
  support.on_toe = reference.on_toe;
  support.toe_x_m = robot.sole.contact.toe_x_m;
  Vec3 odom_p_plan_m = Vec3::Zero();
  double ground_m = 0.0;
  const std::array<double, kFootCount> holds = held_by(params.pressed_n, reference.stands, feedback.foot_force_n);
  for (std::size_t f = 0; f < kFootCount; ++f) {
    support.odom_T_sole[f] = body.odom_T_base * frames[f].sole;
    odom_p_plan_m += holds[f] * (support.odom_T_sole[f].p_m - reference.plan_T_sole[f].p_m);
    ground_m += share_[f] * support.odom_p_carrier_m(f).z();
  }
  const PerLink& links_mps2 = reference.links.plan_mps2;
  Pendulum pendulum = pendulum_of(robot.masses, frames, body, feedback.dq_radps, links_mps2, ground_m);
  observe_bias(params, robot, body, feedback, support, pendulum, tick_s);
  Vec3& odom_p_com_m = pendulum.odom_p_com_m;
  odom_p_com_m.head<2>() -= bias_.odom_bias_m();

  HorizontalMotion planned = reference.com;
  planned.position_m += odom_p_plan_m.head<2>();
  odom_p_com_planned_m_ = planned.position_m;
  com_error_m_ = planned.position_m - odom_p_com_m.head<2>();
  DcmStabiliser::Params dcm = params.dcm;
  if (reference.soft_ground) dcm.gain = std::min(dcm.gain, params.soft_ground_gain);
  const Vec2 zmp_m = stabiliser_.zmp_m(dcm, planned, odom_p_com_m.head<2>(), pendulum.odom_v_com_mps.head<2>(),
                                       pendulum.omega_radps, tick_s);
  const Vec2 slope = (odom_p_com_m.head<2>() - zmp_m) / pendulum.height_m;
  const Vec2& beside_m = pendulum.beside_m;
  const Pressure pressure =
      distribute(support, params.pressure,
                 {odom_p_com_m.x() + beside_m.x(), odom_p_com_m.y() + beside_m.y(), odom_p_com_m.z()}, slope);
  share_ = pressure.share;

  // The force that the clamped centres of pressure can give.
  slope_ = (odom_p_com_m.head<2>() + beside_m - pressure.zmp_m.head<2>()) / pendulum.height_m;
  const double up_n = pendulum.vertical_n;
  const Vec3 force_n{up_n * slope_.x(), up_n * slope_.y(), up_n};
  return leg_torques(robot.masses, frames, links_mps2, body.odom_T_base.R, support, pressure, force_n) +
         robot.drives.armature_kgm2 * reference.links.joint_radps2;
}

}  // namespace polygmap
