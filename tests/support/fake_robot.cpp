// SPDX-License-Identifier: Apache-2.0
#include "tests/support/fake_robot.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/geometry/so3.hpp"
#include "algorithms/robot/leg_kinematics.hpp"
#include "scheduler/schedule_table.hpp"
#include "sim_stub/robot_camera.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::test {
namespace {

constexpr double kTick_s = 1e-6 * kCycle_us;
constexpr double kLeg_n = 30.0;

}  // namespace

std::vector<std::uint16_t> render_for_robot(DepthScene scene) {
  const CameraIntrinsics full = robot_camera_intrinsics();
  scene.intrinsics = full;
  scene.intrinsics.width_px /= 2;
  scene.intrinsics.height_px /= 2;
  scene.intrinsics.fx_px /= 2;
  scene.intrinsics.fy_px /= 2;
  scene.intrinsics.cx_px = (full.cx_px - 0.5) / 2;
  scene.intrinsics.cy_px = (full.cy_px - 0.5) / 2;
  const std::vector<std::uint16_t> half = render(scene).raw();
  const auto width = static_cast<std::size_t>(full.width_px), height = static_cast<std::size_t>(full.height_px);
  std::vector<std::uint16_t> out(width * height);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = half[i / width / 2 * (width / 2) + i % width / 2];
  return out;
}

fakes::FakeClock three_days_up() {
  fakes::FakeClock clock;
  clock.advance_ns(3 * 86400 * kNsPerS);
  return clock;
}

JointVector standing_joints() {
  JointVector q_rad;
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    const Transform sole{Mat3::Identity(), Vec3{0, side_sign(foot) * kStanceHalfWidth_m, -kNominalBaseHeight_m}};
    q_rad.segment<6>(static_cast<Eigen::Index>(joint_index(foot, 0))) = solve_leg({}, foot, sole).q_rad;
  }
  return q_rad;
}

FakeRobot::FakeRobot(double toe_gap_m)
    : camera(robot_camera_intrinsics()), q_rad_(standing_joints()), followed_rad_(q_rad_) {
  stairs_.rise_m = 0.13;
  stairs_.first_riser_x_m = kCollisionRectangle.toe_x_m + toe_gap_m;
  scene_.add_stairs(stairs_);
  true_T_base_.p_m = {0, 0, kNominalBaseHeight_m};
  true_T_base_before_.fill(true_T_base_);
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    feet_[index_of(leg)].true_T_sole = true_T_base_ * base_T_sole({}, leg, leg_joints(q_rad_, leg));
  }
}

void FakeRobot::advance() {
  clock.advance_ns(kCycle_ns);
  move();
  sense();
  ++tick_;
}

double FakeRobot::ground_m(const Transform& true_T_sole) const {
  double ground_m = 0.0;
  for (const Vec3& corner : sole_contacts_m()) {
    const double x_m = (true_T_sole * corner).x() - stairs_.first_riser_x_m;
    const int step = std::min(static_cast<int>(std::floor(x_m / stairs_.tread_m)) + 1, stairs_.steps);
    ground_m = std::max(ground_m, std::max(step, 0) * stairs_.rise_m);
  }
  return ground_m;
}

void FakeRobot::move() {
  const JointVector before_rad = q_rad_;
  q_rad_ += (1.0 - std::exp(-0.2)) * (followed_rad_ - q_rad_);  // 2 ms of a 10 ms lag
  dq_radps_ = (q_rad_ - before_rad) / kTick_s;
  if (!joints.commands().empty()) {
    for (std::size_t n = 0; n < kJointCount; ++n) {
      const JointSetpoint& asked = joints.commands().newest().joints[n];
      const auto joint = static_cast<Eigen::Index>(n);
      if (asked.kp_nmprad > 0.0) followed_rad_[joint] = asked.q_rad - encoder_offset_rad[joint];  // armed
    }
  }
  std::array<Transform, kFootCount> base_T_foot;
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    base_T_foot[index_of(leg)] = base_T_sole({}, leg, leg_joints(q_rad_, leg));
  }
  true_T_base_ = feet_[support_].true_T_sole * base_T_foot[support_].inverse();
  FootState& foot = feet_[1 - support_];
  const Transform hanging = true_T_base_ * base_T_foot[1 - support_];
  if (foot.stands) {
    foot.stands = hanging.p_m.z() < foot.true_T_sole.p_m.z() + 0.002;
  } else {
    const bool falling = hanging.p_m.z() < foot.true_T_sole.p_m.z();
    double lowest_m = 1e9;
    for (const Vec3& corner : sole_contacts_m()) lowest_m = std::min(lowest_m, (hanging * corner).z());
    foot.stands = falling && lowest_m <= ground_m(hanging);
  }
  if (!foot.stands) foot.true_T_sole = hanging;
  const auto distance_m = [&](std::size_t f) { return (true_T_base_.p_m - feet_[f].true_T_sole.p_m).head<2>().norm(); };
  // The nearer foot carries; what the legs disagree by is that foot's slip.
  if (foot.stands && distance_m(1 - support_) + 0.01 < distance_m(support_)) {
    foot.true_T_sole = hanging;
    support_ = 1 - support_;
  }
}

void FakeRobot::sense() {
  const std::int64_t now_ns = clock.now_ns();
  true_T_base_before_ = {true_T_base_, true_T_base_before_[0], true_T_base_before_[1]};
  const auto& [now, before, long_before] = true_T_base_before_;
  const Vec3 a_mps2 = (now.p_m - 2.0 * before.p_m + long_before.p_m) / (kTick_s * kTick_s);
  const ImuSample felt{now_ns, so3_log(before.R.transpose() * now.R) / kTick_s,
                       now.R.transpose() * (a_mps2 + Vec3{0, 0, kGravity_mps2})};
  if (!imu_interval_) imu_interval_.emplace(imu_interval_ns, kCycle_ns);
  ImuSample sample;
  if (imu_interval_->push(felt, sample) && imu_speaks) imu.feed(sample);
  if (joints_speak) {
    JointFeedback feedback;
    feedback.stamp_ns = now_ns;
    feedback.q_rad = q_rad_ + encoder_offset_rad;
    feedback.dq_radps = dq_radps_;
    const bool both = feet_[0].stands && feet_[1].stands;
    for (std::size_t f = 0; f < kFootCount; ++f) {
      feedback.foot_force_n[f] = f == support_ ? kWeight_n - (both ? 2 * kLeg_n : 0.0) : (both ? 2 * kLeg_n : 0.0);
    }
    if (silent_joint < kJointCount) {
      const auto i = static_cast<Eigen::Index>(silent_joint);
      if (silent_cycles_++ == 0) last_heard_ = {q_rad_before_[i], dq_radps_before_[i]};
      feedback.q_rad[i] = last_heard_[0] + encoder_offset_rad[i];
      feedback.dq_radps[i] = last_heard_[1];
      feedback.silent_cycles[silent_joint] = silent_cycles_;
    } else {
      silent_cycles_ = 0;
    }
    q_rad_before_ = q_rad_;
    dq_radps_before_ = dq_radps_;
    joints.feed(feedback);
  }
  if (camera_speaks && tick_ % picture_ticks == 0) {
    scene_.world_T_camera = true_T_base_ * base_T_camera();
    camera.feed(now_ns, render_for_robot(scene_));
  }
  if (tick_ % 50 == 49) {
    const std::int64_t scan_ns = now_ns - 2 * kCycle_ns;
    lidar.feed({scan_ns, true_T_base_before_[2] * base_T_lidar(), Vec3::Constant(0.01), Vec3::Constant(0.003)});
  }
}

}  // namespace polygmap::test
