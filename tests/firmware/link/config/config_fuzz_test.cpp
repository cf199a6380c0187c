// SPDX-License-Identifier: Apache-2.0
// A million configurations that are damaged: each is taken or refused with a sentence, and nothing else happens.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "firmware/link/config/apply_config.hpp"
#include "firmware/robot_camera.hpp"
#include "tests/firmware/daemon/text_mutator.hpp"

namespace polygmap::link {
namespace {

constexpr std::string_view kGood = R"(# a robot of its own
self_filter = true
imu_interval_ns = 2_000_000
[gait.planner]
pattern = "ss"  # one foot on every tread
stand_off_m = 3.2e-2
[robot.legs]
base_p_hip_m = [-0.0025, 0.087,
  -0.066, ]
[robot.mounts]
base_R_imu = [0.0, 0.1, -0.2]
[camera]
width = 640
height = 480
fx = 400.5
fy = 400.5
cx = 320
cy = 240
depth_unit_m = 0.001
)";

void read_damaged(unsigned seed, int runs) {
  test::TextMutator mutator(seed);
  const auto params = std::make_unique<Params>();
  int taken = 0, refused = 0;
  for (int i = 0; i < runs; ++i) {
    const std::string text = mutator.mutated(kGood);
    CameraIntrinsics camera = robot_camera_intrinsics();
    Sentence wrong;
    if (apply_config(text.c_str(), *params, camera, wrong)) {
      ++taken;
      ASSERT_LE(camera.width_px, kDepthWidth_px);
      ASSERT_LE(camera.height_px, kDepthHeight_px);
    } else {
      ++refused;
      ASSERT_TRUE(wrong.view().starts_with("config")) << wrong.view();
      ASSERT_EQ(wrong.view().find('\n'), std::string_view::npos);
    }
  }
  EXPECT_GT(taken, runs / 50);
  EXPECT_GT(refused, runs / 50);
}

TEST(LinkConfigFuzz, DamagedText_IsTakenOrRefused) { read_damaged(1, 5'000); }
TEST(LongFuzzLinkConfig, DamagedText_IsTakenOrRefused) { read_damaged(2, 1'000'000); }

}  // namespace
}  // namespace polygmap::link
