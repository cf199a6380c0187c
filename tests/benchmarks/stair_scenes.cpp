// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/stair_scenes.hpp"

#include <array>

#include "algorithms/robot/body_shapes.hpp"
#include "sim_stub/camera/depth_noise.hpp"
#include "sim_stub/camera/depth_renderer.hpp"
#include "sim_stub/robot_camera.hpp"
#include "sim_stub/world/clearance.hpp"
#include "sim_stub/world/stair_world.hpp"
#include "tests/support/nominal_robot.hpp"

namespace polygmap::bench {
namespace {

struct Place {
  std::uint64_t seed;  // of stairs and noise
  sim::StairParams stairs;
  sim::NoiseKind noise;
  int step;  // that the robot stands on, 0 = the floor
  double yaw_rad;
  double lift_m;  // of the left foot
};

constexpr double kHeelRoom_m = 0.0872;    // sole frame behind the nosing, standing in the middle of a tread
constexpr double kBeforeStairs_m = 0.35;  // from the first riser
constexpr double kCrouch_m = 0.02;        // below the nominal base height, so that the knees bend
constexpr double kLiftedForward_m = 0.15;

constexpr std::array<Place, 6> kPlaces{{
    {1, {.rise_m = 0.13}, sim::NoiseKind::kWhite, 0, 0.03, 0.0},
    {6, {.rise_m = 0.17, .width_m = 0.9}, sim::NoiseKind::kCorrelated, 2, -0.05, 0.0},
    {3, {.rise_m = 0.15}, sim::NoiseKind::kWhite, 4, 0.0, 0.12},
    {3, {.rise_m = 0.10, .tread_m = 0.30}, sim::NoiseKind::kCorrelated, 5, 0.08, 0.0},
    {5, {.rise_m = 0.14, .nosing_m = 0.02}, sim::NoiseKind::kWhite, 1, -0.02, 0.0},
    {6, {.rise_m = 0.16}, sim::NoiseKind::kCorrelated, 3, 0.02, 0.1},
}};

StairScene scene_at(const Place& place) {
  const sim::StairWorld world = sim::make_stairs(place.stairs, place.seed);
  const std::vector<sim::SolidBox> solids = sim::solids_of(world);
  Vec3 ground{-kBeforeStairs_m, 0.0, 0.0};
  if (place.step > 0) {
    const sim::Step& step = world.steps[static_cast<std::size_t>(place.step - 1)];
    ground = {step.nosing_x_m + kHeelRoom_m, 0.0, step.height_m};
  }
  const double base_height_m = kNominalBaseHeight_m - kCrouch_m;
  const Transform odom_T_base{rotation_z(place.yaw_rad), ground + Vec3{0.0, 0.0, base_height_m}};
  const Transform odom_T_camera = odom_T_base * base_T_camera();
  const bool lifted = place.lift_m > 0.0;

  StairScene scene;
  sim::DepthScene picture{odom_T_camera, solids, {}, base_T_camera(), true};
  for (const Foot foot : {Foot::kLeft, Foot::kRight}) {
    Vec3 sole_m{0.0, side_sign(foot) * kStanceHalfWidth_m, -base_height_m};
    if (lifted && foot == Foot::kLeft) sole_m += Vec3{kLiftedForward_m, 0.0, place.lift_m};
    const Transform base_T_foot{Mat3::Identity(), sole_m};
    const LegShapes shapes = base_leg_shapes({}, foot, solve_leg({}, foot, base_T_foot).q_rad);
    picture.base_legs[index_of(foot)] = shapes;
    scene.view.body[index_of(foot)] = transformed(base_T_camera().inverse(), shapes);
    scene.query.odom_T_sole[index_of(foot)] = odom_T_base * base_T_foot;
  }
  scene.view.intrinsics = robot_camera_intrinsics();
  scene.view.camera_up = odom_T_camera.R.transpose() * Vec3::UnitZ();
  scene.map_view = {odom_T_camera, 0.002, 0.002, robot_camera_intrinsics()};
  scene.query.odom_T_base = odom_T_base;
  scene.query.stance = lifted ? Foot::kRight : Foot::kLeft;
  scene.query.climbing = place.step > 0;

  sim::DepthRenderer renderer(robot_camera_intrinsics());
  renderer.render(picture);
  sim::CameraNoise noise({.kind = place.noise}, robot_camera_intrinsics(), place.seed);
  scene.depth.resize(static_cast<std::size_t>(kDepthWidth_px) * kDepthHeight_px);
  noise.apply(renderer, place.seed, 0.0, scene.depth.data());
  return scene;
}

}  // namespace

std::vector<StairScene> stair_scenes() {
  std::vector<StairScene> scenes;
  for (const Place& place : kPlaces) scenes.push_back(scene_at(place));
  return scenes;
}

}  // namespace polygmap::bench
