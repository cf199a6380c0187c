// SPDX-License-Identifier: Apache-2.0
#include "tests/support/ideal_climb.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/fake_robot.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::test {
namespace {

constexpr int kFrame_ticks = 16;
constexpr double kForceSigma_n = 6.0;

double lowest_corner_m(const Transform& sole) {
  double z = 1e9;
  for (const Vec3& corner : sole_contacts_m()) z = std::min(z, (sole * corner).z());
  return z;
}

}  // namespace

double Staircase::height_m(double x_m) const {
  if (x_m < 0.0) return 0.0;
  const int step = std::min(static_cast<int>(x_m / tread_m), steps - 1);
  return x_m > riser_x_m(steps - 1) + landing_m ? 0.0 : top_m(step);
}

IdealClimb::IdealClimb(const ClimbSetup& setup, const Gait::Params& params, const RobotModel& robot) : setup_(setup) {
  q_ = sent_ = active_ = standing_joints();
  true_T_base_ = {rotation_z(setup.yaw_rad), Vec3{-setup.distance_m, setup.lateral_m, kNominalBaseHeight_m}};
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    feet_[index_of(leg)].true_T_sole = true_T_base_ * base_T_sole({}, leg, leg_joints(q_, leg));
  }
  odom_T_true_ = {rotation_z(setup.odom_yaw_rad - setup.yaw_rad), Vec3{0.3, -0.2, 0.01}};
  // Its forces know no pendulum: drives that tell no torque.
  feedback_.tau_nm.setConstant(std::numeric_limits<double>::quiet_NaN());
  gait_.reset(params, robot);
}

double IdealClimb::noise() {  // about normal, sigma 1
  double sum = 0.0;
  for (int i = 0; i < 12; ++i) {
    random_ ^= random_ << 13;
    random_ ^= random_ >> 7;
    random_ ^= random_ << 17;
    sum += static_cast<double>(random_ >> 11) * 0x1.0p-53;
  }
  return sum - 6.0;
}

void IdealClimb::sense() {
  const std::int64_t now_ns = setup_.clock_ns + record_.ticks * 2 * kNsPerMs;
  state_.stamp_ns = state_.oldest_input_ns = now_ns;
  state_.initialised = record_.ticks > 250;
  const Mat3 tilt = rotation_y(setup_.estimate_tilt_rad) * rotation_x(setup_.estimate_tilt_rad);
  state_.odom_T_base = odom_T_true_ * true_T_base_;
  state_.odom_T_base.R = state_.odom_T_base.R * tilt;
  for (int i = 0; i < 3; ++i) state_.odom_T_base.p_m[i] += setup_.estimate_noise_m * noise();
  state_.odom_v_base_mps = odom_T_true_.R * true_v_base_mps_;
  const double drift_m = setup_.world_drift_mps * seconds(now_ns - setup_.clock_ns);
  state_.world_T_odom = {rotation_z(0.4), Vec3{1.0 + drift_m, 2.0 - drift_m, 0.05}};
  state_.q_rad = q_;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    state_.odom_T_sole[index_of(leg)] = state_.odom_T_base * base_T_sole({}, leg, leg_joints(q_, leg));
  }
  feedback_.stamp_ns = now_ns;
  feedback_.q_rad = q_;
  for (std::size_t i = force_history_.size() - 1; i > 0; --i) force_history_[i] = force_history_[i - 1];
  for (std::size_t f = 0; f < kFootCount; ++f) {
    constexpr double kPressed_n = 150.0;  // what touches is anchored, as if it carried
    force_history_[0][f] = !feet_[f].anchored ? 0.0 : (f == support_ ? kWeight_n : kPressed_n);
  }
  feedback_.foot_force_n = force_history_.back();
  state_.foot_force_sigma_n.fill(kForceSigma_n);
}

FootholdSet IdealClimb::search() const {
  const Staircase& stairs = setup_.stairs;
  FootholdSet set;
  set.map_stamp_ns = state_.stamp_ns - 40 * kNsPerMs;
  double stance_m = -1e9, lateral_m = 0.0;
  for (std::size_t f = 0; f < kFootCount; ++f) {
    lateral_m += 0.5 * feet_[f].true_T_sole.p_m.y();
    if (gait_.status().stands[f]) stance_m = std::max(stance_m, feet_[f].true_T_sole.p_m.z());
  }
  set.obstruction = StopReason::kNone;
  if (stairs.rise_m > 0.19) {
    set.obstruction = StopReason::kRiseTooHigh;
    set.measured_rise_m = stairs.rise_m;
    return set;
  }
  if (stairs.tread_m < 0.26) {
    set.obstruction = StopReason::kTreadTooShort;
    set.measured_tread_m = stairs.tread_m;
    return set;
  }
  int next = 0;
  while (next < stairs.steps && stairs.top_m(next) < stance_m + 0.04) ++next;
  if (next == stairs.steps) {
    set.obstruction = StopReason::kTop;
    return set;
  }
  const double side_m = stairs.half_width_m - kStanceHalfWidth_m - 0.07;
  const double middle_m = math::clamp(lateral_m, -side_m, side_m);
  const double x_m = stairs.riser_x_m(next) + setup_.map_shift_x_m;
  const double z_m = stairs.top_m(next) + setup_.map_shift_z_m;
  const auto place = [&](int step, std::array<Foothold, kFootCount>& feet) {
    const double depth_m = step == stairs.steps - 1 ? stairs.landing_m : stairs.tread_m;
    const double inset_m = std::min(0.5 * (depth_m - 0.252), 0.014);
    for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
      Foothold& hold = feet[index_of(foot)];
      hold.position_m =
          odom_T_true_ * Vec3{stairs.riser_x_m(step) + setup_.map_shift_x_m + inset_m - kContactRectangle.heel_x_m,
                              middle_m + side_sign(foot) * kStanceHalfWidth_m,
                              stairs.top_m(step) + setup_.map_shift_z_m};
      hold.yaw_rad = yaw_of(odom_T_true_.R);
      hold.polygon_id = static_cast<std::uint32_t>(step) + 10;
      hold.last_seen_ns = set.map_stamp_ns;
    }
  };
  set.has_p_star = true;
  place(next, set.p_star_feet);
  set.p_star = set.p_star_feet[0];
  set.has_p_star_star = next + 1 < stairs.steps;
  if (set.has_p_star_star) place(next + 1, set.p_star_star_feet);
  set.tread.nosing_a_m = odom_T_true_ * Vec3{x_m, stairs.half_width_m, z_m};
  set.tread.nosing_b_m = odom_T_true_ * Vec3{x_m, -stairs.half_width_m, z_m};
  set.measured_rise_m = z_m - stance_m;
  return set;
}

void IdealClimb::move() {
  const double gain = 1.0 - std::exp(-0.2);  // 2 ms of a 10 ms lag
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const auto i = static_cast<Eigen::Index>(n);
    const double reach = joint_limits(static_cast<Foot>(n / 6), n % 6).speed_radps * 0.002;
    q_[i] += math::clamp(gain * (active_[i] - q_[i]), -reach, reach);
  }
  for (std::size_t n = 0; n < kJointCount; ++n) {  // drives that know the rate do not lag on a ramp
    const auto i = static_cast<Eigen::Index>(n);
    active_[i] = sent_[i] + 0.010 * command_.joints[n].dq_radps;
  }
  std::array<Transform, kFootCount> base_T_foot;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    base_T_foot[index_of(leg)] = base_T_sole({}, leg, leg_joints(q_ - setup_.encoder_offset_rad, leg));
  }
  const Vec3 before_m = true_T_base_.p_m;
  true_T_base_ = feet_[support_].true_T_sole * base_T_foot[support_].inverse();
  true_v_base_mps_ = (true_T_base_.p_m - before_m) / kTick_s;
  const std::size_t free = 1 - support_;
  FootState& foot = feet_[free];
  const Transform hanging = true_T_base_ * base_T_foot[free];
  if (foot.anchored) {
    if (hanging.p_m.z() > foot.true_T_sole.p_m.z() + 0.002) foot.anchored = false;
  } else {
    const bool falling = hanging.p_m.z() < foot.true_T_sole.p_m.z();
    double surface_m = -1e9;
    for (const Vec3& corner : sole_contacts_m()) {
      surface_m = std::max(surface_m, setup_.stairs.height_m((hanging * corner).x()));
    }
    if (falling && lowest_corner_m(hanging) <= surface_m) foot.anchored = true;
  }
  if (!foot.anchored) foot.true_T_sole = hanging;
  // The nearer foot carries, flat on the ground; a small disagreement of the legs becomes a slip of that foot and a
  // tilt of the base.
  if (foot.anchored) {
    const Vec2 base = true_T_base_.p_m.head<2>();
    if ((base - hanging.p_m.head<2>()).norm() + 0.01 < (base - feet_[support_].true_T_sole.p_m.head<2>()).norm()) {
      foot.true_T_sole = {rotation_z(yaw_of(hanging.R)), hanging.p_m};
      support_ = free;
    }
  }
}

// Mass points on a straight line through the centre of mass; accelerations over 40 ms, since commands follow in steps.
void IdealClimb::measure_zmp() {
  if (gait_.status().phase != GaitPhase::kSwing) return com_m_.clear();
  com_m_.push_back(true_T_base_ * centre_of_mass_m({}, base_p_links_m({}, body_frames({}, q_))));
  constexpr std::size_t kHalf = 10;
  if (com_m_.size() <= 2 * kHalf) return;
  const Vec3 &now = com_m_.back(), &middle = *(com_m_.end() - kHalf - 1), &then = *(com_m_.end() - 2 * kHalf - 1);
  const Vec3 mps2 = (now - 2.0 * middle + then) / (kHalf * kTick_s * kHalf * kTick_s);
  const Transform& stance = feet_[index_of(other(gait_.status().step.foot))].true_T_sole;
  const double height_m = middle.z() - stance.p_m.z();
  const Vec3 zmp_m{middle.x() - height_m / (kGravity_mps2 + mps2.z()) * mps2.x(),
                   middle.y() - height_m / (kGravity_mps2 + mps2.z()) * mps2.y(), stance.p_m.z()};
  const Vec3 local_m = stance.inverse() * zmp_m;
  const SoleRectangle& sole = kContactRectangle;
  record_.zmp_margin_m = std::min({record_.zmp_margin_m, local_m.x() - sole.heel_x_m, sole.toe_x_m - local_m.x(),
                                   sole.half_width_m - std::abs(local_m.y())});
}

void IdealClimb::measure(const GaitStatus& before) {
  ClimbRecord& r = record_;
  const GaitStatus& now = gait_.status();
  for (std::size_t n = 0; n < kJointCount; ++n) {
    const auto i = static_cast<Eigen::Index>(n);
    const JointLimits& limits = joint_limits(static_cast<Foot>(n / 6), n % 6);
    const double q = command_.joints[n].q_rad, step = std::abs(q - sent_[i]);
    r.speed_share[n] = std::max(r.speed_share[n], step / (limits.speed_radps * 0.002));
    r.jump_rad = std::max(r.jump_rad, step);
    r.joint_margin_rad = std::min({r.joint_margin_rad, q - limits.min_rad, limits.max_rad - q});
    if (n % 6 == kKnee) r.knee_min_rad = std::min(r.knee_min_rad, q);
  }
  measure_zmp();
  const Staircase& stairs = setup_.stairs;
  if (now.phase == GaitPhase::kSwing) {
    const std::size_t f = index_of(now.step.foot), s = 1 - f;
    if (before.phase != GaitPhase::kSwing && now.step.onto_tread && r.first_lift_off_ns == 0) {
      r.first_lift_off_ns = now.stamp_ns;
    }
    const Transform& sole = feet_[f].true_T_sole;
    constexpr int kPoints = 24;
    for (int i = 0; i <= kPoints; ++i) {
      for (const double z : {0.0, 0.5 * kCollisionHeight_m, kCollisionHeight_m}) {
        const double x = kCollisionRectangle.heel_x_m + i * kCollisionRectangle.length_m() / kPoints;
        const Vec3 p = sole * Vec3{x, 0.0, z};
        const int under = std::min(static_cast<int>(std::floor(p.x() / stairs.tread_m)), stairs.steps - 1);
        for (int k = std::max(under - 1, 0); k <= under; ++k) {
          r.penetration_m = std::max(r.penetration_m, std::min(stairs.top_m(k) - p.z(), p.x() - stairs.riser_x_m(k)));
        }
      }
    }
    const Vec3 toe = sole * Vec3{kCollisionRectangle.toe_x_m, 0, 0};
    for (int k = 0; k < stairs.steps; ++k) {
      const bool ahead =
          now.step.onto_tread && std::abs(toe.x() - stairs.riser_x_m(k)) < 0.004 && toe.z() > stairs.top_m(k) - 0.02;
      if (ahead) r.crossing_m = std::min(r.crossing_m, toe.z() - stairs.top_m(k));
    }
    const Vec3 desired = (now.odom_T_sole_desired[s].inverse() * now.odom_T_sole_desired[f]).p_m;
    const Vec3 actual = (feet_[s].true_T_sole.inverse() * sole).p_m;
    r.swing_tracking_m = std::max(r.swing_tracking_m, (desired - actual).norm());
  }
  for (std::size_t f = 0; f < kFootCount; ++f) {
    const double toe_x = (feet_[f].true_T_sole * Vec3{kCollisionRectangle.toe_x_m, 0, 0}).x();
    if (feet_[f].true_T_sole.p_m.z() < 0.02 && feet_[f].anchored) r.toe_gap_m = std::min(r.toe_gap_m, -toe_x);
  }
  if (now.step.touch_down_stamp_ns != 0 && before.step.touch_down_stamp_ns != now.step.touch_down_stamp_ns) {
    r.steps.push_back(now.step);
    r.last_touch_down_ns = now.stamp_ns;
    const Vec3 missed_m = now.step.odom_T_executed.p_m - now.step.odom_T_target.p_m;
    r.execution_m = std::max(r.execution_m, missed_m.head<2>().norm());
    r.execution_z_m = std::max(r.execution_z_m, std::abs(missed_m.z()));
    r.landed_tilt_rad = std::max(r.landed_tilt_rad, std::acos(std::min(true_T_base_.R(2, 2), 1.0)));
    if (now.step.onto_tread) {
      const double x = feet_[index_of(now.step.foot)].true_T_sole.p_m.x();
      const int k = std::min(static_cast<int>(x / stairs.tread_m), stairs.steps - 1);
      r.sole_margin_m.push_back(x + kContactRectangle.heel_x_m - stairs.riser_x_m(k));
      if (k + 1 < stairs.steps) {
        r.sole_margin_m.push_back(stairs.riser_x_m(k + 1) - x - kCollisionRectangle.toe_x_m);
      }
    }
  }
  if (r.ticks > 1500) r.true_tilt_rad = std::max(r.true_tilt_rad, std::acos(std::min(true_T_base_.R(2, 2), 1.0)));
  for (std::size_t n = 0; n < kJointCount; ++n) sent_[static_cast<Eigen::Index>(n)] = command_.joints[n].q_rad;
}

bool IdealClimb::tick() {
  sense();
  if (record_.ticks % kFrame_ticks == 0) {
    footholds_ = search();
    for (Foothold& hold : footholds_.p_star_feet) {
      for (int i = 0; i < 3; ++i) hold.position_m[i] += setup_.foothold_noise_m * noise();
    }
  }
  StateEstimate state = state_;
  FootholdSet footholds = footholds_;
  JointFeedback feedback = feedback_;
  if (tamper) tamper(state, footholds, feedback);
  const GaitStatus before = gait_.status();
  gait_.tick(state_.stamp_ns, state, footholds, feedback, command_);
  measure(before);
  move();
  ++record_.ticks;
  record_.end_ns = state_.stamp_ns;
  const GaitPhase phase = gait_.status().phase;
  return phase != GaitPhase::kFinished && phase != GaitPhase::kStopped;
}

bool IdealClimb::run_until(GaitPhase phase, std::uint32_t swing, double limit_s) {
  const int last = record_.ticks + static_cast<int>(limit_s * 500.0);
  while (record_.ticks < last) {
    tick();
    if (gait_.status().phase == phase && gait_.status().step.sequence == swing) return true;
  }
  return false;
}

void IdealClimb::run(double limit_s) {
  const int last = record_.ticks + static_cast<int>(limit_s * 500.0);
  while (record_.ticks < last && tick()) {
  }
}

}  // namespace polygmap::test
