// SPDX-License-Identifier: Apache-2.0
#include "algorithms/gait/states/body_plan.hpp"

#include <algorithm>
#include <utility>

#include "algorithms/core/time.hpp"
#include "algorithms/gait/states/state.hpp"
#include "algorithms/robot/leg_dynamics.hpp"

namespace polygmap {

// What else there is, is set before it is read: a fresh object to copy from would take kilobytes of stack.
void BodyPlan::reset() noexcept {
  correction_ = {};
  base_com_bias_m_.setZero();
  landed_ = {};
  held_ = false;
  com_shift_m_.setZero();
  heel_up_rad_ = {};
}

void BodyPlan::place(const JointReference& joints, const Transform& plan_T_base) noexcept {
  plan_T_base_ = plan_T_base;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    plan_T_sole_[index_of(leg)] = plan_T_base_ * joints.base_T_sole_reference(leg);
  }
  torso_state_ = TorsoTrajectory::placed({}, plan_T_base_, (plan_T_base_ * reference_p_com_m_).head<2>());
}

void BodyPlan::start(const JointReference& joints, const Transform& plan_T_base) noexcept {
  place(joints, plan_T_base);
  posture_.reset(joints.reference_rad(), reference_p_com_m_);
}

// The horizontal part of the torso's trajectory is the centre of mass's: the base follows from the legs' places, one
// tick old.
void BodyPlan::advance() noexcept {
  HorizontalMotion com = com_.at(com_tick_);
  if (std::exchange(held_, false)) {
    posture_.restart();
    com_shift_m_ = (plan_T_base_ * reference_p_com_m_).head<2>() - com_.at(com_tick_ - 1).position_m;
  }
  com.position_m += com_shift_m_;
  torso_state_ = torso_.at(torso_tick_, com);
  plan_T_base_ = TorsoTrajectory::pose(torso_state_);
  plan_T_base_.p_m.head<2>() -= (plan_T_base_.R * reference_p_com_m_).head<2>();
}

// The base stays, so that the standing legs do; the centre of mass moves with the leg in the air.
void BodyPlan::hold(const HeldBodyParams& params, bool on_both_feet, bool may_lean) noexcept {
  if (!std::exchange(held_, true)) {
    posture_.restart();
    leant_m_ = on_both_feet ? params.lean_m : 0.0;
    lowered_m_ = 0.0;
  }
  for (Motion& axis : torso_state_) axis = {.position = axis.position};
  const Vec2 way_m = 0.5 * (plan_T_sole_[0].p_m + plan_T_sole_[1].p_m).head<2>() - com().position_m;
  const double step_m = std::min(params.lean_mps * kTick_s, params.lean_m - leant_m_);
  if (on_both_feet && may_lean && step_m > 0.0 && way_m.norm() > step_m) {
    plan_T_base_.p_m.head<2>() += step_m * way_m.normalized();
    leant_m_ += step_m;
  }
  torso_state_ = TorsoTrajectory::placed(torso_state_, plan_T_base_, (plan_T_base_ * reference_p_com_m_).head<2>());
}

bool BodyPlan::try_lower(const HeldBodyParams& params) noexcept {
  if (lowered_m_ >= params.lower_m) return false;
  plan_T_base_.p_m.z() -= params.lower_mps * kTick_s;
  lowered_m_ += params.lower_mps * kTick_s;
  return true;
}

void BodyPlan::correct(const StateEstimate& state, double correction_time_s) noexcept {
  correction_.update(state.odom_T_base, state.odom_v_base_mps, state.odom_T_base.R * state.base_w_base_radps,
                     plan_T_base_, correction_time_s);
}

void BodyPlan::shift_bias(const Vec2& odom_shift_m) noexcept {
  base_com_bias_m_ += plan_T_base_.R.transpose() * Vec3{odom_shift_m.x(), odom_shift_m.y(), 0.0};
}

void BodyPlan::observe_reference(const RobotModel& robot, const JointVector& reference_rad, const Vec2& odom_com_bias_m,
                                 double bias_time_s) noexcept {
  // Evened out: neither the observer's steps nor those of the plan, when it is carried, may accelerate the links.
  const BodyFrames frames = body_frames(robot.legs, reference_rad);
  const Vec3 base_bias_m = plan_T_base_.R.transpose() * Vec3{odom_com_bias_m.x(), odom_com_bias_m.y(), 0.0};
  base_com_bias_m_ += kTick_s / bias_time_s * (base_bias_m - base_com_bias_m_);
  reference_p_com_m_ = centre_of_mass_m(robot.masses, base_p_links_m(robot.masses, frames)) - base_com_bias_m_;
}

LinkMotion::Acceleration BodyPlan::observe_links(const RobotModel& robot,
                                                 std::array<Transform, kFootCount> plan_T_sole) noexcept {
  if (landed_.held()) plan_T_sole[index_of(landed_.foot())] = landed_.plan_T_sole();
  const Vec2 plan_p_com_m = com().position_m + (plan_T_base_.R * base_com_bias_m_).head<2>();
  return posture_.update(robot, plan_T_base_, plan_p_com_m, plan_T_sole);
}

void BodyPlan::count_tick() noexcept {
  com_tick_ = next_tick(com_tick_);
  torso_tick_ = next_tick(torso_tick_);
}

PlannedBody BodyPlan::ahead(std::int32_t ticks) const noexcept {
  TorsoTrajectory::State torso = torso_state_;
  const std::int32_t com_tick = std::max(com_tick_ - 1 + ticks, 0);
  Vec2 zmp_m = com().position_m;
  if (!held_) {
    HorizontalMotion com = com_.at(com_tick);
    com.position_m += com_shift_m_;
    zmp_m = com_.zmp_m(com_tick) + com_shift_m_;
    torso = torso_.at(std::max(torso_tick_ - 1 + ticks, 0), com);
  }
  Transform plan_T_base = TorsoTrajectory::pose(torso);
  plan_T_base.p_m.head<2>() -= (plan_T_base.R * reference_p_com_m_).head<2>();
  const Transform to_odom = odom_T_plan(), odom_T_base = to_odom * plan_T_base;
  PlannedBody body;
  body.p_com_m = odom_T_base * reference_p_com_m_;
  body.v_com_mps = to_odom.R * Vec3{torso[0].speed, torso[1].speed, torso[2].speed};
  body.zmp_m = (to_odom * Vec3{zmp_m.x(), zmp_m.y(), 0.0}).head<2>();
  body.p_base_m = odom_T_base.p_m;
  body.base_yaw_rad = yaw_of(odom_T_base.R);
  return body;
}

void BodyPlan::carry_to_odometry() noexcept {
  const Transform to_odom = odom_T_plan();
  for (Transform& sole : plan_T_sole_) sole = to_odom * sole;
  plan_T_base_ = to_odom * plan_T_base_;
  torso_state_ = TorsoTrajectory::placed(torso_state_, plan_T_base_, (plan_T_base_ * reference_p_com_m_).head<2>());
  landed_.carry(to_odom);
  posture_.carry(to_odom);
  correction_.reset();
}

void BodyPlan::move_torso(const TorsoPose& goal, std::int32_t ticks, std::int32_t height_ticks) noexcept {
  torso_.plan(torso_state_, goal, ticks, height_ticks);
  torso_tick_ = 0;
}

ComPlan& BodyPlan::renewed_com() noexcept {
  com_tick_ = 0;
  com_shift_m_.setZero();
  return com_;
}

void BodyPlan::rest_over(const ComPlan::Params& params, const Vec2& plan_p_m) noexcept {
  ZmpKnots knots;
  (void)knots.try_push_back({params.zmp_offset_ticks, plan_p_m});
  renewed_com().plan(params, com(), knots);
}

void BodyPlan::land(Foot foot, bool felt, double early_m, std::int64_t now_ns) noexcept {
  landed_.land(foot, felt, early_m, now_ns, odom_T_plan() * plan_T_sole(foot), plan_T_sole(foot));
  posture_.restart();  // the swing foot is where it was steered to, and stops
}

void BodyPlan::hold_landed_foot(const LandedFootParams& params, const JointFeedback& feedback,
                                std::int64_t now_ns) noexcept {
  if (!landed_.held()) return;
  landed_.update(params, feedback, now_ns);
  if (landed_.held()) {
    set_sole(landed_.foot(), plan_T_odom() * landed_.odom_T_sole());
  } else {
    posture_.restart();  // from where it was planned to where it was held
  }
}

void BodyPlan::hold_lifted_foot(const LandedFootParams& params, const StateEstimate& state,
                                const JointFeedback& feedback, std::int64_t now_ns) noexcept {
  if (landed_.held()) return;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    if (!(feedback.foot_force_n[index_of(leg)] < params.lifted_n)) continue;
    Transform odom_T_sole = odom_T_plan() * plan_T_sole(leg);
    odom_T_sole.p_m.head<2>() = state.odom_T_sole[index_of(leg)].p_m.head<2>();
    set_sole(leg, plan_T_odom() * odom_T_sole);
    return land(leg, true, 0.0, now_ns);
  }
}

void BodyPlan::release_landed_foot() noexcept {
  if (landed_.held()) posture_.restart();
  landed_.release();
}

void BodyPlan::raise_heel(const SoleModel& sole, Foot foot, double heel_up_rad) noexcept {
  double& now_rad = heel_up_rad_[index_of(foot)];
  Transform& plan_T_sole = plan_T_sole_[index_of(foot)];
  plan_T_sole = plan_T_sole * turned_about_toe(sole, heel_up_rad - now_rad);
  now_rad = heel_up_rad;
}

void BodyPlan::lower_heels(const SoleModel& sole, double by_rad) noexcept {
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    if (is_on_toe(foot)) raise_heel(sole, foot, std::max(heel_up_rad_[index_of(foot)] - by_rad, 0.0));
  }
}

void BodyPlan::settle_feet_apart(const FeetApartParams& params, const StateEstimate& state,
                                 const JointFeedback& feedback) noexcept {
  const std::array<double, kFootCount>& force_n = feedback.foot_force_n;
  if (landed_.held() || is_on_toe(Foot::kLeft) || is_on_toe(Foot::kRight)) return;
  if (!(force_n[0] > params.pressed_n && force_n[1] > params.pressed_n)) return;
  const Mat3 plan_R_odom = odom_T_plan().R.transpose();
  const Vec3 seen_m = plan_R_odom * (state.odom_T_sole[0].p_m - state.odom_T_sole[1].p_m);
  const Vec2 off_m = (seen_m - (plan_T_sole_[0].p_m - plan_T_sole_[1].p_m)).head<2>();
  const double beyond_m = off_m.norm() - params.least_m;
  if (!(beyond_m > 0.0)) return;
  const double by_m = std::min(params.most_mps, beyond_m / params.time_s) * kTick_s;
  const Vec2 half_m = 0.5 * by_m * off_m.normalized();
  plan_T_sole_[0].p_m.head<2>() += half_m;
  plan_T_sole_[1].p_m.head<2>() -= half_m;
}

}  // namespace polygmap
