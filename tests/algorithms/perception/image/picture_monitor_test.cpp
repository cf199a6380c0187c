// SPDX-License-Identifier: Apache-2.0
// What the pictures lack of the way ahead, and what that explains.
#include "algorithms/perception/image/picture_monitor.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "sim_stub/robot_camera.hpp"
#include "tests/support/depth_scene.hpp"

namespace polygmap {
namespace {

class PictureMonitorTest : public ::testing::Test {
 protected:
  PictureMonitorTest() {
    scene_.intrinsics = robot_camera_intrinsics();
    scene_.place_camera(0.77, 1.047);
    scene_.add_stairs({});
    range_.set({}, scene_.intrinsics.depth_unit_m);
  }

  // Pictures whose pixels have no depth where `lost` says so, given the surface's point there, world.
  void show(int pictures, const std::function<bool(const Vec3&)>& lost, double noise_scale = 1.0) {
    const test::DepthPicture picture = test::render(scene_);
    std::vector<std::uint16_t> raw = picture.raw();
    const CameraIntrinsics& k = scene_.intrinsics;
    for (std::size_t i = 0; i < raw.size(); ++i) {
      const auto width = static_cast<std::size_t>(k.width_px);
      const double u = static_cast<double>(i % width), v = static_cast<double>(i / width);
      const Vec3 ray{(u - k.cx_px) / k.fx_px, (v - k.cy_px) / k.fy_px, 1.0};
      if (lost(scene_.world_T_camera * Vec3{picture.depth_m[i] * ray})) raw[i] = 0;
    }
    const Transform camera_T_way = scene_.world_T_camera.inverse() * way_;
    for (int i = 0; i < pictures; ++i)
      monitor_.take({i + 1, 1, k.width_px, k.height_px, raw.data()}, k, range_, camera_T_way, noise_scale);
  }

  test::DepthScene scene_;
  RawRange range_;
  Transform way_;  // world: the soles stand below the camera
  PictureMonitor monitor_{PictureMonitor::Params{}};
};

bool nothing(const Vec3&) { return false; }
bool everything(const Vec3&) { return true; }

TEST_F(PictureMonitorTest, Take_WholePictures_AreGoodAndExplainNothing) {
  show(60, nothing);
  EXPECT_LT(monitor_.missing_share(), 0.02);
  EXPECT_FALSE(monitor_.is_bad());
  for (int i = 0; i <= static_cast<int>(StopReason::kTooSteep); ++i) {
    const auto found = static_cast<StopReason>(i);
    EXPECT_EQ(monitor_.explain(found, true), found);
  }
}

TEST_F(PictureMonitorTest, Take_SecondTreadWithoutDepth_ExplainsWhatWasNotFound) {
  const auto second_tread = [](const Vec3& p) { return p.x() > 0.56 && p.x() < 0.9; };
  show(1, second_tread);
  EXPECT_FALSE(monitor_.is_bad()) << "one picture";
  show(59, second_tread);
  EXPECT_TRUE(monitor_.is_bad());
  for (const StopReason found : {StopReason::kNothingSeen, StopReason::kNoStaircase, StopReason::kRiseTooHigh,
                                 StopReason::kTreadTooShort, StopReason::kTooNarrow, StopReason::kEdgeUncertain})
    EXPECT_EQ(monitor_.explain(found, true), StopReason::kDepthMissing);
  for (const StopReason found :
       {StopReason::kNone, StopReason::kTop, StopReason::kMapStale, StopReason::kObstacle, StopReason::kLegsCannot})
    EXPECT_EQ(monitor_.explain(found, true), found);
  EXPECT_EQ(monitor_.explain(StopReason::kEdgeUncertain, false), StopReason::kEdgeUncertain) << "it walks up to it";
  show(60, nothing);
  EXPECT_FALSE(monitor_.is_bad()) << "the sun went";
}

TEST_F(PictureMonitorTest, Take_NoDepthBesideTheWay_IsGood) {
  show(60, [](const Vec3& p) { return std::abs(p.y()) > 0.3; });
  EXPECT_LT(monitor_.missing_share(), 0.02);
}

TEST_F(PictureMonitorTest, Take_ACameraThatLooksElsewhere_SaysNothing) {
  way_.p_m.x() = 3.0;
  show(60, everything);
  EXPECT_EQ(monitor_.missing_share(), 0.0);
}

TEST_F(PictureMonitorTest, Take_NoisyPictures_ExplainWhatWasTooVagueToFind) {
  show(60, nothing, 2.0);
  EXPECT_FALSE(monitor_.is_bad());
  show(60, nothing, 3.9);
  EXPECT_TRUE(monitor_.is_bad());
  for (const StopReason found :
       {StopReason::kNothingSeen, StopReason::kNoStaircase, StopReason::kEdgeUncertain, StopReason::kUnsteady})
    EXPECT_EQ(monitor_.explain(found, true), StopReason::kDepthNoisy);
  for (const StopReason found : {StopReason::kRiseTooHigh, StopReason::kTreadTooShort, StopReason::kTop})
    EXPECT_EQ(monitor_.explain(found, true), found);
}

}  // namespace
}  // namespace polygmap
