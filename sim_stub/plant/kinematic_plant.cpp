// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/plant/kinematic_plant.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "sim_stub/nominal_robot.hpp"

namespace polygmap::sim {
namespace {

constexpr int kDriveSubsteps = 4;
constexpr double kGapMemory_s = 1.0;  // how slowly the usual gap of a loaded foot is learnt

const MassModel kMasses;

const char* name_of(std::size_t foot) { return foot == 0 ? "left" : "right"; }
double mm(double metres) { return 1e3 * metres; }

Vec3 rotation_vector(const Mat3& R) {
  const Eigen::AngleAxisd turn(R);
  return turn.angle() * turn.axis();
}
Mat3 rotation(const Vec3& vector_rad) {
  const double angle = vector_rad.norm();
  return angle < 1e-15 ? Mat3::Identity() : Eigen::AngleAxisd(angle, vector_rad / angle).toRotationMatrix();
}

// One exact step of a critically damped second-order lag towards target.
template <typename T>
void critically_damped(T& x, T& rate, const T& target, double w, double dt) {
  const T off = x - target;
  const T slope = rate + w * off;
  const double decay = std::exp(-w * dt);
  x = target + (off + slope * dt) * decay;
  rate = (rate - w * slope * dt) * decay;
}

// Flat on the floor or a tread: x, y and heading stay.
Transform flattened(const Transform& pose, const Step* tread = nullptr) {
  const double x_m = pose.p_m.x(), y_m = pose.p_m.y(), yaw_rad = yaw_of(pose.R);
  if (tread == nullptr) return {rotation_z(yaw_rad), Vec3{x_m, y_m, 0.0}};
  const Mat3& R = tread->true_T_step.R;
  return {R * rotation_z(yaw_rad - yaw_of(R)), Vec3{x_m, y_m, tread->top_m(x_m, y_m)}};
}

double smooth_step(double x) {
  const double s = math::clamp(x, 0.0, 1.0);
  return s * s * (3.0 - 2.0 * s);
}

}  // namespace

KinematicPlant::KinematicPlant(const Params& params, const StairWorld& world, const RobotErrors& errors,
                               const Transform& true_T_start, const JointVector& q_rad)
    : params_(params), world_(world), errors_(errors), solids_(solids_of(world)), q_(q_rad), led_q_(q_rad) {
  update_leg_kinematics();
  for (FootState& foot : feet_) {
    foot.true_T_sole = flattened(true_T_start * foot.base_T_sole);
    foot.true_T_base = foot.true_T_sole * foot.base_T_sole.inverse();
  }
  true_T_base_ = blend();
  transfer_load();
  share_rate_ = 0.0;
  move_base();
  give_way(1.0);
  q_ = led_q_ + given_;
  for (std::size_t f = 0; f < kFootCount; ++f) {
    feet_[f].gap_m = gap_m(f);
    feet_[f].base_offset.p_rate.setZero();
    feet_[f].base_offset.turn_rate.setZero();
  }
  base_before_m_ = true_T_base_.p_m;
  load_drives();
}

double KinematicPlant::foot_force_n(std::size_t foot) const noexcept {
  constexpr double kTouch_n = 60.0;  // of a sole that touches: drives that gave way by 3 mm would press as hard
  return feet_[foot].anchored ? std::max(kTouch_n, load_share(foot) * kRobotWeight_n) : 0.0;
}

// What the feet's forces, the links and the rotors ask of the drives. Where in its sole a foot presses is what the
// body's place and acceleration leave over beyond the shares, within the sole.
void KinematicPlant::load_drives() {
  constexpr double kMost_mps2 = 50.0;  // a sole that meets the ground stops within a tick
  const SoleRectangle& sole = errors_.sole.contact;
  const BodyFrames body = true_frames();
  const PerLink base_p_m = base_p_links_m(kMasses, body);
  const Vec3 between_m = load_share(0) * feet_[0].true_T_sole.p_m + load_share(1) * feet_[1].true_T_sole.p_m;
  const Vec3 rest_m = pressed_m() - between_m;
  for (std::size_t f = 0; f < kFootCount; ++f) {
    const auto leg = static_cast<Foot>(f);
    const LegFrames& frames = body[f];
    const Vec3 base_f = true_T_base_.R.transpose() * Vec3{0, 0, foot_force_n(f)};
    const Vec3 local_m = feet_[f].true_T_sole.R.transpose() * rest_m;
    const Vec3 base_r = frames.sole.R * Vec3{math::clamp(local_m.x(), sole.heel_x_m, sole.toe_x_m),
                                             math::clamp(local_m.y(), -sole.half_width_m, sole.half_width_m), 0.0};
    std::array<Vec3, kJointsPerLeg> specific_mps2;
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
      LinkState& link = feet_[f].links[j];
      const Vec3 p_m = true_T_base_ * base_p_m.leg[f][j];
      const Vec3 v_mps = link.seen ? Vec3((p_m - link.p_m) / kPlantTick_s) : Vec3(Vec3::Zero());
      const Vec3 a_mps2 = ((v_mps - link.v_mps) / kPlantTick_s).cwiseMax(-kMost_mps2).cwiseMin(kMost_mps2);
      specific_mps2[j] = true_T_base_.R.transpose() * Vec3(Vec3{0, 0, -kGravity_mps2} - a_mps2);
      link = {p_m, v_mps, true};
    }
    tau_.segment<static_cast<int>(kJointsPerLeg)>(static_cast<Eigen::Index>(joint_index(leg, 0))) =
        leg_torques_nm(kMasses, leg, frames, specific_mps2, {base_f, base_r.cross(base_f)});
  }
  tau_ += nominal_robot().drives.armature_kgm2 / kPlantTick_s * (dq_ - dq_before_radps_);
  dq_before_radps_ = dq_;
}

void KinematicPlant::step(const JointCommand& command) {
  JointVector command_rad, rate_radps;
  for (std::size_t j = 0; j < kJointCount; ++j) {
    command_rad[static_cast<Eigen::Index>(j)] = command.joints[j].q_rad;
    rate_radps[static_cast<Eigen::Index>(j)] = command.joints[j].dq_radps;
  }
  if (fell()) {
    dq_.setZero();
    return;
  }
  if (!accept_command(command_rad, rate_radps)) return;
  move_joints(command_rad, rate_radps);
  update_leg_kinematics();
  transfer_load();
  lift_feet();
  move_base();
  give_way(1.0 - std::exp(-kPlantTick_s / params_.drive_lag_s));
  move_swing_feet();
  load_drives();
  check_falls();
}

bool KinematicPlant::accept_command(const JointVector& command_rad, const JointVector& rate_radps) {
  for (std::size_t j = 0; j < kJointCount; ++j) {
    const double q = command_rad[static_cast<Eigen::Index>(j)];
    const std::size_t foot = j / kJointsPerLeg, joint = j % kJointsPerLeg;
    const JointLimits& limits = nominal_robot().drives.limits[j];
    const double rate = rate_radps[static_cast<Eigen::Index>(j)];
    if (!std::isfinite(rate)) {
      fall("The rate commanded to %s leg joint %zu is not finite (%g).", name_of(foot), joint, rate);
      return false;
    }
    if (!std::isfinite(q)) {
      fall("The command of %s leg joint %zu is not finite (%g).", name_of(foot), joint, q);
      return false;
    }
    const double beyond = std::max(limits.min_rad - q, q - limits.max_rad);
    if (beyond > params_.limit_tolerance_rad) {
      fall("The command of %s leg joint %zu is %.4f rad, %.4f rad outside its limits.", name_of(foot), joint, q,
           beyond);
      return false;
    }
  }
  return true;
}

void KinematicPlant::move_joints(const JointVector& command_rad, const JointVector& rate_radps) {
  const JointVector before = q_;
  const double dt = kPlantTick_s / kDriveSubsteps;
  const double gain = 1.0 - std::exp(-dt / params_.drive_lag_s);
  for (std::size_t j = 0; j < kJointCount; ++j) {
    const JointLimits& limits = nominal_robot().drives.limits[j];
    const auto i = static_cast<Eigen::Index>(j);
    const double reach = limits.speed_radps * dt;
    const double target_rad = command_rad[i] + params_.drive_lag_s * rate_radps[i];
    for (int k = 0; k < kDriveSubsteps; ++k) {
      led_q_[i] += math::clamp(gain * (target_rad - led_q_[i]), -reach, reach);
      led_q_[i] = math::clamp(led_q_[i], limits.min_rad, limits.max_rad);
    }
  }
  q_ = led_q_ + given_;
  dq_ = (q_ - before) / kPlantTick_s;
}

void KinematicPlant::update_leg_kinematics() {
  const JointVector q = led_q_ - errors_.encoder_offset_rad;
  for (std::size_t f = 0; f < kFootCount; ++f) {
    FootState& foot = feet_[f];
    foot.base_T_sole = base_T_sole(errors_.legs[f], static_cast<Foot>(f), leg_joints(q, static_cast<Foot>(f)));
    if (foot.anchored) foot.true_T_base = foot.true_T_sole * foot.base_T_sole.inverse();
  }
}

BodyFrames KinematicPlant::true_frames() const {
  BodyFrames frames;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    frames[index_of(leg)] = leg_frames(errors_.legs[index_of(leg)], leg, leg_joints(true_q_rad(), leg));
  }
  return frames;
}

Vec3 KinematicPlant::true_p_mass_m() const {
  return true_T_base_ * centre_of_mass_m(kMasses, base_p_links_m(kMasses, true_frames()));
}

// Where the weight, moving as the base does, presses on the ground.
Vec3 KinematicPlant::pressed_m() const {
  constexpr double kPendulum_radps = 3.5, kMost_mps2 = 2.0;
  return true_p_mass_m() - base_a_mps2_.cwiseMax(-kMost_mps2).cwiseMin(kMost_mps2) / math::square(kPendulum_radps);
}

void KinematicPlant::transfer_load() {
  FootState &left = feet_[0], &right = feet_[1];
  const bool both = left.anchored && right.anchored;
  // As the legs move it, whoever carries: the shares must not act on what they follow from.
  const Vec3 base_m = both ? Vec3(0.5 * (left.true_T_base.p_m + right.true_T_base.p_m))
                           : (left.anchored ? left : right).true_T_base.p_m;
  if (both != both_anchored_) base_before_m_ = base_m - kPlantTick_s * base_v_mps_;
  both_anchored_ = both;
  const Vec3 velocity_mps = (base_m - base_before_m_) / kPlantTick_s;
  base_before_m_ = base_m;
  constexpr double kSmooth_radps = 50.0;
  critically_damped(base_v_mps_, base_a_mps2_, velocity_mps, kSmooth_radps, kPlantTick_s);
  if (!left.anchored || !right.anchored) {
    closure_m_ = 0.0;
    return;
  }
  closure_m_ = (left.true_T_base.p_m - right.true_T_base.p_m).norm();

  // Where it presses between the soles: 0 at the right one, 1 at the left.
  const Vec2 between = (left.true_T_sole.p_m - right.true_T_sole.p_m).head<2>();
  const double along = (pressed_m() - right.true_T_sole.p_m).head<2>().dot(between) / between.squaredNorm();
  // A foot is unloaded before the base is all the way over the other one: the sole has a width.
  constexpr double kDeadEnd = 0.1;
  const double target = smooth_step((along - kDeadEnd) / (1.0 - 2.0 * kDeadEnd));
  critically_damped(share_, share_rate_, target, params_.share_bandwidth_radps, kPlantTick_s);
  if (share_ <= 0.0 || share_ >= 1.0) {
    share_ = math::clamp(share_, 0.0, 1.0);
    share_rate_ = 0.0;
  }

  for (std::size_t f = 0; f < kFootCount; ++f) {
    FootState& foot = feet_[f];
    const double gap = gap_m(f);
    if (load_share(f) >= params_.loaded_lift_share) {
      foot.gap_m += (gap - foot.gap_m) * kPlantTick_s / kGapMemory_s;
    } else {
      foot.gap_m = std::min(foot.gap_m, gap);
    }
    foot.raise_m = gap - std::max(foot.gap_m, 0.0);
  }
}

double KinematicPlant::gap_m(std::size_t f) const {
  return (feet_[1 - f].true_T_base * feet_[f].base_T_sole).p_m.z() - feet_[f].true_T_sole.p_m.z();
}

void KinematicPlant::lift_feet() {
  for (std::size_t f = 0; f < kFootCount; ++f) {
    FootState &foot = feet_[f], &other = feet_[1 - f];
    if (!foot.anchored || !other.anchored) continue;
    const double share = load_share(f);
    const bool off = foot.raise_m > params_.loaded_lift_height_m;
    if (off && share > params_.loaded_lift_share) {
      fall("Lifted a loaded foot: the %s one, raised %.1f mm with %.0f %% of the weight on it.", name_of(f),
           mm(foot.raise_m), 100.0 * share);
      return;
    }
    if (!off && (foot.raise_m <= params_.lift_height_m || share > params_.lift_share)) continue;
    slack_ = other.base_offset;  // the base goes on as it moves, relative to the leg that stays
    foot.anchored = false;
    foot.step = kFloorStep;
    foot.corner_height_m.fill(0.0);
    share_ = f == 0 ? 0.0 : 1.0;
    share_rate_ = 0.0;
    closure_m_ = 0.0;
  }
}

Transform KinematicPlant::blend() const {
  const FootState &left = feet_[0], &right = feet_[1];
  if (!left.anchored) return right.true_T_base;
  if (!right.anchored) return left.true_T_base;
  const Vec3 turn = rotation_vector(right.true_T_base.R.transpose() * left.true_T_base.R);
  return {right.true_T_base.R * rotation(share_ * turn),
          right.true_T_base.p_m + share_ * (left.true_T_base.p_m - right.true_T_base.p_m)};
}

void KinematicPlant::move_base() {
  const double w = params_.share_bandwidth_radps;
  const Vec3 zero = Vec3::Zero();
  critically_damped(slack_.p_m, slack_.p_rate, zero, w, kPlantTick_s);
  critically_damped(slack_.turn_rad, slack_.turn_rate, zero, w, kPlantTick_s);
  const Transform stood = blend();
  true_T_base_ = {stood.R * rotation(slack_.turn_rad), stood.p_m + slack_.p_m};
  for (FootState& foot : feet_) {
    const Vec3 p_m = true_T_base_.p_m - foot.true_T_base.p_m;
    const Vec3 turn_rad = rotation_vector(foot.true_T_base.R.transpose() * true_T_base_.R);
    foot.base_offset = {p_m, (p_m - foot.base_offset.p_m) / kPlantTick_s, turn_rad,
                        (turn_rad - foot.base_offset.turn_rad) / kPlantTick_s};
  }
}

// Of what is missing until the standing soles are flat under the base and the others are where they are led, a share.
void KinematicPlant::give_way(double share) {
  for (std::size_t f = 0; f < kFootCount; ++f) {
    const FootState& foot = feet_[f];
    const Mat3 flat_R_led = foot.true_T_sole.R.transpose() * true_T_base_.R * foot.base_T_sole.R;
    const Vec3 off_rad = foot.anchored ? rotation_vector(flat_R_led) : Vec3::Zero();
    const auto give = [&](LegJoint joint, double by_rad) {
      double& given_rad = given_[static_cast<Eigen::Index>(joint_index(static_cast<Foot>(f), joint))];
      given_rad += share * (by_rad - given_rad);
    };
    give(kAnkleRoll, -off_rad.x());
    give(kAnklePitch, -off_rad.y());
  }
}

void KinematicPlant::move_swing_feet() {
  for (std::size_t f = 0; f < kFootCount; ++f) {
    FootState& foot = feet_[f];
    if (foot.anchored) continue;
    const Transform previous = foot.true_T_sole;
    foot.true_T_sole = true_T_base_ * foot.base_T_sole;
    const std::array<Vec3, kContactsPerFoot> contacts = errors_.sole.contacts_m();
    for (std::size_t c = 0; c < kContactsPerFoot; ++c) {
      const Vec3 corner = foot.true_T_sole * contacts[c];
      const double fallen_m = (previous * contacts[c]).z() - corner.z();
      int step = kFloorStep;
      const double surface_m = world_.height_m(corner.x(), corner.y(), &step);
      const double was_m = foot.corner_height_m[c];
      foot.corner_height_m[c] = corner.z() - surface_m;
      const double depth_m = -foot.corner_height_m[c];
      const bool from_above = was_m > 0.0 && depth_m <= std::max(params_.touch_depth_m, 2.0 * fallen_m);
      if (depth_m < 0.0 || fallen_m <= 0.0 || !from_above) continue;
      foot.anchored = true;
      foot.step = step;
      foot.true_T_sole =
          flattened(foot.true_T_sole, step < 0 ? nullptr : &world_.steps[static_cast<std::size_t>(step)]);
      foot.true_T_base = foot.true_T_sole * foot.base_T_sole.inverse();
      foot.gap_m = gap_m(f);
      foot.raise_m = 0.0;
      break;
    }
  }
}

void KinematicPlant::check_falls() {
  if (fell()) return;
  double highest_m = -1e9;
  for (std::size_t f = 0; f < kFootCount; ++f) {
    const FootState& foot = feet_[f];
    const double depth_m = -clearance_m(collision_box(errors_.sole, foot.true_T_sole), solids_);
    if (depth_m > params_.collision_depth_m) {
      fall("The %s foot collided with the staircase, %.1f mm deep.", name_of(f), mm(depth_m));
      return;
    }
    if (!foot.anchored) continue;
    highest_m = std::max(highest_m, foot.true_T_sole.p_m.z());
    const Vec3 centre = foot.true_T_sole * Vec3{errors_.sole.contact.centre_x_m(), 0, 0};
    int below = kFloorStep;
    static_cast<void>(world_.height_m(centre.x(), centre.y(), &below));
    if (below != foot.step && load_share(f) > params_.lift_share) {
      fall("The %s foot carried %.0f %% of the weight with its centre %.1f mm off the %s.", name_of(f),
           100.0 * load_share(f), mm(-tread_margin_m(centre, world_, foot.step)),
           foot.step == kFloorStep ? "floor" : ("tread of step " + std::to_string(foot.step + 1)).c_str());
      return;
    }
  }
  const double least_share = std::min(load_share(0), load_share(1));
  if (closure_m_ > params_.max_closure_m && least_share > params_.lift_share) {
    fall("The two standing legs disagree about the base by %.1f mm: a foot slipped.", mm(closure_m_));
    return;
  }
  const double height_m = true_T_base_.p_m.z() - highest_m;
  if (height_m < params_.min_base_height_m) {
    fall("The base sank to %.3f m above the feet.", height_m);
  }
}

void KinematicPlant::fall(const char* format, ...) {
  std::array<char, 256> text{};
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text.data(), text.size(), format, arguments);
  va_end(arguments);
  fall_reason_ = text.data();
  dq_.setZero();
}

}  // namespace polygmap::sim
