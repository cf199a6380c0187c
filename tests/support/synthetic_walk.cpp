// SPDX-License-Identifier: Apache-2.0
#include "tests/support/synthetic_walk.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "algorithms/geometry/so3.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::test {
namespace {

constexpr double kBaseHeight_m = 0.77;
constexpr double kSway_m = 0.08;

double smooth(double s) {
  s = std::clamp(s, 0.0, 1.0);
  return s * s * s * (10.0 + s * (-15.0 + 6.0 * s));  // minimum jerk
}
std::int64_t ns(double s) { return static_cast<std::int64_t>(s * 1e9 + 0.5); }

}  // namespace

SyntheticWalk::SyntheticWalk(const WalkSpec& spec) : spec_(spec), random_(spec.seed) {
  const double length = 1.0 + draw(spec_.leg_length_error);
  for (LegGeometry& g : true_geometry_) {
    g.thigh_m *= length;
    g.shank_m *= length;
  }
  for (int j = 0; j < encoder_offset_rad_.size(); ++j) encoder_offset_rad_[j] = draw(spec_.encoder_offset_rad);
  gyro_bias_radps_ = draw3(spec_.gyro_bias_radps);
  accel_bias_mps2_ = draw3(spec_.accel_bias_mps2);
  imu_R_base_ = so3_exp(draw3(spec_.imu_mount_rad));
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  const double yaw_rad = kPi * any(random_);
  lio_T_true_ = {rotation_z(yaw_rad), Vec3{20.0 * any(random_), 20.0 * any(random_), 2.0 * any(random_)}};
  build();
}

void SyntheticWalk::build() {
  Phase now{};
  now.swing = -1;
  now.base_from_m = now.base_to_m = Vec3{0.0, 0.0, kBaseHeight_m};
  for (std::size_t i = 0; i < kFootCount; ++i) {
    now.sole_from[i] =
        now.sole_to[i] = {Mat3::Identity(), Vec3{0, side_sign(static_cast<Foot>(i)) * kStanceHalfWidth_m, 0}};
  }
  now.left_share_from = now.left_share_to = 0.5;
  const auto add = [&](double duration_s) {
    now.end_ns = now.start_ns + ns(duration_s);
    phases_.push_back(now);
    now.start_ns = now.end_ns;
    now.base_from_m = now.base_to_m;
    now.yaw_from_rad = now.yaw_to_rad;
    now.sole_from = now.sole_to;
    now.left_share_from = now.left_share_to;
    now.swing = -1;
  };
  add(spec_.stand_s);
  double yaw = 0.0;
  Vec3 centre{0, 0, 0};
  for (int step = 0; step < spec_.steps; ++step) {
    yaw += spec_.yaw_per_step_rad;
    const Mat3 heading = rotation_z(yaw);
    const Vec3 next = centre + heading * Vec3{spec_.tread_m, 0, spec_.rise_m};
    for (const int swing : {0, 1}) {  // left leads, right follows beside it
      const double stance_y = swing == 0 ? -kSway_m : kSway_m;
      now.base_to_m = (swing == 0 ? centre : next) + heading * Vec3{0, stance_y, 0};
      now.base_to_m.z() = centre.z() + kBaseHeight_m + (swing == 0 ? 0.0 : 0.3 * spec_.rise_m);
      now.yaw_to_rad = yaw;
      now.left_share_to = swing == 0 ? 0.02 : 0.98;
      add(0.7);
      now.swing = swing;
      const Vec3 side = heading * Vec3{0, side_sign(static_cast<Foot>(swing)) * kStanceHalfWidth_m, 0};
      now.sole_to[static_cast<std::size_t>(swing)] = {heading, next + side};
      now.base_to_m += heading * Vec3{swing == 0 ? 0.05 : 0.0, -0.2 * stance_y, 0};
      if (swing == 1) now.base_to_m.z() = next.z() + kBaseHeight_m;
      now.left_share_to = swing == 0 ? 0.0 : 1.0;
      add(0.7);
      now.left_share_from = swing == 0 ? 0.25 : 0.75;  // a landing foot takes weight at once
    }
    centre = next;
  }
  now.base_to_m = centre + Vec3{0, 0, kBaseHeight_m};
  now.left_share_to = 0.5;
  add(0.7);
  add(spec_.stand_s);
  end_ns_ = now.start_ns - kTick_ns;
}

WalkTruth SyntheticWalk::truth(std::int64_t t_ns) const {
  std::size_t i = 0;
  while (i + 1 < phases_.size() && phases_[i].end_ns <= t_ns) ++i;
  const Phase& p = phases_[i];
  const double share = seconds(t_ns - p.start_ns) / seconds(p.end_ns - p.start_ns);
  const double s = smooth(share);
  WalkTruth truth;
  const double wave = std::sin(2.0 * kPi * s);
  const bool moving = p.base_from_m != p.base_to_m;
  const double yaw =
      p.yaw_from_rad + s * (p.yaw_to_rad - p.yaw_from_rad) + (p.swing >= 0 ? 0.03 * wave * s * (1 - s) * 4 : 0);
  const double pitch = moving ? 0.02 * wave * s * (1 - s) * 4 : 0.0;
  truth.true_T_base = {rotation_z(yaw) * rotation_y(pitch) * rotation_x(-0.5 * pitch),
                       p.base_from_m + s * (p.base_to_m - p.base_from_m)};
  truth.true_T_sole = p.sole_to;
  if (p.swing >= 0) {
    const auto f = static_cast<std::size_t>(p.swing);
    const Vec3 from = p.sole_from[f].p_m, to = p.sole_to[f].p_m;
    const double up = smooth(share / 0.6), along = smooth((share - 0.15) / 0.7), down = smooth((share - 0.6) / 0.4);
    const double apex = std::max(from.z(), to.z()) + 0.08;
    truth.true_T_sole[f].p_m = from + along * (to - from);
    truth.true_T_sole[f].p_m.z() = from.z() + up * (apex - from.z()) - down * (apex - to.z());
    const double turn = yaw_of(p.sole_from[f].R) + along * (yaw_of(p.sole_to[f].R) - yaw_of(p.sole_from[f].R));
    truth.true_T_sole[f].R = rotation_z(turn);
    truth.stance[f] = false;
  }
  truth.true_T_sole[0].p_m += slipped_m(t_ns);
  const double left = p.left_share_from + s * (p.left_share_to - p.left_share_from);
  truth.load_share = {left, 1.0 - left};
  if (p.swing >= 0) {
    truth.load_share = {p.swing == 0 ? 0.0 : 1.0, p.swing == 0 ? 1.0 : 0.0};
  }
  return truth;
}

// Until its next swing, which brings the foot back to where it belongs.
Vec3 SyntheticWalk::slipped_m(std::int64_t t_ns) const {
  if (spec_.slip_ns < 0 || t_ns < spec_.slip_ns) return Vec3::Zero();
  const double slid_m = 0.3 * std::min(seconds(t_ns - spec_.slip_ns), 0.2);
  const auto swing = std::find_if(phases_.begin(), phases_.end(),
                                  [&](const Phase& p) { return p.swing == 0 && p.start_ns > spec_.slip_ns; });
  if (swing == phases_.end()) return {slid_m, 0, 0};
  const double share = seconds(t_ns - swing->start_ns) / seconds(swing->end_ns - swing->start_ns);
  return {slid_m * (1.0 - smooth((share - 0.15) / 0.7)), 0, 0};
}

ImuSample SyntheticWalk::imu(std::int64_t t_ns) {
  constexpr std::int64_t kHalf_ns = kNsPerMs;
  constexpr double kHalf_s = 1e-3;
  const Transform before = truth(t_ns - kHalf_ns).true_T_base, at = truth(t_ns).true_T_base,
                  after = truth(t_ns + kHalf_ns).true_T_base;
  const Vec3 a_mps2 = (after.p_m - 2.0 * at.p_m + before.p_m) / (kHalf_s * kHalf_s);
  const Vec3 w_radps = so3_log(before.R.transpose() * after.R) / (2.0 * kHalf_s);
  ImuSample sample;
  sample.stamp_ns = t_ns;
  sample.gyro_radps = imu_R_base_ * w_radps + gyro_bias_radps_ + draw3(spec_.gyro_noise_radps);
  sample.accel_mps2 = imu_R_base_ * at.R.transpose() * (a_mps2 + Vec3{0, 0, kGravity_mps2}) + accel_bias_mps2_ +
                      draw3(spec_.accel_noise_mps2);
  return sample;
}

JointVector SyntheticWalk::true_joints(std::int64_t t_ns) const {
  const WalkTruth now = truth(t_ns);
  JointVector q;
  for (std::size_t i = 0; i < kFootCount; ++i) {
    const auto leg = static_cast<Foot>(i);
    const LegSolution solution = solve_leg(true_geometry_[i], leg, now.true_T_base.inverse() * now.true_T_sole[i]);
    EXPECT_TRUE(solution.reachable) << "the synthetic walk is out of the leg's reach";
    q.segment<kJointsPerLeg>(static_cast<int>(joint_index(leg, 0))) = solution.q_rad;
  }
  return q;
}

JointFeedback SyntheticWalk::joints(std::int64_t t_ns) {
  constexpr std::int64_t kHalf_ns = kNsPerMs;
  JointFeedback feedback;
  feedback.stamp_ns = t_ns;
  feedback.q_rad = true_joints(t_ns) + encoder_offset_rad_;
  feedback.dq_radps = (true_joints(t_ns + kHalf_ns) - true_joints(t_ns - kHalf_ns)) / 2e-3;
  for (int j = 0; j < feedback.q_rad.size(); ++j) {
    feedback.q_rad[j] += draw(spec_.encoder_noise_rad);
    feedback.dq_radps[j] += draw(spec_.encoder_rate_noise_radps);
  }
  const WalkTruth felt = truth(std::max<std::int64_t>(t_ns - spec_.contact_delay_ns, 0));
  for (std::size_t i = 0; i < kFootCount; ++i)
    feedback.foot_force_n[i] = felt.stance[i] ? 540.0 * felt.load_share[i] : 0.0;
  return feedback;
}

LioSample SyntheticWalk::lio(std::int64_t stamp_ns) {
  LioSample sample;
  sample.stamp_ns = stamp_ns;
  sample.lio_T_lidar = lio_T_true_ * truth(stamp_ns).true_T_base * base_T_lidar();
  sample.lio_T_lidar.p_m += draw3(spec_.lio_position_m);
  sample.lio_T_lidar.R = sample.lio_T_lidar.R * so3_exp(draw3(spec_.lio_rotation_rad));
  sample.position_sigma_m.setConstant(spec_.lio_position_m);
  sample.rotation_sigma_rad.setConstant(spec_.lio_rotation_rad);
  return sample;
}

}  // namespace polygmap::test
