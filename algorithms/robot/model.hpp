// SPDX-License-Identifier: Apache-2.0
// The robot as numbers: a KUAVO-class biped of 12 leg joints (166 cm, 55 kg). Frames: x forward, y left, z up.
//
// base: the pelvis; the IMU sits at its origin.
// sole: below the ankle joint on the ground plane of the foot, x towards the toe. Flat on level ground its z is up.
#pragma once

#include <array>

#include "algorithms/core/capacities.hpp"
#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

// Lengths of one robot. The two legs mirror each other in y.
struct LegGeometry {
  Vec3 base_p_hip_m{-0.0025, 0.087, -0.066};        // left hip: the roll and yaw axes meet here
  Vec3 hip_p_hip_pitch_m{0.0005, -0.001, -0.1287};  // left, after roll and yaw
  double thigh_m = 0.284;
  double shank_m = 0.346;
  double ankle_to_sole_m = 0.0645;
};

struct JointLimits {
  double min_rad;
  double max_rad;
  double speed_radps;  // of the drive, not of the motor
  double torque_nm;
};

// A rigid link: its mass and where its centre is, in the frame of the joint that moves it.
struct LinkMass {
  double mass_kg;
  Vec3 centre_m;
};
// 55 kg. The torso is the base link with arms and head at rest. Source of the figures: the robot's public description,
// centres rounded to a centimetre.
struct MassModel {
  LinkMass torso{37.012, {-0.018, 0.0, 0.21}};
  // Left; the right one mirrors y.
  std::array<LinkMass, kJointsPerLeg> leg{{{1.711, {0.0, 0.0, -0.01}},
                                           {0.580, {0.0, 0.0, -0.09}},
                                           {4.504, {0.0, 0.01, -0.08}},
                                           {1.628, {0.01, 0.0, -0.12}},
                                           {0.072, {0.0, 0.0, 0.0}},
                                           {0.499, {0.03, 0.0, -0.04}}}};
  [[nodiscard]] double total_kg() const noexcept {
    double sum_kg = torso.mass_kg;
    for (const LinkMass& link : leg) sum_kg += 2.0 * link.mass_kg;
    return sum_kg;
  }
};

enum LegJoint : std::uint8_t { kHipRoll, kHipYaw, kHipPitch, kKnee, kAnklePitch, kAnkleRoll };

// Left leg; the right leg's roll and yaw ranges are swapped and negated.
inline constexpr std::array<JointLimits, kJointsPerLeg> kLeftLegLimits{{
    {-0.314, 0.663, 4.0, 180.0},
    {-0.873, 0.785, 4.0, 100.0},
    {-2.007, 1.571, 8.0, 100.0},
    {0.0, 2.531, 5.0, 180.0},
    {-0.873, 0.349, 4.0, 36.0},
    {-0.262, 0.262, 4.0, 36.0},
}};

// Of all joints, in the order of joint_index().
inline constexpr std::array<JointLimits, kJointCount> kJointLimits = [] {
  std::array<JointLimits, kJointCount> all{};
  for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
    const JointLimits left = kLeftLegLimits[j];
    const bool mirrored = j == kHipRoll || j == kHipYaw || j == kAnkleRoll;
    all[j] = left;
    all[kJointsPerLeg + j] =
        mirrored ? JointLimits{-left.max_rad, -left.min_rad, left.speed_radps, left.torque_nm} : left;
  }
  return all;
}();
[[nodiscard]] constexpr const JointLimits& joint_limits(Foot leg, std::size_t joint) noexcept {
  return kJointLimits[index_of(leg) * kJointsPerLeg + joint];
}
[[nodiscard]] constexpr std::size_t joint_index(Foot leg, std::size_t joint) noexcept {
  return index_of(leg) * kJointsPerLeg + joint;
}
// +1 for the left side, -1 for the right.
[[nodiscard]] constexpr double side_sign(Foot foot) noexcept { return foot == Foot::kLeft ? 1.0 : -1.0; }

// A rectangle in the sole plane, sole frame.
struct SoleRectangle {
  double toe_x_m;
  double heel_x_m;
  double half_width_m;
  [[nodiscard]] constexpr double length_m() const noexcept { return toe_x_m - heel_x_m; }
  [[nodiscard]] constexpr double centre_x_m() const noexcept { return 0.5 * (toe_x_m + heel_x_m); }
};
inline constexpr SoleRectangle kContactRectangle{0.17084, -0.073164, 0.04773};  // must lie on the tread
inline constexpr SoleRectangle kCollisionRectangle{0.179, -0.081, 0.048};       // must miss everything
inline constexpr double kCollisionHeight_m = 0.07;                              // of the collision box above the sole

// The four contact points of a sole in the sole frame: toe left, toe right, heel left, heel right.
[[nodiscard]] inline std::array<Vec3, kContactsPerFoot> sole_contacts_m() noexcept {
  constexpr SoleRectangle r = kContactRectangle;
  return {Vec3{r.toe_x_m, r.half_width_m, 0}, Vec3{r.toe_x_m, -r.half_width_m, 0}, Vec3{r.heel_x_m, r.half_width_m, 0},
          Vec3{r.heel_x_m, -r.half_width_m, 0}};
}

inline constexpr double kNominalBaseHeight_m = 0.79;  // base above the soles, standing
inline constexpr double kStanceHalfWidth_m = 0.1;     // soles from the middle plane (eq. 31: y_b)

// Mounts, as the data sheets say.
// Camera frame: x right, y down, z forward along the optical axis.
inline constexpr double kCameraPitch_rad = 1.047;  // down from horizontal
[[nodiscard]] inline Transform base_T_camera() noexcept {
  Mat3 forward;  // optical axis along base x
  forward << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {rotation_y(kCameraPitch_rad) * forward, Vec3{0.14915, 0.0, -0.00702}};
}
// Mid-360 on the head pitch link (head at zero), pitched and mounted upside down.
[[nodiscard]] inline Transform base_T_lidar() noexcept {
  return {rotation_y(0.2297) * rotation_x(kPi), Vec3{-0.0185 + 0.0218, 0.0, 0.6014 + 0.1054}};
}
[[nodiscard]] inline CameraIntrinsics robot_camera_intrinsics() noexcept {
  return {kDepthWidth_px, kDepthHeight_px, 366.7, 366.8, 322.7, 242.3, 0.00025};
}

}  // namespace polygmap
