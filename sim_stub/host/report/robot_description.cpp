// SPDX-License-Identifier: Apache-2.0
#include "sim_stub/host/report/robot_description.hpp"

#include "algorithms/robot/body_shapes.hpp"

namespace polygmap::sim {
namespace {

// Of the joints before it in its leg, the frame that a joint's origin is in.
Vec3 origin_m(const LegGeometry& legs, std::size_t joint, double side) {
  switch (joint) {
    case kHipRoll:
      return {legs.base_p_hip_m.x(), side * legs.base_p_hip_m.y(), legs.base_p_hip_m.z()};
    case kHipPitch:
      return {legs.hip_p_hip_pitch_m.x(), side * legs.hip_p_hip_pitch_m.y(), legs.hip_p_hip_pitch_m.z()};
    case kKnee:
      return {0.0, 0.0, -legs.thigh_m};
    case kAnklePitch:
      return {0.0, 0.0, -legs.shank_m};
    default:
      return Vec3::Zero();
  }
}
const char* axis_of(std::size_t joint) {
  return joint == kHipYaw ? "z" : joint == kHipRoll || joint == kAnkleRoll ? "x" : "y";
}

ReportJson capsule_json(std::size_t joint, double length_m, double radius_m) {
  return {{"joint", joint},
          {"type", "capsule"},
          {"a_m", {0.0, 0.0, 0.0}},
          {"b_m", {0.0, 0.0, -length_m}},
          {"radius_m", radius_m}};
}
ReportJson rectangle_json(const SoleRectangle& r) { return {r.toe_x_m, r.heel_x_m, r.half_width_m}; }

}  // namespace

ReportJson robot_json(const RobotModel& robot) {
  ReportJson joints = ReportJson::array(), shapes = ReportJson::array();
  for (const Foot leg : {Foot::kLeft, Foot::kRight}) {
    const std::size_t first = joint_index(leg, 0);
    for (std::size_t j = 0; j < kJointsPerLeg; ++j) {
      joints.push_back({{"name", kJointNames[first + j]},
                        {"parent", j == 0 ? -1 : static_cast<int>(first + j) - 1},
                        {"origin_m", rounded(origin_m(robot.legs, j, side_sign(leg)), 5)},
                        {"axis", axis_of(j)}});
    }
    shapes.push_back(capsule_json(first + kHipPitch, robot.legs.thigh_m, robot.radii.thigh_m));
    shapes.push_back(capsule_json(first + kKnee, robot.legs.shank_m, robot.radii.shank_m));
    const OrientedBox foot = collision_box(robot.sole, Transform{});
    shapes.push_back({{"sole", leg == Foot::kLeft ? "left" : "right"},
                      {"type", "box"},
                      {"centre_m", rounded(foot.centre.p_m)},
                      {"half_m", rounded(foot.half_m)}});
  }
  return {
      {"joints", joints},
      {"shapes", shapes},
      {"sole",
       {{"contact_m", rectangle_json(robot.sole.contact)},
        {"collision_m", rectangle_json(robot.sole.collision)},
        {"joint", {{"left", joint_index(Foot::kLeft, kAnkleRoll)}, {"right", joint_index(Foot::kRight, kAnkleRoll)}}},
        {"origin_m", {0.0, 0.0, -robot.legs.ankle_to_sole_m}}}}};
}

}  // namespace polygmap::sim
