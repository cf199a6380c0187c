// SPDX-License-Identifier: Apache-2.0
// Parameters and camera from a configuration.
#include "firmware/link/config/apply_config.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "firmware/robot_camera.hpp"
#include "sim_stub/heap_trap.hpp"

namespace polygmap::link {
namespace {

struct Read {
  bool good = false;
  Params params;
  CameraIntrinsics camera = robot_camera_intrinsics();
  Sentence wrong;
};
std::unique_ptr<Read> applied(const char* text) {
  auto made = std::make_unique<Read>();
  const heap::ModuleCall call("apply_config");
  made->good = apply_config(text, made->params, made->camera, made->wrong);
  return made;
}
std::string refusal_of(const char* text) {
  const auto made = applied(text);
  EXPECT_FALSE(made->good) << text;
  return std::string(made->wrong.view());
}

TEST(LinkConfig, EveryKindOfParameter_IsSet) {
  const auto made = applied(R"(self_filter = false
imu_interval_ns = 5_000_000
[gait.planner]
pattern = "ss"
stand_off_m = 0.03
max_floor_steps = 40
[gait.step.durations]
stair_swing_ticks = 460
[robot.legs]
base_p_hip_m = [-0.002, 0.09, -0.066]
[robot.mounts]
base_R_imu = [0.0, 0.0, 0.1]
[robot.drives.limits.left_knee]
max_rad = 2.4
)");
  ASSERT_TRUE(made->good) << made->wrong.view();
  const Params& p = made->params;
  EXPECT_FALSE(p.self_filter);
  EXPECT_EQ(p.imu_interval_ns, 5'000'000);
  EXPECT_EQ(p.gait.planner.pattern, GaitPattern::kSingleStep);
  EXPECT_EQ(p.gait.planner.stand_off_m, 0.03);
  EXPECT_EQ(p.gait.planner.max_floor_steps, 40U);
  EXPECT_EQ(p.gait.step.durations.stair_swing_ticks, 460);
  EXPECT_EQ(p.robot.legs.base_p_hip_m, (Vec3{-0.002, 0.09, -0.066}));
  EXPECT_EQ(p.robot.mounts.base_R_imu, rotation_z(0.1));
  EXPECT_EQ(p.robot.drives.limits[kKnee].max_rad, 2.4);
  EXPECT_EQ(made->camera.fx_px, robot_camera_intrinsics().fx_px);
}

TEST(LinkConfig, WhatAParameterCannotBe_IsRefused) {
  EXPECT_EQ(refusal_of("[gait]\nsteady_m = 0.015\nsteadi_m = 1"), "config, line 3: gait.steadi_m is no parameter.");
  EXPECT_EQ(refusal_of("[gait]\nsteady_m = 0.6"), "config, line 2: gait.steady_m must be from 0.001 to 0.5, not 0.6.");
  EXPECT_EQ(refusal_of("gait.steady_m = true"), "config, line 1: gait.steady_m must be a number.");
  EXPECT_EQ(refusal_of("gait = 1"), "config, line 1: gait is no parameter.");
  EXPECT_EQ(refusal_of("self_filter = 1"), "config, line 1: self_filter must be true or false.");
  EXPECT_EQ(refusal_of("imu_interval_ns = 2e6\nimu_interval_ns = 2e6"),
            "config, line 2: imu_interval_ns is given twice.");
  EXPECT_EQ(refusal_of("imu_interval_ns = 2000000.5"),
            "config, line 1: imu_interval_ns must be a whole number, not 2000000.5.");
  EXPECT_EQ(refusal_of("gait.planner.pattern = \"DS\""),
            "config, line 1: gait.planner.pattern must be \"ds\" or \"ss\".");
  EXPECT_EQ(refusal_of("robot.mounts.base_R_imu = [1, 2]"),
            "config, line 1: robot.mounts.base_R_imu must be 3 numbers in brackets.");
  EXPECT_EQ(refusal_of("robot.legs.base_p_hip_m = [1,\n 2,\n 3]"),
            "config, line 1: robot.legs.base_p_hip_m must be from -1 to 1, not 2.");
}

TEST(LinkConfig, OneMoreThanTheOther_IsRefusedAtTheLaterLine) {
  EXPECT_EQ(
      refusal_of("[gait.planner]\nmin_stand_off_m = 0.04\nstand_off_m = 0.03"),
      "config, line 3: gait.planner.min_stand_off_m, 0.04, must not be more than gait.planner.stand_off_m, 0.03.");
}

TEST(LinkConfig, Camera_IsTakenWithItsNoiseAndRange) {
  const auto made = applied(R"([surfaces.limits]
max_depth_m = 3
[camera]
width = 512
height = 424
fx = 365.0
fy = 365.5
cx = 256
cy = 212
depth_unit_m = 0.001
noise_base_m = 0.005
)");
  ASSERT_TRUE(made->good) << made->wrong.view();
  EXPECT_EQ(made->camera.width_px, 512);
  EXPECT_EQ(made->camera.height_px, 424);
  EXPECT_EQ(made->camera.fy_px, 365.5);
  EXPECT_EQ(made->camera.depth_unit_m, 0.001);
  EXPECT_EQ(made->params.surfaces.noise.base_m, 0.005);
  EXPECT_EQ(made->params.surfaces.limits.min_depth_m, 0.2);
  EXPECT_EQ(made->params.surfaces.limits.max_depth_m, 3.0);  // a parameter is the stronger
}

TEST(LinkConfig, ACameraThatCannotBe_IsRefused) {
  const std::string whole =
      "[camera]\nwidth = 640\nheight = 480\nfx = 400\nfy = 400\ncx = 320\ncy = 240\ndepth_unit_m = 0.001\n";
  EXPECT_TRUE(applied(whole.c_str())->good);
  EXPECT_EQ(refusal_of("[camera]\nwidth = 640"),
            "config, line 2: camera.height is missing; a camera is given with all that is its own.");
  EXPECT_EQ(refusal_of("[camera]\nwidth = 1280"), "config, line 2: camera.width must be from 32 to 640, not 1280.");
  EXPECT_EQ(refusal_of("[camera]\nwidth = 64.5"), "config, line 2: camera.width must be a whole number, not 64.5.");
  EXPECT_EQ(refusal_of("[camera]\nwide = 640"), "config, line 2: camera.wide is no key of a camera.");
  EXPECT_EQ(refusal_of((whole + "fx = 401").c_str()), "config, line 9: camera.fx is given twice.");
  EXPECT_EQ(refusal_of((whole + "max_depth_m = 0.1").c_str()),
            "config, line 9: camera.min_depth_m must be less than max_depth_m.");
  EXPECT_EQ(refusal_of("width = 640"), "config, line 1: width is no parameter.");
}

}  // namespace
}  // namespace polygmap::link
