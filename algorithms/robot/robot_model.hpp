// SPDX-License-Identifier: Apache-2.0
// The robot as one value that every stage is given: default-constructed, a KUAVO-class biped of 12 leg joints (166 cm,
// 55 kg). Frames: x forward, y left, z up.
//
// base: the pelvis; the IMU sits at its origin.
// sole: below the ankle joint on the ground plane of the foot, x towards the toe. Flat on level ground its z is up.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <string_view>

#include "algorithms/core/capacities.hpp"
#include "algorithms/core/math/transform.hpp"
#include "algorithms/core/messages/samples.hpp"

namespace polygmap {

enum LegJoint : std::uint8_t { kHipRoll, kHipYaw, kHipPitch, kKnee, kAnklePitch, kAnkleRoll };
inline constexpr std::array<std::string_view, kJointsPerLeg> kLegJointNames{"hip_roll", "hip_yaw",     "hip_pitch",
                                                                            "knee",     "ankle_pitch", "ankle_roll"};
// In the order of joint_index().
inline constexpr std::array<std::string_view, kJointCount> kJointNames{
    "left_hip_roll",  "left_hip_yaw",  "left_hip_pitch",  "left_knee",  "left_ankle_pitch",  "left_ankle_roll",
    "right_hip_roll", "right_hip_yaw", "right_hip_pitch", "right_knee", "right_ankle_pitch", "right_ankle_roll"};

[[nodiscard]] constexpr std::size_t joint_index(Foot leg, std::size_t joint) noexcept {
  return index_of(leg) * kJointsPerLeg + joint;
}
// +1 for the left side, -1 for the right.
[[nodiscard]] constexpr double side_sign(Foot foot) noexcept { return foot == Foot::kLeft ? 1.0 : -1.0; }

// Lengths of one robot. The two legs mirror each other in y.
struct LegGeometry {
  Vec3 base_p_hip_m{-0.0025, 0.087, -0.066};
  Vec3 hip_p_hip_pitch_m{0.0005, -0.001, -0.1287};
  double thigh_m = 0.284;
  double shank_m = 0.346;
  double ankle_to_sole_m = 0.0645;

  static void visit(auto& p, auto& field) {
    field("base_p_hip_m", p.base_p_hip_m, -1.0, 1.0,
          "Left hip in the base: its roll and yaw axes meet here; the right one mirrors y.");
    field("hip_p_hip_pitch_m", p.hip_p_hip_pitch_m, -1.0, 1.0, "Axis of the left hip's pitch, after roll and yaw.");
    field("thigh_m", p.thigh_m, 0.1, 0.6, "Hip pitch to knee.");
    field("shank_m", p.shank_m, 0.1, 0.6, "Knee to ankle.");
    field("ankle_to_sole_m", p.ankle_to_sole_m, 0.01, 0.3, "Ankle to ground.");
  }
};

// A rigid link: its mass and where its centre is, in the frame of the joint that moves it.
struct LinkMass {
  double mass_kg;
  Vec3 centre_m;

  static void visit(auto& p, auto& field) {
    field("mass_kg", p.mass_kg, 0.0, 200.0, "Mass of the link.");
    field("centre_m", p.centre_m, -1.0, 1.0, "Its centre, in the frame of the joint that moves it.");
  }
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

  static void visit(auto& p, auto& field) {
    field("torso", p.torso);
    field("leg", p.leg, kLegJointNames);
  }
};

struct JointLimits {
  double min_rad;
  double max_rad;
  double speed_radps;  // no command asks for more
  double torque_nm;
  // The torque-speed line of a motor at its supply's voltage: all its torque up to the corner, from there linearly
  // less, and none at the speed that it reaches without a load. Braking has no such line.
  double corner_radps;
  double no_load_radps;

  static void visit(auto& p, auto& field) {
    field("min_rad", p.min_rad, -3.2, 3.2, "Least angle.");
    field("max_rad", p.max_rad, -3.2, 3.2, "Greatest angle.");
    field.ordered("min_rad", "max_rad");
    field("speed_radps", p.speed_radps, 0.1, 100.0, "Speed of the drive, not of the motor.");
    field("torque_nm", p.torque_nm, 1.0, 2000.0, "Torque of the drive, not of the motor.");
    field("corner_radps", p.corner_radps, 0.1, 100.0, "Up to this speed the drive gives all its torque.");
    field("no_load_radps", p.no_load_radps, 0.1, 100.0,
          "At this speed it gives none, between the two linearly less; braking it gives all.");
    field.ordered("corner_radps", "no_load_radps");
    field.ordered("speed_radps", "no_load_radps");
  }
};

// The right leg's limits from the left one's: its roll and yaw ranges are swapped and negated.
[[nodiscard]] constexpr std::array<JointLimits, kJointCount> mirrored_limits(
    const std::array<JointLimits, kJointsPerLeg>& left) noexcept {
  std::array<JointLimits, kJointCount> both{};
  for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
    const JointLimits& limits = left[j];
    const bool mirrored = j == kHipRoll || j == kHipYaw || j == kAnkleRoll;
    both[j] = both[kJointsPerLeg + j] = limits;
    if (!mirrored) continue;
    both[kJointsPerLeg + j].min_rad = -limits.max_rad;
    both[kJointsPerLeg + j].max_rad = -limits.min_rad;
  }
  return both;
}

// The largest gains that a drive's command can say, beside the parameters': they come with the drives (a bus file).
struct GainLimits {
  double kp_nmprad = std::numeric_limits<double>::infinity();
  double kd_nmsprad = std::numeric_limits<double>::infinity();
};

// What moves the joints, and how they are held.
struct DriveModel {
  // In the order of joint_index(). A KUAVO's public description has the ranges and torques, its drive configuration the
  // speeds. Its drives' lines are not published and are assumed: all torque up to 0.8 of the speed, none at 1.5 of it.
  std::array<JointLimits, kJointCount> limits = mirrored_limits({{{-0.314, 0.663, 4.0, 180.0, 3.2, 6.0},
                                                                  {-0.873, 0.785, 4.0, 100.0, 3.2, 6.0},
                                                                  {-2.007, 1.571, 8.0, 100.0, 6.4, 12.0},
                                                                  {0.0, 2.531, 5.0, 180.0, 4.0, 7.5},
                                                                  {-0.873, 0.349, 4.0, 36.0, 3.2, 6.0},
                                                                  {-0.262, 0.262, 4.0, 36.0, 3.2, 6.0}}});
  std::array<GainLimits, kJointCount> gain_limits{};
  std::array<double, kJointsPerLeg> kp_nmprad{400, 400, 400, 400, 120, 120};
  std::array<double, kJointsPerLeg> kd_nmsprad{10, 10, 10, 10, 4, 4};
  // A robot that nobody balances topples about its ankles with 430 Nm/rad, more than kp_nmprad resists. CubeMars' and
  // Damiao's drives can be told no more than this, others less.
  std::array<double, kJointsPerLeg> kp_blind_nmprad{500, 500, 500, 500, 500, 500};
  std::array<double, kJointsPerLeg> kp_most_nmprad{10000, 10000, 10000, 10000, 10000, 10000};
  std::array<double, kJointsPerLeg> kd_most_nmsprad{1000, 1000, 1000, 1000, 1000, 1000};
  double delay_s = 0.003;
  double armature_kgm2 = 0.05;

  [[nodiscard]] const JointLimits& limits_of(Foot leg, std::size_t joint) const noexcept {
    return limits[joint_index(leg, joint)];
  }
  // Times as stiff as standing, and no stiffer than the drive may be.
  [[nodiscard]] constexpr double kp_of(std::size_t n, double times = 1.0) const noexcept {
    return within_kp(n, times * kp_nmprad[n % kJointsPerLeg]);
  }
  [[nodiscard]] constexpr double kp_blind_of(std::size_t n) const noexcept {
    return std::max(within_kp(n, kp_blind_nmprad[n % kJointsPerLeg]), kp_of(n));
  }
  [[nodiscard]] constexpr double kd_of(std::size_t n, double times = 1.0) const noexcept {
    return std::min(wanted_kd(n, times), gain_limits[n].kd_nmsprad);
  }
  // Damping that is wanted beside the drive's own, which its command has no room for: it is to come as a torque, from
  // speeds that are some cycles old by then. No more than the drive's own: two dampers, of which the late one is no
  // larger, take energy out of every motion, whatever moves and at whatever constant delay.
  [[nodiscard]] constexpr double kd_beside(std::size_t n, double times = 1.0) const noexcept {
    const double own_nmsprad = kd_of(n, times);
    return std::min(wanted_kd(n, times) - own_nmsprad, own_nmsprad);
  }

  static void visit(auto& p, auto& field) {
    field("limits", p.limits, kJointNames);
    field("kp_nmprad", p.kp_nmprad, 0.0, 10000.0, "Stiffness of either leg's drives, standing.");
    field("kd_nmsprad", p.kd_nmsprad, 0.0, 1000.0, "Damping of either leg's drives, standing.");
    field("kp_blind_nmprad", p.kp_blind_nmprad, 0.0, 10000.0,
          "Stiffness of a standing leg's drives while IMU or joints are silent and nobody balances; no less than "
          "standing.");
    field("kp_most_nmprad", p.kp_most_nmprad, 0.0, 10000.0,
          "No command asks either leg's drives for more stiffness, in a swing least of all.");
    field("kd_most_nmsprad", p.kd_most_nmsprad, 0.0, 1000.0, "No command asks either leg's drives for more damping.");
    field("delay_s", p.delay_s, 0.0, 0.05,
          "Delay of the drives by the data sheet: 2 ms on the bus, half a tick of hold.");
    field("armature_kgm2", p.armature_kgm2, 0.0, 5.0, "Inertia of a drive, seen at its joint.");
  }

 private:
  [[nodiscard]] constexpr double within_kp(std::size_t n, double wanted_nmprad) const noexcept {
    return std::min({wanted_nmprad, kp_most_nmprad[n % kJointsPerLeg], gain_limits[n].kp_nmprad});
  }
  [[nodiscard]] constexpr double wanted_kd(std::size_t n, double times) const noexcept {
    return std::min(times * kd_nmsprad[n % kJointsPerLeg], kd_most_nmsprad[n % kJointsPerLeg]);
  }
};

// A rectangle in the sole plane, sole frame.
struct SoleRectangle {
  double toe_x_m;
  double heel_x_m;
  double half_width_m;
  [[nodiscard]] constexpr double length_m() const noexcept { return toe_x_m - heel_x_m; }
  [[nodiscard]] constexpr double centre_x_m() const noexcept { return 0.5 * (toe_x_m + heel_x_m); }

  static void visit(auto& p, auto& field) {
    field("toe_x_m", p.toe_x_m, 0.02, 0.5, "Front end, from the sole's origin.");
    field("heel_x_m", p.heel_x_m, -0.5, -0.02, "Rear end, from the sole's origin.");
    field("half_width_m", p.half_width_m, 0.01, 0.2, "To either side.");
  }
};
// Both feet are alike.
struct SoleModel {
  SoleRectangle contact{0.17084, -0.073164, 0.04773};
  SoleRectangle collision{0.179, -0.081, 0.048};
  double collision_height_m = 0.07;

  // The four contact points in the sole frame: toe left, toe right, heel left, heel right.
  [[nodiscard]] std::array<Vec3, kContactsPerFoot> contacts_m() const noexcept {
    const SoleRectangle& r = contact;
    return {Vec3{r.toe_x_m, r.half_width_m, 0}, Vec3{r.toe_x_m, -r.half_width_m, 0},
            Vec3{r.heel_x_m, r.half_width_m, 0}, Vec3{r.heel_x_m, -r.half_width_m, 0}};
  }

  static void visit(auto& p, auto& field) {
    field("contact", p.contact);
    field("collision", p.collision);
    field("collision_height_m", p.collision_height_m, 0.0, 0.5, "Height of the collision box above the sole.");
  }
};

// Of the legs' shapes, which the camera sees.
struct LegRadii {
  double thigh_m = 0.07;
  double shank_m = 0.055;

  static void visit(auto& p, auto& field) {
    field("thigh_m", p.thigh_m, 0.01, 0.3, "Radius of the thigh.");
    field("shank_m", p.shank_m, 0.01, 0.3, "Radius of the shank.");
  }
};

struct NominalStance {
  double base_height_m = 0.79;
  double half_width_m = 0.1;

  static void visit(auto& p, auto& field) {
    field("base_height_m", p.base_height_m, 0.3, 1.2, "Base above the soles, standing.");
    field("half_width_m", p.half_width_m, 0.05, 0.3, "Soles from the middle plane, y_b of eq. 31.");
  }
};

// The mount of a camera that looks ahead and down by that pitch. Camera frame: x right, y down, z forward along the
// optical axis.
[[nodiscard]] inline Transform camera_mount(double pitch_down_rad, const Vec3& base_p_camera_m) noexcept {
  Mat3 forward;  // optical axis along base x
  forward << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {rotation_y(pitch_down_rad) * forward, base_p_camera_m};
}

// As the data sheets say.
struct SensorMounts {
  Transform base_T_camera = camera_mount(1.047, {0.14915, 0.0, -0.00702});
  // Mid-360 on the head pitch link (head at zero), pitched and mounted upside down.
  Transform base_T_lidar{rotation_y(0.2297) * rotation_x(kPi), Vec3{-0.0185 + 0.0218, 0.0, 0.6014 + 0.1054}};
  Mat3 base_R_imu = Mat3::Identity();

  static void visit(auto& p, auto& field) {
    field("base_T_camera", p.base_T_camera, "Mount of the camera, as the data sheet says.");
    field("base_T_lidar", p.base_T_lidar, "Mount of the lidar, as the data sheet says.");
    field("base_R_imu", p.base_R_imu, "Turn of the IMU, roll, pitch and yaw, R = Rz Ry Rx.");
  }
};

// Plain data, so that it can be loaded.
struct RobotModel {
  LegGeometry legs;
  MassModel masses;
  DriveModel drives;
  SoleModel sole;
  LegRadii radii;
  NominalStance stance;
  SensorMounts mounts;

  static void visit(auto& p, auto& field) {
    field("legs", p.legs);
    field("masses", p.masses);
    field("drives", p.drives);
    field("sole", p.sole);
    field("radii", p.radii);
    field("stance", p.stance);
    field("mounts", p.mounts);
  }
};

}  // namespace polygmap
