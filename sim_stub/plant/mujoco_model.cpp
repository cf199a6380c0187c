// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/plant/mujoco_model.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "sim_stub/nominal_robot.hpp"
#include "sim_stub/world/clearance.hpp"

namespace polygmap::sim {
namespace {

class Xml {
 public:
  void add(const char* format, ...) __attribute__((format(printf, 2, 3))) {
    std::array<char, 512> line{};
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(line.data(), line.size(), format, arguments);
    va_end(arguments);
    text_ += line.data();
    text_ += '\n';
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

constexpr double kSoleThickness_m = 0.03;

// Shapes that give a link its inertia and touch nothing: of each leg link, half extents of a box about its centre.
constexpr std::array<std::array<double, 3>, kJointsPerLeg> kLinkHalf_m{{{0.04, 0.04, 0.04},
                                                                        {0.04, 0.04, 0.04},
                                                                        {0.06, 0.06, 0.12},
                                                                        {0.04, 0.04, 0.15},
                                                                        {0.02, 0.02, 0.02},
                                                                        {0.12, 0.04, 0.015}}};

// Of boxes alone: between two boxes contacts are exact, while those of a cylinder on a tread's edge may push it off
// with hundreds of newtons (as MuJoCo 2.2 does for all but a few pairs of shapes). Where the toe
// is round, each of its corners is a disc that boxes are inscribed in; where the sole's ends are worn, both are a
// little higher there.
void add_sole(Xml& xml, const char* side, const RobotErrors& errors, double ankle_to_sole_m) {
  const SoleRectangle& sole = errors.sole.collision;
  constexpr double kWorn_m = 0.004;
  constexpr double kLeast_m = 1e-3;  // of a box's half width
  constexpr int kInscribed = 4;      // boxes whose corners lie on a disc
  const double round_m = std::min(errors.toe_round_m, sole.half_width_m - kLeast_m), worn_m = errors.sole_edge_m;
  const auto box = [&](double from_x_m, double to_x_m, double half_width_m, double above_m, double y_m = 0.0) {
    xml.add("<geom class='%s' type='box' pos='%.9g %.9g %.9g' size='%.9g %.9g %.9g'/>", side, 0.5 * (from_x_m + to_x_m),
            y_m, 0.5 * (kSoleThickness_m + above_m) - ankle_to_sole_m, 0.5 * (to_x_m - from_x_m), half_width_m,
            0.5 * (kSoleThickness_m - above_m));
  };
  const auto outline = [&](double from_x_m, double to_x_m, double above_m) {
    box(from_x_m, to_x_m - round_m, sole.half_width_m, above_m);
    if (round_m == 0.0) return;
    box(to_x_m - round_m, to_x_m, sole.half_width_m - round_m, above_m);
    const double x_m = to_x_m - round_m, y_m = sole.half_width_m - round_m;
    for (int i = 0; i < kInscribed; ++i) {
      const double rad = (i + 0.5) * kPi / (2.0 * kInscribed);
      for (const double left : {1.0, -1.0})
        box(x_m, x_m + round_m * std::cos(rad), 0.5 * round_m * std::sin(rad), above_m,
            left * (y_m + 0.5 * round_m * std::sin(rad)));
    }
  };
  outline(sole.heel_x_m + worn_m, sole.toe_x_m - worn_m, 0.0);
  if (worn_m > 0.0) outline(sole.heel_x_m, sole.toe_x_m, kWorn_m);
}

void add_link(Xml& xml, Foot leg, std::size_t joint, const RobotErrors& errors, const MujocoPlant::Params& params) {
  const LegGeometry& g = errors.legs[index_of(leg)];
  constexpr std::array<const char*, kJointsPerLeg> kAxis{"1 0 0", "0 0 1", "0 1 0", "0 1 0", "0 1 0", "1 0 0"};
  const char* side = leg == Foot::kLeft ? "left" : "right";
  const double sign = side_sign(leg);
  const std::array<Vec3, kJointsPerLeg> origin_m{g.base_p_hip_m,         Vec3::Zero(),           g.hip_p_hip_pitch_m,
                                                 Vec3{0, 0, -g.thigh_m}, Vec3{0, 0, -g.shank_m}, Vec3::Zero()};
  const Vec3& p = origin_m[joint];
  const JointLimits& limits = nominal_robot().drives.limits_of(leg, joint);
  const LinkMass link = nominal_robot().masses.leg[joint];
  const auto& half = kLinkHalf_m[joint];
  xml.add("<body name='%s_%zu' pos='%.9g %.9g %.9g'>", side, joint + 1, p.x(), sign * p.y(), p.z());
  xml.add("<joint name='drive_%zu' axis='%s' range='%.9g %.9g'/>", joint_index(leg, joint), kAxis[joint],
          limits.min_rad, limits.max_rad);
  if (params.backlash_rad > 0.0) {
    xml.add(
        "<joint name='play_%zu' axis='%s' range='%.9g %.9g' armature='1e-4' damping='0.01' "
        "frictionloss='0' solreflimit='0.002 1' solimplimit='0.99 0.999 0.0001'/>",
        joint_index(leg, joint), kAxis[joint], -0.5 * params.backlash_rad, 0.5 * params.backlash_rad);
  }
  const double wide = std::sqrt(params.inertia_scale);
  xml.add("<geom class='mass' type='box' pos='%.9g %.9g %.9g' size='%g %g %g' mass='%.9g'/>", link.centre_m.x(),
          sign * link.centre_m.y(), link.centre_m.z(), wide * half[0], wide * half[1], wide * half[2],
          params.leg_mass_scale * link.mass_kg);
  if (joint == kHipPitch || joint == kKnee) {
    const bool thigh = joint == kHipPitch;
    xml.add("<geom class='%s' type='capsule' fromto='0 0 0 0 0 %.9g' size='%g'/>", side,
            thigh ? -g.thigh_m : -g.shank_m, thigh ? nominal_robot().radii.thigh_m : nominal_robot().radii.shank_m);
  }
  if (joint == kAnkleRoll) add_sole(xml, side, errors, g.ankle_to_sole_m);
}

void add_solid(Xml& xml, const SolidBox& solid, std::size_t number) {
  if (solid.round_m > 0.0) {
    const Capsule bar = bar_of(solid);
    xml.add(
        "<geom class='ground' name='solid_%zu' type='capsule' fromto='%.9g %.9g %.9g %.9g %.9g %.9g' size='%.9g' "
        "user='%d'/>",
        number, bar.a_m.x(), bar.a_m.y(), bar.a_m.z(), bar.b_m.x(), bar.b_m.y(), bar.b_m.z(), bar.radius_m, solid.step);
    return;
  }
  const OrientedBox box = solid.box();
  const Vec3 centre = box.centre.p_m, half = box.half_m;
  const Eigen::Quaterniond turn(box.centre.R);
  xml.add(
      "<geom class='ground' name='solid_%zu' type='box' pos='%.9g %.9g %.9g' quat='%.9g %.9g %.9g %.9g' size='%.9g "
      "%.9g %.9g' user='%d'/>",
      number, centre.x(), centre.y(), centre.z(), turn.w(), turn.x(), turn.y(), turn.z(), half.x(), half.y(), half.z(),
      solid.step);
}

}  // namespace

std::string mujoco_model(const MujocoPlant::Params& params, const StairWorld& world, const RobotErrors& errors) {
  Xml xml;
  xml.add("<mujoco><compiler angle='radian' autolimits='true'/><size nuser_geom='1'/>");
  xml.add("<option timestep='0.001' gravity='0 0 %.9g' cone='elliptic' impratio='10'/>", -kGravity_mps2);
  xml.add("<default><joint armature='%.9g' frictionloss='%.9g' damping='%.9g'/>", params.armature_kgm2,
          params.joint_friction_nm, params.joint_damping_nmsprad);
  xml.add("<geom friction='%.9g 0.005 0.0001' condim='4' solref='%.9g 1'/>", params.friction, params.ground_s);
  xml.add("<default class='mass'><geom contype='0' conaffinity='0'/></default>");
  // Torso and both legs touch the ground, and one leg the other.
  xml.add("<default class='torso'><geom contype='2' conaffinity='1' mass='0'/></default>");
  xml.add("<default class='left'><geom contype='6' conaffinity='1' mass='0'/></default>");
  xml.add("<default class='right'><geom contype='2' conaffinity='5' mass='0'/></default>");
  xml.add("<default class='ground'><geom contype='1' conaffinity='2'/></default></default>");
  xml.add("<worldbody><geom class='ground' name='floor' type='plane' size='0 0 1'/>");
  std::size_t number = 0;
  for (const SolidBox& solid : solids_of(world)) add_solid(xml, solid, number++);
  const LinkMass torso = nominal_robot().masses.torso;
  xml.add("<body name='base'><freejoint/>");
  const double wide = std::sqrt(params.inertia_scale);
  xml.add("<geom class='mass' type='box' pos='%.9g %.9g %.9g' size='%.9g %.9g %.9g' mass='%.9g'/>",
          torso.centre_m.x() + params.torso_offset_x_m, torso.centre_m.y() + params.torso_offset_y_m,
          torso.centre_m.z() + params.torso_offset_z_m, wide * torso_half_m().x(), wide * torso_half_m().y(),
          wide * torso_half_m().z(), params.torso_mass_scale * torso.mass_kg);
  xml.add("<geom class='torso' type='box' pos='%.9g %.9g %.9g' size='%.9g %.9g %.9g'/>", torso.centre_m.x(),
          torso.centre_m.y(), torso.centre_m.z(), torso_half_m().x(), torso_half_m().y(), torso_half_m().z());
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) add_link(xml, leg, j, errors, params);
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) xml.add("</body>");
  }
  xml.add("</body></worldbody></mujoco>");
  return xml.text();
}

}  // namespace polygmap::sim
