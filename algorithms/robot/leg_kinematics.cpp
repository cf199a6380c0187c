// SPDX-License-Identifier: Apache-2.0
#include "algorithms/robot/leg_kinematics.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace polygmap {
namespace {

Vec3 mirrored(const Vec3& left_m, Foot leg) noexcept { return {left_m.x(), side_sign(leg) * left_m.y(), left_m.z()}; }

// Of an angle in 0..pi whose cosine is that, or the cosine where that is the sine of one in +-pi/2.
double sine(double cosine) noexcept { return math::sqrt(std::max(1.0 - cosine * cosine, 0.0)); }

// The joint before, turned about one of its axes: what a product with rotation_x, _y or _z gives, without the zeros.
template <std::size_t kJoint>
void turn(LegFrames& frames, const math::SinCosOf<kJointsPerLeg>& angles) noexcept {
  constexpr int kAxis = kJointAxis[kJoint], kU = (kAxis + 1) % 3, kV = (kAxis + 2) % 3;
  const Mat3& R = frames.joint[kJoint - 1].R;
  Mat3& turned = frames.joint[kJoint].R;
  const double s = angles.sin[kJoint], c = angles.cos[kJoint];
  turned.col(kAxis) = R.col(kAxis);
  turned.col(kU) = R.col(kU) * c + R.col(kV) * s;
  turned.col(kV) = R.col(kV) * c - R.col(kU) * s;
}

}  // namespace

LegFrames leg_frames(const LegGeometry& g, Foot leg, const LegVector& q) noexcept {
  LegFrames f;
  const auto below = [](const Transform& joint, double length_m) -> Vec3 {
    return joint.p_m - joint.R.col(2) * length_m;
  };
  const auto angles = math::sin_cos(std::array{q[0], q[1], q[2], q[3], q[4], q[5]});
  const double s = angles.sin[kHipRoll], c = angles.cos[kHipRoll];
  f.joint[kHipRoll] = {(Mat3() << 1, 0, 0, 0, c, -s, 0, s, c).finished(), mirrored(g.base_p_hip_m, leg)};
  turn<kHipYaw>(f, angles);
  turn<kHipPitch>(f, angles);
  turn<kKnee>(f, angles);
  turn<kAnklePitch>(f, angles);
  turn<kAnkleRoll>(f, angles);
  f.joint[kHipYaw].p_m = f.joint[kHipRoll].p_m;
  f.joint[kHipPitch].p_m = f.joint[kHipYaw] * mirrored(g.hip_p_hip_pitch_m, leg);
  f.joint[kKnee].p_m = below(f.joint[kHipPitch], g.thigh_m);
  f.joint[kAnklePitch].p_m = below(f.joint[kKnee], g.shank_m);
  f.joint[kAnkleRoll].p_m = f.joint[kAnklePitch].p_m;
  f.sole = {f.joint[kAnkleRoll].R, below(f.joint[kAnkleRoll], g.ankle_to_sole_m)};
  return f;
}

BodyFrames body_frames(const LegGeometry& geometry, const JointVector& q_rad) noexcept {
  return {leg_frames(geometry, Foot::kLeft, leg_joints(q_rad, Foot::kLeft)),
          leg_frames(geometry, Foot::kRight, leg_joints(q_rad, Foot::kRight))};
}

LegVector leg_joints(const JointVector& q_rad, Foot leg) noexcept {
  return q_rad.segment<static_cast<int>(kJointsPerLeg)>(static_cast<Eigen::Index>(joint_index(leg, 0)));
}

Transform base_T_sole(const LegGeometry& geometry, Foot leg, const LegVector& q_rad) noexcept {
  return leg_frames(geometry, leg, q_rad).sole;
}

LegPoints base_p_leg(const LegGeometry& geometry, Foot leg, const LegVector& q_rad) noexcept {
  const LegFrames f = leg_frames(geometry, leg, q_rad);
  return {f.joint[kHipPitch].p_m, f.joint[kKnee].p_m, f.joint[kAnklePitch].p_m};
}

LegJacobian leg_jacobian(const LegFrames& f) noexcept {
  LegJacobian jacobian;
  for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
    const auto column = static_cast<Eigen::Index>(j);
    const Vec3 axis = f.joint[j].R.col(kJointAxis[j]);
    jacobian.block<3, 1>(0, column) = axis.cross(f.sole.p_m - f.joint[j].p_m);
    jacobian.block<3, 1>(3, column) = axis;
  }
  return jacobian;
}

LegSolution solve_leg(const LegGeometry& g, Foot leg, const Transform& base_T_sole) noexcept {
  LegSolution solution;
  LegVector& q = solution.q_rad;
  const Vec3 hip_p_pitch = mirrored(g.hip_p_hip_pitch_m, leg);
  const Vec3 base_p_hip = mirrored(g.base_p_hip_m, leg);
  const Vec3 base_p_ankle = base_T_sole * Vec3{0, 0, g.ankle_to_sole_m};

  // The hip seen from the foot: the ankle roll brings its y to minus the pitch joint's lateral offset.
  const Mat3& R = base_T_sole.R;
  const Vec3 foot_p_hip = R.transpose() * (base_p_hip - base_p_ankle);
  const double radius = std::max(math::sqrt(math::square(foot_p_hip.y()) + math::square(foot_p_hip.z())), 1e-6);
  const double offset = math::clamp(-hip_p_pitch.y() / radius, -1.0, 1.0), depth = sine(offset);
  const double cos_roll = (offset * foot_p_hip.y() + depth * foot_p_hip.z()) / radius;
  const double sin_roll = (depth * foot_p_hip.y() - offset * foot_p_hip.z()) / radius;
  q[kAnkleRoll] = math::atan2(sin_roll, cos_roll);

  // N = R Rx(-roll) = Rx(hip roll) Rz(yaw) Ry(sum of pitches). Its second column is that of Rx Rz, too.
  const Vec3 side = R.col(1) * cos_roll - R.col(2) * sin_roll;
  const double sin_yaw = math::clamp(-side.x(), -1.0, 1.0), cos_yaw = std::max(sine(sin_yaw), 1e-9);
  q[kHipYaw] = math::atan2(sin_yaw, cos_yaw);
  q[kHipRoll] = math::atan2(side.z(), side.y());
  const double pitch_sum = math::atan2(R(0, 1) * sin_roll + R(0, 2) * cos_roll, R(0, 0));

  const Vec3 hip_p_ankle = base_p_ankle - base_p_hip;
  const Vec3 down{0.0, -side.z() / cos_yaw, side.y() / cos_yaw};  // third column of Rx Rz
  const Vec3 ahead = side.cross(down);
  const Vec3 leg_vector{ahead.dot(hip_p_ankle) - hip_p_pitch.x(), 0.0, down.dot(hip_p_ankle) - hip_p_pitch.z()};
  const double length = math::sqrt(math::square(leg_vector.x()) + math::square(leg_vector.z()));
  const double asked =
      (length * length - g.thigh_m * g.thigh_m - g.shank_m * g.shank_m) / (2.0 * g.thigh_m * g.shank_m);
  const double cos_knee = math::clamp(asked, -1.0, 1.0);
  solution.reachable = asked <= 1.0 && asked >= -1.0;
  const double sin_knee = sine(cos_knee);
  q[kKnee] = math::atan2(sin_knee, cos_knee);
  const double bent_m = g.shank_m * sin_knee, straight_m = g.thigh_m + g.shank_m * cos_knee;
  q[kHipPitch] = math::atan2(bent_m * leg_vector.z() - straight_m * leg_vector.x(),
                             -bent_m * leg_vector.x() - straight_m * leg_vector.z());
  q[kAnklePitch] = math::wrap_angle(pitch_sum - q[kHipPitch] - q[kKnee]);
  return solution;
}

double limit_margin_rad(const DriveModel& drives, Foot leg, const LegVector& q_rad) noexcept {
  double margin = 1e9;
  for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
    const JointLimits& limits = drives.limits_of(leg, j);
    const double q = q_rad[static_cast<Eigen::Index>(j)];
    margin = std::min({margin, q - limits.min_rad, limits.max_rad - q});
  }
  return margin;
}

}  // namespace polygmap
